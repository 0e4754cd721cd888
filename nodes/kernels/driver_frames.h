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
#include "nodes/kernels/parallel_hook.h"
#include "nodes/kernels/topology.h"
#include "nodes/kernels/wrap_run.h"

namespace kpsa::engine {

// The driver points that the frames of these points read (each with its ring), sorted.
std::vector<Index> DriverFramesDemand(const Topology& driver, std::span<const Double3> rest,
                                      std::span<const Index> frame_points);

// Bound to a set of driver points; frames come as kFrameFloats floats each: F column by column (column k is
// where the rest direction k has gone), then the normal, unit length, or 0; four floats a column. F is no
// rotation: it stretches, too.
class DriverFrames {
 public:
  DriverFrames() = default;
  // rest: all driver points. frame_points, in_points: sorted; in_points holds at least the demand.
  DriverFrames(const Topology& driver, std::span<const Double3> rest, std::span<const Index> frame_points,
               std::span<const Index> in_points);

  std::size_t count() const { return edge_offsets_.size() - 1; }
  // Of one frame: whether it exists.
  bool exists(std::size_t frame) const { return edge_offsets_[frame + 1] > edge_offsets_[frame]; }
  // For the frames, and normals on the way.
  std::size_t Floats() const { return kFrameFloats * count() + 4 * (triangles_.size() / 3); }
  // points: the in_points now, x y z 0 each. frames [Floats()]: count() frames first; those that do not exist
  // are left alone. Both 16-byte aligned.
  void Run(const float* points, float* frames, const Parallel* parallel = nullptr) const noexcept;

 private:
  std::vector<Index> own_;  // entry of points, a frame
  std::vector<Index> edge_offsets_ = {0}, triangle_offsets_ = {0};
  std::vector<Index> edge_points_;  // entry of points
  std::vector<float> duals_;        // M^-1 e, 4 an edge
  std::vector<Index> around_;       // triangles around the point
  std::vector<Index> triangles_;    // 3 entries of points each
  std::vector<float> normal_duals_;
};

}  // namespace kpsa::engine
