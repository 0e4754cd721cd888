// Point normals from the points: the sum of the cross products of the triangles around a point
// (area-weighted), in ascending triangle order, normalised; 0 where they cancel.
#pragma once

#include <span>
#include <vector>

#include "base/points.h"
#include "nodes/kernels/parallel_hook.h"
#include "nodes/kernels/topology.h"

namespace kpsa::engine {

// The input points that the normals of these points need, sorted.
std::vector<Index> NormalsDemand(const Topology& topology, std::span<const Index> out_points);

class NormalsKernel {
 public:
  // in_points: sorted, a superset of the demand.
  NormalsKernel(const Topology& topology, std::span<const Index> out_points,
                std::span<const Index> in_points);
  std::size_t point_count() const { return count_; }
  std::size_t ScratchFloats() const { return 4 * (triangles_.size() / 3 + PaddedCount(in_count_)); }
  void Run(ConstPointsView in, PointsView normals, std::span<float> scratch,
           const Parallel* parallel = nullptr) const noexcept;

 private:
  std::size_t count_ = 0, in_count_ = 0;
  std::vector<Index> triangles_;  // 4 * entry of `in`, 3 a triangle that is needed
  // Outputs in blocks of 64, sorted by their number of triangles: place in the block, and 4 * needed
  // triangle.
  std::vector<std::uint8_t> lanes_;
  std::vector<Index> offsets_, around_;
  std::vector<Index> ready_;  // triangles that the first 512, 1024, .. outputs need
};

}  // namespace kpsa::engine
