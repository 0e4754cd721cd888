// Maya's nonlinear deformers: bend, twist, squash, flare, sine, wave. Each maps points of the space of a
// handle, along its Y axis: q' = f(q); p' = p + w L (f(q) - q) with q = frame^-1 p and L the linear part of
// frame. Lengths are those of the handle's space. Every map is continuous; at or beyond a bound it goes on as
// it is there (bend: straight on). A map that is idle leaves points alone, bit for bit.
#pragma once

#include <span>
#include <variant>
#include <vector>

#include "base/matrix.h"
#include "base/points.h"
#include "nodes/kernels/parallel_hook.h"

namespace kpsa::engine {

// Onto a circle, towards +X for a positive curvature.
struct Bend {
  double curvature = 0;  // radians for a length of 1
  double low = -1, high = 1;
};
// Turns about Y, from start at the low bound to end at the high one.
struct Twist {
  double start = 0, end = 0;  // radians
  double low = -1, high = 1;
};
// Along Y by s = 1 + factor (of a negative factor, 1 / (1 - factor)); across it by 1 + (s^(-expand / 2) - 1)
// b with a bump b, 0 at the bounds and 1 at max_expand_pos: with expand 1 the volume there stays. From the
// bound to there, u from 0 to 1, b = u (2 - u), or with a smoothness of 1 u^2 (3 - 2 u).
struct Squash {
  double factor = 0, expand = 1;
  double max_expand_pos = 0.5;  // between the bounds, 0 to 1
  double start_smoothness = 0, end_smoothness = 0;
  double low = -1, high = 1;
};
// Across Y by factors from start (low bound) to end, t from 0 to 1, plus curve 4 t (1 - t).
struct Flare {
  double start_x = 1, start_z = 1, end_x = 1, end_z = 1;
  double curve = 0;
  double low = -1, high = 1;
};
// x += A sin(2 pi (y - offset) / wavelength). With r from 0 at the middle to 1 at a bound, A = amplitude
// (1 - dropoff r), or (1 + dropoff (1 - r)) of a negative dropoff.
struct Sine {
  double amplitude = 0, wavelength = 2, offset = 0;
  double dropoff = 0;  // -1 to 1
  double low = -1, high = 1;
};
// y += A sin(2 pi (r - offset) / wavelength), r the distance from the axis between the radii; A as Sine's,
// fading from the inner radius to the outer one.
struct Wave {
  double amplitude = 0, wavelength = 1, offset = 0;
  double dropoff = 0;  // -1 to 1
  double min_radius = 0, max_radius = 1;
};
using NonLinearMap = std::variant<Bend, Twist, Squash, Flare, Sine, Wave>;

// A local kernel. Floats, about the handle's origin: a point is off by less than 8 times 2^-24 of its distance
// from there, of its own coordinates and of its move together, times how steep the map is where that is more
// than 1 (tests/nodes/non_linear_twin.h maps in double).
class NonLinearKernel {
 public:
  struct Inputs {
    NonLinearMap map;
    const Matrix4&
        frame;  // the points' space from the handle's; where it has no inverse in floats, points stay
    double envelope = 1;
  };

  explicit NonLinearKernel(std::span<const Index> out_points, std::span<const float> point_weights = {});

  std::size_t point_count() const { return count_; }
  std::size_t ScratchFloats() const { return 0; }
  void Run(const Inputs& inputs, ConstPointsView in, PointsView out, std::span<float> scratch,
           const Parallel* parallel = nullptr) const noexcept;

 private:
  std::size_t count_ = 0;
  AlignedFloats weights_;
};

}  // namespace kpsa::engine
