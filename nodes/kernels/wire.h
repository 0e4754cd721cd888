// wire: points near a curve follow it. p' = p + w (C(u) - C_rest(u)), u the nearest parameter and w the
// falloff of the distance at rest. C is linear in its control vertices, so a point stores the weights of at
// most four of them.
//
// Several curves: p' = p + sum_i a_i (C_i(u_i) - C_i_rest(u_i)), a_i = w_i (c + (1 - c) w_i / sum_j w_j) with
// the crossing effect c. With 0 near curves take over from far ones, and curves that lie together move points
// once; with 1 they add up (Maya's crossingEffect).
#pragma once

#include <span>
#include <vector>

#include "base/points.h"
#include "base/status.h"
#include "nodes/kernels/control_blend.h"
#include "nodes/kernels/falloff.h"
#include "nodes/kernels/parallel_hook.h"

namespace kpsa::engine {

enum class CurveBasis : std::uint8_t {
  kLinear,      // straight from vertex to vertex
  kCatmullRom,  // uniform cubic through the vertices; ends are continued by reflection
  kBSpline,     // uniform cubic B-spline, clamped to the end vertices by reflection
};

// A curve as weights of its control vertices: parameter u in [0, spans], integer at the vertices.
struct CurveShape {
  CurveBasis basis = CurveBasis::kCatmullRom;
  bool closed = false;
  std::size_t vertices = 0;
  std::size_t spans() const { return closed ? vertices : vertices - 1; }
  // Four vertices and their weights at u (clamped, or wrapped if closed); weights sum to 1, unused ones are
  // 0.
  void Weights(double u, Index controls[4], double weights[4]) const;
  Double3 Point(std::span<const Double3> vertices, double u) const;
  // The parameter of the point of the curve nearest to p, to about 1e-9 of a span; the first of equals.
  double Nearest(std::span<const Double3> vertices, Double3 p) const;
};

struct WireSettings {
  CurveBasis basis = CurveBasis::kCatmullRom;
  bool closed = false;
  double dropoff = 0.01;  // metres; beyond it points stay
  FalloffProfile profile;
};

// One of several curves.
struct WireCurve {
  WireSettings settings;
  std::span<const Double3> rest_vertices;
};

// A local kernel.
class WireKernel {
 public:
  struct Inputs {
    // Of every vertex from where it rests now, one view after the other, and what turns them to the points' space.
    std::span<const ConstPointsView> offsets;
    double envelope = 1;
    const Matrix4* turn = nullptr;  // its linear part; null: none
  };

  // Names too few vertices (2; closed: 3), one that is not finite, a dropoff that is not positive, a bad
  // profile.
  static Status Validate(const WireSettings& settings, std::span<const Double3> rest_vertices);
  // rest: points of the whole mesh, in the space of rest_vertices.
  WireKernel(const WireSettings& settings, std::span<const Double3> rest_vertices, ConstPointsView rest,
             std::span<const Index> out_points, std::span<const float> point_weights = {});
  // Several curves, each valid.
  WireKernel(std::span<const WireCurve> curves, double crossing_effect, ConstPointsView rest,
             std::span<const Index> out_points, std::span<const float> point_weights = {});

  std::size_t point_count() const { return count_; }
  std::size_t affected_points() const { return blend_.affected_points(); }
  std::size_t ScratchFloats() const { return 4 * (vertices_ + kPointPadding); }
  void Run(const Inputs& inputs, ConstPointsView in, PointsView out, std::span<float> scratch,
           const Parallel* parallel = nullptr) const noexcept;

 private:
  std::size_t count_ = 0, vertices_ = 0;
  ControlBlend blend_;
};

}  // namespace kpsa::engine
