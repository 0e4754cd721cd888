// The poses that a subspace is made of, and those that judge it. Internal to training.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "kpsa/training/pose_matrix.h"
#include "kpsa/training/training_setup.h"
#include "kpsa/training_record.h"

namespace kpsa::engine {

struct TrainingPoses {
  explicit TrainingPoses(const PoseLayout& layout) : poses(layout), judges(layout) {}

  // How many of so many samples there is time to record, by what those took that are here.
  std::size_t SampledWithin(const TimeLimit& limit, std::size_t samples) const;

  PoseMatrix poses;
  PoseMatrix judges;                // new ones, where cues have places to choose from
  std::vector<int> judge_kinds;     // PoseKind of each
  std::vector<PoseMatrix> learnt;   // TrainOptions::by_tile_as_before: of each clip, then posed
  std::optional<PoseMatrix> spare;  // not for modes
  std::size_t clip_poses = 0;       // of those for modes, the first ones
  double pose_seconds = 0;          // that recording one takes
  std::size_t not_sampled = 0;      // for want of time
};

// Evaluates them. Reads the setup and draws with its samplers; writes which there are to the record. Errors: too few
// poses, one that fails to evaluate, cancelled.
Status RecordPoses(TrainingSetup* setup, TrainingPoses* poses, TrainingRecord* record);
// Takes away what there is no time for, and sets poses aside that modes can do without.
void FitPoses(TrainingSetup* setup, TrainingPoses* poses, TrainingRecord* record);
// Products of scalars, which are cues as others are from here on: in the recorder, and in all rows.
void ChooseProducts(TrainingSetup* setup, TrainingPoses* poses);

}  // namespace kpsa::engine
