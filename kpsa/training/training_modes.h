// The modes of the training poses, and the cues that tell their coordinates. Internal to training.
#pragma once

#include <vector>

#include "kpsa/training/cue_choice.h"
#include "kpsa/training/pca.h"
#include "kpsa/training/training_poses.h"

namespace kpsa::engine {

struct TrainingModes {
  Eigen::VectorXd mean;  // of the poses' columns
  Pca pca;
  CueNoise noise{0};
  std::vector<Double3> positions;  // of all points on the average, and those at stages
  double diagonal = 0;             // of the outputs' box, metres
  bool still = false;              // nothing moves in the space
};
// Centres the poses with their mean, and says where points are on the average.
void CentrePoses(const TrainingSetup& setup, TrainingPoses* poses, TrainingModes* modes,
                 TrainingRecord* record);
// Of poses that are centred. few: no more than say what moves at all. Errors: those of ComputePca.
Status FindModes(const TrainingSetup& setup, const TrainingPoses& poses, bool few, TrainingModes* modes,
                 TrainingRecord* record);

struct TrainingCues {
  CueChoice choice;  // the cues for all points
  CueSet set;        // of the subspace as it stands: these, or those of its tiles
};
// Light: also takes as many modes as the judges confirm. Errors: no cue moves.
Status ChooseTrainingCues(double tolerance, const TrainingPoses& poses, TrainingSetup* setup,
                          TrainingModes* modes, TrainingCues* cues);

}  // namespace kpsa::engine
