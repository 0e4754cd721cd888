// Reconstruction without tiles: x = mean + B y in float32, the twin that kpsa/tiles.h is tested and measured
// against. Allocates nothing once made; const functions may run on any thread.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>

#include "base/points.h"
#include "kpsa/aligned_array.h"

namespace kpsa::engine {

class DenseMap {
 public:
  DenseMap() = default;
  // gain: B [cN x r]; mean [cN] interleaved.
  DenseMap(const Eigen::MatrixXd& gain, const Eigen::VectorXd& mean, int components);
  std::size_t points() const { return points_; }
  std::size_t inputs() const { return inputs_; }
  std::size_t bytes() const { return (matrix_.size() + mean_.size()) * sizeof(float); }
  void Reconstruct(std::span<const float> y, PointsView out) const;

 private:
  std::size_t points_ = 0, inputs_ = 0;
  int components_ = 3;
  AlignedArray<float> matrix_;  // [panels][r][32c]
  AlignedArray<float> mean_;    // [panels][32c]
};

}  // namespace kpsa::engine
