// Tiles with cues of their own (kpsa/training/tile_subspace.h) learn one by one: those that are wrong in new
// poses, or doubt them, are chosen and fitted anew with these; all others stay as they are, byte for byte,
// with their cues. Internal to training.
#pragma once

#include "kpsa/training/tile_builder.h"
#include "kpsa/training/tile_subspace.h"

namespace kpsa::engine {

// What tiles are made of.
struct TileTraining {
  const Eigen::VectorXd* mean = nullptr;  // what the poses are centred with
  std::size_t clip_poses = 0;             // the first poses, neighbours in time of each other
  TileCueOptions cues;
  TileOptions storage;
};

// The largest error and doubt of every tile, and the largest doubt of every pose, in the poses from `first`
// on, each `stride`-th.
struct TileTrial {
  std::vector<double> errors, doubts;  // by tile, scene units
  std::vector<double> of_poses;
};
TileTrial TryTiles(const TileSubspace& made, const Eigen::VectorXd& mean, const PoseMatrix& poses,
                   std::size_t first = 0, std::size_t stride = 1);

// The tiles that have something to learn from poses: a point of theirs is farther off than the error, or they
// doubt more than they do in poses that they know, and more than `doubt`.
std::vector<char> TilesToTeach(const TileTrial& trial, const TileTrial& known, double error, double doubt);

// These made anew of all poses, centred; candidates: of all tiles.
TileSubspace TeachTiles(const TileSubspace& made, std::span<const char> taught, const PoseMatrix& poses,
                        std::span<const TileCandidates> candidates, const TileTraining& training);

// All of it, one clip after the other, so that those which were learnt before find what they found then.
// learnt: centred poses of each clip; poses: those that the tiles were made of, which it leaves as they are.
void TeachClips(std::span<const PoseMatrix> learnt, std::span<const TileCandidates> candidates,
                const TileTraining& training, double tolerance, PoseMatrix* poses, TileSubspace* made);

}  // namespace kpsa::engine
