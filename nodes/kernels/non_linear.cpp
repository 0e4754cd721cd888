#include "nodes/kernels/non_linear.h"

#include <cmath>

#include "base/check.h"
#include "base/scalar_math.h"
#include "nodes/kernels/non_linear_run.h"
#include "nodes/kernels/weights.h"

namespace kpsa::engine {
namespace {

constexpr double kLeastWavelength = 1e-9;
constexpr float kLeastWidth = 1e-30f;  // of what is divided by in floats
constexpr std::size_t kGrain = 2048;

float Float(double value) { return static_cast<float>(value); }

// fmod(half_turns, 2), which takes a tenth of a step; most angles are within a turn.
double WithinATurn(double half_turns) {
  return std::fabs(half_turns) < 2 ? half_turns : std::fmod(half_turns, 2.0);
}

AlongRun MakeAlong(double low, double high) {
  const float from = Float(low), to = Float(high);
  const bool wide = to - from > kLeastWidth;
  return {from, wide ? to : from, wide ? 1 / (to - from) : 0};
}

RippleRun MakeRipple(double amplitude, double wavelength, double offset, double dropoff) {
  return {Float(2 / wavelength), Float(-WithinATurn(2 * offset / wavelength)),
          Float(dropoff >= 0 ? amplitude : amplitude * (1 + dropoff)), Float(-amplitude * dropoff)};
}
bool Ripples(double amplitude, double wavelength) {
  return amplitude != 0 && std::fabs(wavelength) > kLeastWavelength;
}

// Each fills in its part of the run; false: it is idle.

bool Prepare(const Bend& b, NonLinearRun* run) {
  run->bend = {Float(b.low), Float(b.high), Float(b.curvature), Float(1 / b.curvature),
               Float(b.curvature / kPi)};
  return b.curvature != 0;
}

bool Prepare(const Twist& t, NonLinearRun* run) {
  run->twist = {MakeAlong(t.low, t.high), Float(WithinATurn(t.start / kPi)), Float((t.end - t.start) / kPi)};
  return t.start != 0 || t.end != 0;
}

bool Prepare(const Squash& s, NonLinearRun* run) {
  const double along = s.factor >= 0 ? 1 + s.factor : 1 / (1 - s.factor);
  const double widths[2] = {s.max_expand_pos, 1 - s.max_expand_pos};
  SquashRun& squash = run->squash;
  squash = {Float(s.low),
            Float(s.high),
            MakeAlong(s.low, s.high),
            Float(s.max_expand_pos),
            {0, 0},
            {1, 1},
            {Float(s.start_smoothness), Float(s.end_smoothness)},
            Float(along - 1),
            Float((s.expand == 1 ? 1 / std::sqrt(along) : Exp(-0.5 * s.expand * Log(along))) - 1)};
  for (int half = 0; half < 2; ++half) {
    if (widths[half] > kLeastWidth) squash.scale[half] = Float(1 / widths[half]), squash.bias[half] = 0;
  }
  return s.factor != 0;
}

bool Prepare(const Flare& f, NonLinearRun* run) {
  run->flare = {MakeAlong(f.low, f.high),   Float(f.start_x - 1),       Float(f.start_z - 1),
                Float(f.end_x - f.start_x), Float(f.end_z - f.start_z), Float(4 * f.curve)};
  return f.start_x != 1 || f.start_z != 1 || f.end_x != 1 || f.end_z != 1 || f.curve != 0;
}

bool Prepare(const Sine& s, NonLinearRun* run) {
  const float low = Float(s.low), high = Float(s.high);
  const bool below = low<-kLeastWidth, above = high> kLeastWidth;
  run->sine = {MakeRipple(s.amplitude, s.wavelength, s.offset, s.dropoff),
               low,
               high,
               below ? 1 / low : 0,
               below ? 0.0f : 1.0f,
               above ? 1 / high : 0,
               above ? 0.0f : 1.0f};
  return Ripples(s.amplitude, s.wavelength);
}

bool Prepare(const Wave& w, NonLinearRun* run) {
  run->wave = {MakeRipple(w.amplitude, w.wavelength, w.offset, w.dropoff), Float(w.min_radius),
               Float(w.max_radius), MakeAlong(w.min_radius, w.max_radius)};
  return Ripples(w.amplitude, w.wavelength);
}

}  // namespace

NonLinearKernel::NonLinearKernel(std::span<const Index> out_points, std::span<const float> point_weights)
    : count_(out_points.size()), weights_(PaddedWeights(point_weights, out_points.size())) {}

void NonLinearKernel::Run(const Inputs& inputs, ConstPointsView in, PointsView out, std::span<float>,
                          const Parallel* parallel) const noexcept {
  KPSA_CHECK_EQ(in.count, count_);
  KPSA_CHECK_EQ(out.count, count_);
  NonLinearRun run;
  run.kind = inputs.map.index();
  run.weights = weights_.data();
  run.envelope = Float(inputs.envelope);
  const bool moves = run.envelope != 0 && PrepareHandleFrame(inputs.frame, 1, &run.frame) &&
                     std::visit([&](const auto& map) { return Prepare(map, &run); }, inputs.map);
  if (!moves) return CopyPoints(in, out);
  ForRanges(parallel, count_, kGrain,
            [&](std::size_t begin, std::size_t end) { RunNonLinear(run, in, out, begin, end); });
}

}  // namespace kpsa::engine
