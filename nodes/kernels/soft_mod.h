// cluster and softMod: p' = p + w (M p - p), with weights fixed at bind and a matrix that moves.
#pragma once

#include <span>
#include <vector>

#include "base/matrix.h"
#include "base/points.h"
#include "nodes/kernels/affine_delta.h"
#include "nodes/kernels/falloff.h"
#include "nodes/kernels/parallel_hook.h"
#include "nodes/kernels/weights.h"

namespace kpsa::engine {

// A local kernel. A softMod's falloff (falloff.h, RadialFalloff) is multiplied into the point weights.
class ClusterKernel {
 public:
  struct Inputs {
    Matrix4 delta;  // in the points' space: the identity leaves them alone
    Double3 pivot;  // any point near the cluster, in the points' space (precision only)
    double envelope = 1;
  };

  ClusterKernel(std::span<const Index> out_points, std::span<const float> point_weights = {});

  std::size_t point_count() const { return count_; }
  std::size_t ScratchFloats() const { return 0; }
  void Run(const Inputs& inputs, ConstPointsView in, PointsView out, std::span<float> scratch,
           const Parallel* parallel = nullptr) const noexcept;
  void Run(const AffineDelta& delta, double envelope, ConstPointsView in, PointsView out,
           const Parallel* parallel = nullptr) const noexcept;

 private:
  std::size_t count_ = 0;
  std::size_t begin_ = 0, end_ = 0;  // outside of it all weights are 0; begin_ a multiple of 16
  AlignedFloats weights_;
};

}  // namespace kpsa::engine
