// One tile of a map, chosen and factored; see kpsa/tiles.h. Used by BuildTiles alone.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "kpsa/training/tile_builder.h"

namespace kpsa::engine {

// f - mu of the tile's points ~ u * diag(scale) * v * y_J, columns of u and v as they are stored.
struct TileFactors {
  bool direct = false;
  std::vector<std::uint32_t> columns;  // [|J|] J
  Eigen::Index wide = 0;  // columns of u with whole numbers in [-32639, 32639]; the others are in [-127, 127]
  Eigen::MatrixXd u;      // [cn x k]
  Eigen::VectorXd scale;  // [k]
  Eigen::MatrixXd v;      // [k x |J|] exact in half precision; direct: empty, k = |J|
  double squared_error = 0;  // expected under the covariance, summed over the points of the tile
  double largest = 0;        // largest point error in the samples
};

// gain: B of the tile [cn x r]; covariance G [r x r]; samples of y [r x S], may be empty. may_be_direct:
// false where latents are wanted, which only factors have.
TileFactors FactorTile(const Eigen::MatrixXd& gain, const Eigen::MatrixXd& covariance,
                       const Eigen::MatrixXd& samples, int components, const TileOptions& options,
                       bool may_be_direct = true);

// As it is stored, and the power of two that brings the largest of some numbers into [512, 1024) before.
double RoundToHalf(double value);
double ScaleForHalfs(double largest);

}  // namespace kpsa::engine
