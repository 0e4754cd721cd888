// Products of the latents of a tile: a deformer stack is nearly linear in what cues measure,
// and what the linear map leaves is mostly quadratic. z = V y_J are the latents of the tile, its strongest
// motions; the first of them, whitened and clipped, are multiplied in pairs, and a ridge regression on the
// products p fits what the tile is off by: x = mean + U (z + W p).
//
// Gates: a product counts by the poses that it is carried by (effective support); products stay only where
// they lower the largest errors of poses that they were not fitted to. U gets more columns where they move
// points as the linear map never does.
#pragma once

#include "kpsa/training/tile_builder.h"
#include "kpsa/training/tile_factorer.h"

namespace kpsa::engine {

struct TileProducts {
  std::vector<std::uint8_t> pairs;  // [P][2]; empty: products do not help
  Eigen::VectorXd whitening;        // [kLatents] inverse deviations of the latents; 0 where there is none
  Eigen::MatrixXd w;                // [k x P] exact in half precision; k of the factors, which may have grown
  Eigen::MatrixXd doubt;            // [3 kDoubtPoints x P] x of all points, then y and z; halfs
  double doubt_scale = 1;
};

// `factors`: of a tile of 3 components, not direct, with what the poses are there (target [3n x T], less the
// mean) and y of them (measured [r x T]), the first clip_poses of clips; U grows by at most kMaxTileRank
// columns. Errors below options.max_budget / 4 are left alone.
TileProducts FitProducts(const Eigen::MatrixXd& target, const Eigen::MatrixXd& measured,
                         std::size_t clip_poses, const TileOptions& options, TileFactors* factors);

}  // namespace kpsa::engine
