// How the surface of a driver mesh has turned and stretched at its points since rest.
//
// At a driver point i: the matrix F_i that carries rest edges to present ones, in the least-squares sense
// over the edges around the point and its normal (area-weighted, of the triangles around it):
//   F_i = (sum_j e'_j e_j^T + s n' n^T) M^-1,  M = sum_j e_j e_j^T + s n n^T,  e_j = d_j - d_i, s the mean
//   e^2.
// A rigid motion of the driver gives its rotation exactly, up to rounding (floats). Where the edges of a
// point do not span a plane at rest it has no frame, and asks for nothing.
#pragma once

#include <span>
#include <vector>

#include "base/matrix.h"
#include "base/points.h"
#include "nodes/kernels/parallel_hook.h"
#include "nodes/kernels/topology.h"
#include "nodes/kernels/wrap_run.h"

namespace kpsa::engine {

// The driver points that the frames of these points read (each with its ring), sorted.
std::vector<Index> DriverFramesDemand(const Topology& driver, std::span<const Double3> rest,
                                      std::span<const Index> frame_points);

// Bound to a set of driver points; frames come as kFrameFloats floats each: F column by column (column k is
// where the rest direction k has gone), then the normal, unit length, or 0; four floats a column, of which the
// spare ones hold the point (wrap_run.h). F is no rotation: it stretches, too.
class DriverFrames {
 public:
  DriverFrames() = default;
  // rest: all driver points. frame_points, in_points: sorted; in_points holds at least the demand and those
  // points.
  DriverFrames(const Topology& driver, std::span<const Double3> rest, std::span<const Index> frame_points,
               std::span<const Index> in_points);

  // Of the i-th frame point: whether its frame exists, and where it begins among the floats.
  bool exists(std::size_t i) const { return exists_[i]; }
  Index begin(std::size_t i) const { return kFrameFloats * slots_[i]; }
  std::size_t Floats() const { return kFrameFloats * own_.size(); }
  // points: the in_points now, x y z 0 each. Both 64-byte aligned.
  void Run(const float* points, float* frames, const Parallel* parallel = nullptr) const noexcept;

 private:
  std::vector<Index> slots_;  // groups of frames with equally long rings (wrap_run.h)
  std::vector<bool> exists_;
  std::vector<Index> first_ = {0}, own_, spokes_;
  AlignedFloats duals_, normal_duals_;
};

}  // namespace kpsa::engine
