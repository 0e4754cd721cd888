// What may be measured for each tile: the entries of the world matrices of the joints that move it, which are
// those that the compiler keeps for its points alone, and points near it. Internal to training.
#pragma once

#include "kpsa/training/cue_places.h"
#include "kpsa/training/tile_cues.h"

namespace kpsa::engine {

struct TileCandidateOptions {
  PoseLayout layout;
  std::span<const Index> totals;       // points of each mesh
  std::span<const Signal> signals;     // of the layout's scalars
  std::span<const CueRef> points;      // all that may be measured (CuePlaces::of_tiles)
  std::span<const Double3> positions;  // mean, of the outputs and then the stage points
  std::span<const CandidateStage> stages;
};

// By tile, mesh after mesh: under the controls, and under each clip.
Result<std::vector<TileCandidates>> FindTileCandidates(const TrainingRig& rig, Compiler* compiler,
                                                       const std::vector<TrainingClip>& clips,
                                                       const TileCandidateOptions& options);

}  // namespace kpsa::engine
