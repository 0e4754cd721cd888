// p' = p + envelope sum_k w_k delta_k over sparse targets (glTF 2.0, 3.7.2.2; Maya's blendShape).
#pragma once

#include <span>
#include <vector>

#include "base/points.h"
#include "base/status.h"
#include "nodes/kernels/parallel_hook.h"

namespace kpsa::engine {

// The points that a target moves. deltas: x y z of each, as many as 3 * points.size(). points: ascending.
struct BlendTarget {
  std::span<const Index> points;
  std::span<const float> deltas;
};

struct BlendShapeTargets {
  std::size_t point_count = 0;
  std::span<const BlendTarget> targets;
  // Names the first bad target: lengths that differ, points not ascending or out of range, a delta not
  // finite.
  Status Validate() const;
};

// A local kernel. A target of weight 0, and a delta of 0, are skipped: they add nothing, bit for bit.
// Each point adds its targets in their order, one fused multiply-add each.
class BlendShapeKernel {
 public:
  struct Inputs {
    std::span<const double> weights;  // one a target
    double envelope = 1;
  };

  // `targets` must be valid. point_weights are multiplied into the deltas.
  BlendShapeKernel(const BlendShapeTargets& targets, std::span<const Index> out_points,
                   std::span<const float> point_weights = {});

  std::size_t point_count() const { return count_; }
  std::size_t target_count() const { return first_tile_.size() - 1; }
  std::size_t ScratchFloats() const { return target_count(); }
  void Run(const Inputs& inputs, ConstPointsView in, PointsView out, std::span<float> scratch,
           const Parallel* parallel = nullptr) const noexcept;

  static constexpr std::size_t kTile = 16;    // points of a tile of deltas
  static constexpr std::size_t kBlock = 512;  // points that are worked on together, target after target
  struct Tile {
    Index first_point;    // multiple of kTile
    std::uint32_t lanes;  // bit i: point first_point + i has a delta
  };

 private:
  std::size_t count_ = 0;
  std::vector<Tile> tiles_;         // target by target, ascending
  std::vector<Index> first_tile_;   // of each target, and the end
  std::vector<Index> block_tiles_;  // [target][block + 1]: first tile at or after the block
  AlignedFloats deltas_;            // per tile: 16 x, 16 y, 16 z
};

}  // namespace kpsa::engine
