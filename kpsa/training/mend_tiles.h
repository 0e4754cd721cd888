// Mends points that a finished subspace is farthest off in frames of the clips (kpsa/tile_mends.h): mostly one or two of
// a mesh, whose frames a deltaMush turns over, and which alone go beyond the tolerance in other clips. Internal to
// training.
#pragma once

#include "kpsa/training/cue_selection.h"
#include "kpsa/training/training_setup.h"

namespace kpsa::engine {

inline constexpr std::size_t kMendPoses =
    1200;  // that points are judged by, at most; each is evaluated up to three times

// setup: of the training of the subspace, with all poses drawn; cues: those of the subspace, in terms of its layout.
// split: last steps of the meshes, null where there is none. Leaves the calibration as it is, which is cautious then.
Status MendTiles(TrainingSetup* setup, const std::vector<Compiler::SplitPoints>& split, const CueSet& cues,
                 Subspace* subspace);

}  // namespace kpsa::engine
