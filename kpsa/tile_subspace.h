// A subspace whose tiles have cues of their own (kpsa/tile_cues.h), judged by what its tiles doubt alone.
// Internal to training.
#pragma once

#include "kpsa/subspace.h"
#include "kpsa/tile_cues.h"

namespace kpsa {

struct TileSubspace {
  Subspace subspace;
  CueSet cues;  // those that a tile reads, in the order of the subspace's rows
};

// poses: centred with `mean`, the first clip_poses of clips. candidates: by tile, of all outputs one after
// the other. The caller fills what MakeSubspace's does.
TileSubspace MakeTileSubspace(const Eigen::VectorXd& mean, const PoseMatrix& poses, std::size_t clip_poses,
                              std::span<const TileCandidates> candidates, const TileCueOptions& cue_options,
                              std::vector<SubspaceOutput> outputs, const TileOptions& options);

}  // namespace kpsa
