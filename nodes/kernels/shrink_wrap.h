// shrinkWrap: points go onto a target mesh that moves.
//
// The place q on the target: the nearest one, or where a line through the point along its normal or along an
// axis meets the target. The side of the point follows from the pseudonormal of the triangle, edge or corner
// that q lies on (Baerentzen and Aanaes, Signed Distance Computation Using the Angle Weighted Pseudonormal,
// 2005). Signed distances are positive outside, where the target's normals point; `offset` shifts the
// surface. Double arithmetic.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "base/matrix.h"
#include "base/points.h"
#include "base/triangle_tree.h"
#include "nodes/kernels/moving_surface.h"
#include "nodes/kernels/normals.h"
#include "nodes/kernels/parallel_hook.h"
#include "nodes/kernels/topology.h"

namespace kpsa::engine {

struct ShrinkWrapSettings {
  enum class Projection : std::uint8_t { kClosest, kNormals, kAxis };
  enum class Side : std::uint8_t {
    kSurface,  // all points go onto the surface
    kOutside,  // only those that are inside of it: the others may be anywhere outside
    kInside,
  };
  Projection projection = Projection::kClosest;
  bool reverse = false;                     // lines go against the normal or axis
  bool bidirectional = false;               // and both ways: the nearer hit counts
  bool closest_if_no_intersection = false;  // where a line meets nothing; otherwise such points stay
  Side side = Side::kSurface;
};

// The input points that these output points need, sorted: kNormals needs the ring of those that move.
std::vector<Index> ShrinkWrapDemand(const ShrinkWrapSettings& settings, const Topology& own,
                                    std::span<const Index> out_points,
                                    std::span<const float> point_weights = {});

class ShrinkWrapKernel {
 public:
  struct Inputs {
    double envelope = 1;
    double offset = 0;       // points' space
    ConstPointsView target;  // all of its points, in its own space
    Double3 axis{0, 1, 0};   // of kAxis, unit length, in the points' space
  };
  // target, surface: the target's faces, and trees over them. own: the faces of the points that move
  // (kNormals only). in_points: sorted, at least the demand.
  ShrinkWrapKernel(const ShrinkWrapSettings& settings, const Topology& target, MovingSurface surface,
                   const Matrix4& stage_from_target, const Topology& own, std::span<const Index> out_points,
                   std::span<const Index> in_points, std::span<const float> point_weights = {});

  std::size_t point_count() const { return weights_.size(); }
  std::size_t ScratchFloats() const;
  // In place only where in_points and out_points are the same. See MovingSurface::At about memory.
  void Run(const Inputs& inputs, ConstPointsView in, PointsView out, std::span<float> scratch,
           const Parallel* parallel = nullptr) const;

 private:
  bool MovesTarget() const { return !(stage_from_target_ == Matrix4()); }
  Double3 FaceNormal(const TriangleTree& target, Index triangle) const noexcept;
  Double3 Pseudonormal(const TriangleTree& target, const SurfacePoint& place) const noexcept;
  // near: a triangle that may be near; then the nearest.
  std::optional<Double3> Nearest(const TriangleTree& target, Double3 p, double offset,
                                 Index* near) const noexcept;
  std::optional<Double3> AlongLine(const TriangleTree& target, Double3 p, Double3 line, double offset,
                                   Index* near) const noexcept;
  bool Stays(double signed_distance, double offset) const noexcept;

  ShrinkWrapSettings settings_;
  Matrix4 stage_from_target_;
  MovingSurface surface_;
  std::size_t in_count_ = 0;
  std::vector<Index> around_offsets_, around_;  // triangles around each point of the target
  std::vector<float> weights_;
  std::vector<Index> entries_;    // of `in`, an output
  std::vector<Index> normal_of_;  // of normals_, an output; kNoIndex: it does not move
  std::optional<NormalsKernel> normals_;
};

}  // namespace kpsa::engine
