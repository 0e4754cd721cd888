// Inside the nonlinear deformers only: what preparing them (non_linear.cpp) and running them
// (non_linear_run.cpp) share. Floats, in the units of the handle's space.
#pragma once

#include <cstddef>

#include "base/points.h"
#include "nodes/kernels/handle_frame.h"

namespace kpsa::engine {

// 0 below low, 1 from top on, (y - low) inverse between.
struct AlongRun {
  float low, top, inverse;
};
struct BendRun {
  float low, high;
  float curvature, radius, half_turns;  // radians and half turns for a length of 1
};
struct TwistRun {
  AlongRun along;
  float start, span;  // half turns
};
struct SquashRun {
  float low, high;
  AlongRun along;
  float middle;  // between the halves: u = t scale + bias, or (1 - t) scale + bias
  float scale[2], bias[2], smoothness[2];
  float stretch, widening;  // both minus 1
};
struct FlareRun {
  AlongRun along;
  float start_x, start_z;  // minus 1
  float change_x, change_z, bulge;
};
// sin(pi (at half_turns + shift)) (amplitude + fade r)
struct RippleRun {
  float half_turns, shift, amplitude, fade;
};
struct SineRun {
  RippleRun ripple;
  float low, high;
  float below_scale, below_bias, above_scale, above_bias;  // r of y below 0 and above
};
struct WaveRun {
  RippleRun ripple;
  float low, high;  // radii
  AlongRun along;
};

struct NonLinearRun {
  std::size_t kind;  // the map's index in NonLinearMap: that of these that is set
  union {
    BendRun bend;
    TwistRun twist;
    SquashRun squash;
    FlareRun flare;
    SineRun sine;
    WaveRun wave;
  };
  HandleFrame frame;
  const float* weights;
  float envelope;
};

// begin a multiple of 16; writes whole vectors. In place allowed.
void RunNonLinear(const NonLinearRun& run, ConstPointsView in, PointsView out, std::size_t begin,
                  std::size_t end) noexcept;

}  // namespace kpsa::engine
