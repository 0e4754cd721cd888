// p' = p + sum_c w_c d_c: offsets of a few control points, blended with fixed weights (wire, lattice).
#pragma once

#include <span>
#include <vector>

#include "base/matrix.h"
#include "base/points.h"
#include "nodes/kernels/parallel_hook.h"

namespace kpsa::engine {

class ControlBlend {
 public:
  ControlBlend() = default;
  // Row i: the controls and weights of output point i, `width` of each (unused ones: weight 0, any control).
  // Rows whose weights are all 0 are dropped; their points keep their bits.
  ControlBlend(std::size_t width, std::span<const Index> controls, std::span<const float> weights);

  std::size_t affected_points() const { return points_.size(); }
  // Adds to `points` in place, which has the bound count. offsets: x y z 0 of every control, 16-byte aligned,
  // the envelope multiplied in.
  void Run(const float* offsets, PointsView points, const Parallel* parallel) const noexcept;

 private:
  std::size_t width_ = 0;
  std::vector<Index> points_;  // affected, ascending
  std::vector<Index> controls_;
  std::vector<float> weights_;
};

// Offsets as `ControlBlend::Run` wants them: those of a view, turned by the linear part of a matrix (null: as they
// are), times the envelope. Writes whole vectors of points, kPointPadding - 1 more than there are at most. False if
// none of them moves.
bool PackOffsets(ConstPointsView offsets, const Matrix4* turn, double envelope, float* packed) noexcept;

}  // namespace kpsa::engine
