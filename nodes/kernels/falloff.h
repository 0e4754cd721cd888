// Weights that fall from 1 to 0 with a distance; evaluated when a kernel is bound, from rest points.
#pragma once

#include <span>
#include <vector>

#include "base/points.h"
#include "base/status.h"

namespace kpsa::engine {

enum class FalloffCurve : std::uint8_t {
  kNone,    // 1 up to the radius, 0 beyond
  kLinear,  // 1 - t
  kSmooth,  // 1 - (3 t^2 - 2 t^3)
  kSpline,  // (1 - t^2)^2: round at the centre, flat at the rim
  kRamp,    // keys, linear between them
};

struct RampKey {
  double position = 0;  // 0 at the centre, 1 at the radius
  double value = 0;
};

struct FalloffProfile {
  FalloffCurve curve = FalloffCurve::kSmooth;
  std::vector<RampKey> keys;  // of kRamp: ascending positions, at least one
  Status Validate() const;    // names a ramp without keys, out of order or not finite
  // The weight at t = distance / radius, t >= 0; 0 from t = 1 on (kNone: beyond 1).
  double Evaluate(double t) const;
};

// weights[i] of mesh point points[i] at its distance from `center`; a radius of 0 or less gives 0 everywhere
// except at the centre itself.
std::vector<float> RadialFalloff(ConstPointsView rest, std::span<const Index> points, Double3 center,
                                 double radius, const FalloffProfile& profile);

}  // namespace kpsa::engine
