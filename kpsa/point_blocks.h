// Points in blocks, so that the nearest one is found without looking at all of them.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "base/types.h"

namespace kpsa::engine {

// A box around points; around none, it is infinitely far from everything.
struct PointBox {
  static constexpr double kFar = std::numeric_limits<double>::infinity();
  Double3 lo{kFar, kFar, kFar}, hi{-kFar, -kFar, -kFar};
  void Add(const PointBox& other);
};

// kSize points in a row are a block: in the order of a mesh they lie near each other. Points that are not finite lie
// nowhere.
class PointBlocks {
 public:
  static constexpr std::size_t kSize = 16;
  explicit PointBlocks(std::span<const Double3> points);
  std::size_t size() const { return boxes_.size(); }
  const PointBox& box(std::size_t block) const { return boxes_[block]; }
  bool IsSomewhere(std::size_t point) const { return x_[point] < PointBox::kFar; }
  // Of `count` blocks from `first` on, those whose boxes are nearer to a box than the root of `squared`.
  void FindNear(const PointBox& box, std::size_t first, std::size_t count, double squared,
                std::vector<std::uint32_t>* near);
  // For each point of a block that is somewhere, makes `least` the squared distance to the nearest one of some blocks
  // where that is smaller.
  using Distances = std::array<double, kSize>;
  void Nearest(std::span<const std::uint32_t> blocks, std::size_t block, Distances* least) const;
  // The same of points that lie elsewhere than the point itself.
  void NearestApart(std::span<const std::uint32_t> blocks, std::size_t block, Distances* least) const;

 private:
  std::vector<double> x_, y_, z_;  // [kSize * size()]; infinite where there is none
  std::vector<PointBox> boxes_;
  // Of the boxes, for SIMD: lo and hi along x, along y, along z, each with padding
  static constexpr std::size_t kMostLanes = 8;
  std::size_t stride_ = 0;
  std::vector<double> bounds_, squared_;
};

}  // namespace kpsa::engine
