#include "nodes/kernels/falloff.h"

#include <cmath>

#include "base/scalar_math.h"

namespace kpsa::engine {

Status FalloffProfile::Validate() const {
  if (curve != FalloffCurve::kRamp) return {};
  if (keys.empty()) return Status::Invalid("a falloff ramp has no keys, expected at least one");
  for (std::size_t i = 0; i < keys.size(); ++i) {
    if (!std::isfinite(keys[i].position) || !std::isfinite(keys[i].value)) {
      return Status::Invalid("key {} of a falloff ramp is not a finite number", i);
    }
    if (i > 0 && keys[i].position < keys[i - 1].position) {
      return Status::Invalid(
          "key {} of a falloff ramp lies before the key in front of it, expected ascending positions", i);
    }
  }
  return {};
}

double FalloffProfile::Evaluate(double t) const {
  if (t > 1 || (t == 1 && curve != FalloffCurve::kNone)) return 0;
  switch (curve) {
    case FalloffCurve::kNone:
      return 1;
    case FalloffCurve::kLinear:
      return 1 - t;
    case FalloffCurve::kSmooth:
      return 1 - Smoothstep(t);
    case FalloffCurve::kSpline:
      return (1 - t * t) * (1 - t * t);
    case FalloffCurve::kRamp:
      break;
  }
  if (t <= keys.front().position) return keys.front().value;
  for (std::size_t i = 1; i < keys.size(); ++i) {
    if (t > keys[i].position) continue;
    const RampKey &a = keys[i - 1], &b = keys[i];
    const double width = b.position - a.position;
    return width > 0 ? a.value + (b.value - a.value) * ((t - a.position) / width) : b.value;
  }
  return keys.back().value;
}

std::vector<float> RadialFalloff(ConstPointsView rest, std::span<const Index> points, Double3 center,
                                 double radius, const FalloffProfile& profile) {
  std::vector<float> weights;
  weights.reserve(points.size());
  for (Index p : points) {
    const double distance = Length(Double3{rest.x[p], rest.y[p], rest.z[p]} - center);
    const double t = radius > 0 ? distance / radius : (distance > 0 ? 2.0 : 0.0);
    weights.push_back(static_cast<float>(profile.Evaluate(t)));
  }
  return weights;
}

}  // namespace kpsa::engine
