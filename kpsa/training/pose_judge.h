// Scores and errors of recorded poses under a subspace, through the code that runs in the graph. Internal to
// training.
#pragma once

#include <memory>
#include <vector>

#include "kpsa/subspace.h"
#include "kpsa/training/cue_selection.h"
#include "kpsa/training/pose_matrix.h"
#include "kpsa/training/trainer.h"

namespace kpsa::engine {

struct JudgedPose {
  double measured = 0, doubt = 0;       // parts of the score (ScoreMix)
  double error = 0;                     // as CalibrationPair's
  std::vector<PatchPair> patches = {};  // of each patch, where the subspace has some: its doubt and its error
  std::vector<float> tile_doubts = {}, tile_errors = {};  // likewise of tiles, where they have doubts
};
// What it is to a calibration with this score, and these patches. guard: what guards ask for of all points;
// guards_of_patches: of each patch, or empty.
CalibrationPair PairOf(const JudgedPose& pose, const ScoreMix& mix, const PatchLayout& patches, double guard,
                       int kind, std::span<const float> guards_of_patches = {});

class PoseJudge {
 public:
  // cues: those of the subspace, in terms of the layout. of_tiles: what is told of each tile is wanted.
  // Errors are those of what comes out of the rig's last steps, where inner points are reconstructed.
  PoseJudge(const TrainingRig& rig, const Subspace& subspace, const PoseLayout& layout, const CueSet& cues,
            bool of_tiles);
  // Every pose reconstructed, whatever its score. Poses are not centred.
  std::vector<JudgedPose> Judge(const PoseMatrix& poses);
  // Over all poses so far, of the pure reconstruction, metres (of light: its units).
  double rms() const;
  double max() const { return max_; }

 private:
  const Subspace& subspace_;
  const PoseLayout& layout_;
  const CueSet& cues_;
  const bool of_tiles_;
  std::vector<std::shared_ptr<const LastStep::Bound>> steps_;  // by output; null: none
  std::vector<std::vector<Index>> tile_of_point_;              // by output
  double sum_ = 0, max_ = 0;
  std::size_t poses_ = 0;
};

}  // namespace kpsa::engine
