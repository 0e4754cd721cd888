// Characters of many points. Neighbours move alike, so some points (TrainingRig::every) say what is measured, for which
// tiles, and how finely tiles are stored: training takes the time and the memory of a small character. Then tiles are
// made of all points, a part of the mesh after the other: its training poses are evaluated again, for these points
// alone. A tile measures what the tile of some points measures that reaches over it. What is promised is calibrated
// with all points. Internal to training.
#pragma once

#include "kpsa/training/finer_subspaces.h"

namespace kpsa::engine {

class WholeSubspace {
 public:
  // rig: as Train has it, with all points. some: what was chosen on some of them, calibrated; both must outlive this.
  WholeSubspace(const TrainingRig& rig, const TrainOptions& options, const SubspaceCandidates& some);

  // Made, described and calibrated. Frees the poses that it was chosen with.
  Result<Subspace> Make(const RangeFinder& ranges, CalibrationSize size);
  // As SubspaceCandidates has it: the setup of all points, cues in terms of its layout, what a frame costs.
  TrainingSetup* setup() { return &setup_; }
  const SubspaceCandidates& candidates() const { return candidates_; }

 private:
  Status MakeTiles(Subspace* subspace);

  const SubspaceCandidates& some_;
  TrainingSetup setup_;
  SubspaceCandidates candidates_;
};

}  // namespace kpsa::engine
