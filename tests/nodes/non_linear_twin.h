// The naive twin of the nonlinear deformers: one point in double, by the formulas of nodes/kernels/non_linear.h.
#pragma once

#include <cmath>
#include <type_traits>

#include "base/scalar_math.h"
#include "nodes/kernels/non_linear.h"

namespace kpsa::engine::non_linear_twin {

// Of bounds that may be the wrong way round.
inline double Between(double value, double low, double high) {
  return value < low ? low : value > high ? high : value;
}
// 0 at low, 1 at high.
inline double Along(double value, double low, double high) {
  const double width = high - low;
  if (!(width > 0)) return value < low ? 0 : 1;
  return Between((value - low) / width, 0, 1);
}
inline double Faded(double amplitude, double dropoff, double r) {
  return amplitude * (dropoff >= 0 ? 1 - dropoff * r : 1 + dropoff * (1 - r));
}
inline double Ripple(double at, double offset, double wavelength) {
  return Sin(2 * kPi * (at - offset) / wavelength);
}
constexpr double kLeastWavelength = 1e-9;

// Each map with what does not depend on the point.
struct BendMap {
  explicit BendMap(const Bend& bend) : b(bend) {}
  bool idle() const { return b.curvature == 0; }
  Double3 operator()(Double3 q) const {
    const double y = Between(q.y, b.low, b.high), angle = b.curvature * y;
    double sine, cosine;
    SinCos(angle, &sine, &cosine);
    const bool small = std::fabs(angle) < 1e-3;  // then the differences below would lose digits
    const double x_arc = small ? y * angle * 0.5 * (1 - angle * angle / 12) : (1 - cosine) / b.curvature;
    const double y_arc = small ? y * (1 - angle * angle / 6) : sine / b.curvature;
    const double beyond = q.y - y;
    return {x_arc + q.x * cosine + beyond * sine, y_arc - q.x * sine + beyond * cosine, q.z};
  }
  Bend b;
};

struct TwistMap {
  explicit TwistMap(const Twist& twist) : t(twist) {}
  bool idle() const { return t.start == 0 && t.end == 0; }
  Double3 operator()(Double3 q) const {
    double sine, cosine;
    SinCos(t.start + (t.end - t.start) * Along(q.y, t.low, t.high), &sine, &cosine);
    return {q.x * cosine + q.z * sine, q.y, q.z * cosine - q.x * sine};
  }
  Twist t;
};

struct SquashMap {
  explicit SquashMap(const Squash& squash) : s(squash) {
    along = s.factor >= 0 ? 1 + s.factor : 1 / (1 - s.factor);
    across = Exp(-0.5 * s.expand * Log(along));
  }
  bool idle() const { return s.factor == 0; }
  Double3 operator()(Double3 q) const {
    const double y = Between(q.y, s.low, s.high), t = Along(y, s.low, s.high);
    const bool first = t < s.max_expand_pos;
    const double width = first ? s.max_expand_pos : 1 - s.max_expand_pos;
    const double u = width > 0 ? (first ? t : 1 - t) / width : 1;
    const double round = u * (2 - u), smooth = u * u * (3 - 2 * u);
    const double bump = round + (first ? s.start_smoothness : s.end_smoothness) * (smooth - round);
    const double scale = 1 + (across - 1) * bump;
    return {q.x * scale, y * along + (q.y - y), q.z * scale};
  }
  Squash s;
  double along = 1, across = 1;
};

struct FlareMap {
  explicit FlareMap(const Flare& flare) : f(flare) {}
  bool idle() const {
    return f.start_x == 1 && f.start_z == 1 && f.end_x == 1 && f.end_z == 1 && f.curve == 0;
  }
  Double3 operator()(Double3 q) const {
    const double t = Along(q.y, f.low, f.high), bulge = f.curve * 4 * t * (1 - t);
    return {q.x * (f.start_x + (f.end_x - f.start_x) * t + bulge), q.y,
            q.z * (f.start_z + (f.end_z - f.start_z) * t + bulge)};
  }
  Flare f;
};

struct SineMap {
  explicit SineMap(const Sine& sine) : s(sine) {}
  bool idle() const { return s.amplitude == 0 || !(std::fabs(s.wavelength) > kLeastWavelength); }
  Double3 operator()(Double3 q) const {
    const double y = Between(q.y, s.low, s.high);
    const double r = y < 0 ? Along(-y, 0, -s.low) : Along(y, 0, s.high);
    return {q.x + Faded(s.amplitude, s.dropoff, r) * Ripple(y, s.offset, s.wavelength), q.y, q.z};
  }
  Sine s;
};

struct WaveMap {
  explicit WaveMap(const Wave& wave) : w(wave) {}
  bool idle() const { return w.amplitude == 0 || !(std::fabs(w.wavelength) > kLeastWavelength); }
  Double3 operator()(Double3 q) const {
    const double radius = Between(std::sqrt(q.x * q.x + q.z * q.z), w.min_radius, w.max_radius);
    const double r = Along(radius, w.min_radius, w.max_radius);
    return {q.x, q.y + Faded(w.amplitude, w.dropoff, r) * Ripple(radius, w.offset, w.wavelength), q.z};
  }
  Wave w;
};

// Calls use(the prepared map).
template <typename F>
auto WithMap(const NonLinearMap& map, F use) {
  return std::visit(
      [&](const auto& given) {
        using T = std::decay_t<decltype(given)>;
        if constexpr (std::is_same_v<T, Bend>) return use(BendMap(given));
        if constexpr (std::is_same_v<T, Twist>) return use(TwistMap(given));
        if constexpr (std::is_same_v<T, Squash>) return use(SquashMap(given));
        if constexpr (std::is_same_v<T, Flare>) return use(FlareMap(given));
        if constexpr (std::is_same_v<T, Sine>) return use(SineMap(given));
        if constexpr (std::is_same_v<T, Wave>) return use(WaveMap(given));
      },
      map);
}

// f of one point of the handle's space.
inline Double3 Apply(const NonLinearMap& map, Double3 q) {
  return WithMap(map, [&](const auto& f) { return f.idle() ? q : f(q); });
}

}  // namespace kpsa::engine::non_linear_twin
