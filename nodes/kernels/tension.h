// How the surface around a point is stretched: strain = (sum of the lengths of its edges now) / (their sum at
// rest) - 1; below 0 it is compressed. 0 where a point has no edge, or edges without length.
// The push moves points along their normals by it, as skin wrinkles where it is pressed together.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "base/points.h"
#include "nodes/kernels/normals.h"
#include "nodes/kernels/parallel_hook.h"
#include "nodes/kernels/topology.h"

namespace kpsa::engine {

// The input points that these output points need, sorted: one ring; a point of weight 0 needs itself only.
std::vector<Index> TensionDemand(const Topology& topology, std::span<const Index> out_points,
                                 std::span<const float> point_weights = {});

class StrainKernel {
 public:
  // in_points: sorted, a superset of the demand.
  StrainKernel(const Topology& topology, ConstPointsView rest, std::span<const Index> out_points,
               std::span<const Index> in_points);
  std::size_t point_count() const { return at_.size(); }
  // growth: how much larger than at rest the surface is as a whole; counts as no strain. strain: one float an
  // output point.
  void Run(double growth, ConstPointsView in, float* strain,
           const Parallel* parallel = nullptr) const noexcept;

 private:
  std::vector<Index> at_;  // output -> entry of `in`
  std::vector<Index> offsets_, neighbors_;
  std::vector<double> rest_;  // sum of lengths, 0 where there is nothing to measure
};

// A ring kernel: `in` holds the points in_points (sorted, a superset of the demand), `out` the out_points. In
// place only where the two are the same.
class TensionPushKernel {
 public:
  struct Inputs {
    double growth = 1;
    double compress_scale = 0, stretch_scale = 0;  // metres along the normal for a strain of -1 and of 1
    double envelope = 1;
  };
  TensionPushKernel(const Topology& topology, ConstPointsView rest, std::span<const Index> out_points,
                    std::span<const Index> in_points, std::span<const float> point_weights = {});
  std::size_t point_count() const { return at_.size(); }
  std::size_t ScratchFloats() const;
  void Run(const Inputs& inputs, ConstPointsView in, PointsView out, std::span<float> scratch,
           const Parallel* parallel = nullptr) const noexcept;

 private:
  std::vector<Index> at_;      // output -> entry of `in`
  std::vector<Index> active_;  // outputs of a weight other than 0; all that follows is theirs
  std::vector<float> weights_;
  std::optional<StrainKernel> strain_;
  std::optional<NormalsKernel> normals_;
};

}  // namespace kpsa::engine
