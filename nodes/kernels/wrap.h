// wrap and proximityWrap: points follow the surface of a driver mesh.
//
// At bind every point gets driver points with weights that sum to 1 (its influences). Now and at rest these
// give an anchor a = sum w d, and a frame: the normal n = sum w n_i, and the directions t, b along the
// surface carried by the blended deformation (driver_frames.h). The point goes to
//   offset:  a' + R (p - a)    R the rotation of the frame: of all in the tangent plane the one nearest to
//   the
//                              deformation (2-D polar decomposition)
//   surface: a' + t' (t.(p - a)) + b' (b.(p - a)) + n' (n.(p - a))   stretched as the surface is
//   snap:    a'
// Where the surface is folded up so that there is no tangent, the offset does not turn. Bound in double, run
// in floats; what rests stays where it is, to the bit.
#pragma once

#include <limits>
#include <span>
#include <vector>

#include "base/matrix.h"
#include "base/points.h"
#include "base/triangle_tree.h"
#include "nodes/kernels/driver_frames.h"
#include "nodes/kernels/parallel_hook.h"

namespace kpsa::engine {

enum class WrapMode : std::uint8_t { kOffset, kSurface, kSnap };

// Compressed rows, one a point: driver points, ascending, and their weights. An empty row: the point stays.
struct WrapInfluences {
  std::vector<Index> offsets = {0}, points;
  std::vector<double> weights;
  CsrView<Index> rows() const { return {offsets, points}; }
};

// What has less of a point's weight is no influence: floats could not tell, and its ring would be asked for.
inline constexpr double kLeastShare = 1.0 / (1 << 26);

// `driver`: a tree over the driver at rest.
//
// The corners of the nearest triangle with their barycentric weights. Then `smooth` times: every driver point
// gives half of its weight to its neighbours. point_weights: points of weight 0 get no influences.
WrapInfluences SurfaceInfluences(const TriangleTree& driver, const Topology& topology, ConstPointsView rest,
                                 std::span<const Index> out_points, double max_distance, int smooth,
                                 std::span<const float> point_weights = {});
// The `count` nearest driver points that belong to faces, weighted (1 - d^2 / r^2)^2, r the distance at which
// influences end: max_distance, or that of the next driver point where this is nearer. The tree is over
// single points (PointTriangles).
WrapInfluences NearestInfluences(const TriangleTree& driver, ConstPointsView rest,
                                 std::span<const Index> out_points, double max_distance, std::size_t count,
                                 std::span<const float> point_weights = {});
// Every point of a face as a triangle of its own (p, p, p), for a tree over points.
std::vector<Index> PointTriangles(const Topology& topology);

// The driver points that these influences need, sorted: themselves, and but for kSnap their frames' rings.
std::vector<Index> WrapDemand(const Topology& driver, std::span<const Double3> driver_rest,
                              const WrapInfluences& influences, WrapMode mode);

// A local kernel in the wrapped points.
class WrapKernel {
 public:
  struct Inputs {
    double envelope = 1;
    ConstPointsView driver;  // its points in_points, in the driver's space
  };
  // driver_rest: all driver points at rest, stage space (stage_from_driver times what the driver has).
  // rest: all points of the wrapped geometry. in_points: driver points, sorted, at least the demand.
  WrapKernel(WrapMode mode, const Topology& driver, std::span<const Double3> driver_rest,
             const Matrix4& stage_from_driver, const WrapInfluences& influences, ConstPointsView rest,
             std::span<const Index> out_points, std::span<const Index> in_points,
             std::span<const float> point_weights = {});

  std::size_t point_count() const { return count_; }
  std::size_t influence_count() const { return shares_.size(); }  // of all points
  std::size_t driver_count() const { return in_count_; }
  std::size_t ScratchFloats() const;
  void Run(const Inputs& inputs, ConstPointsView in, PointsView out, std::span<float> scratch,
           const Parallel* parallel = nullptr) const noexcept;

 private:
  std::size_t DriverFloats() const { return 4 * PaddedCount(in_count_); }

  WrapMode mode_;
  Matrix4 stage_from_driver_;
  std::size_t in_count_ = 0, count_ = 0;
  std::vector<Index> offsets_, entries_;  // influences (wrap_run.h)
  std::vector<float> shares_;
  AlignedFloats weights_, directions_, rest_;  // of the points (wrap_run.h)
  DriverFrames frames_;
};

}  // namespace kpsa::engine
