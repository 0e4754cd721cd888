// Parts of implicit surfaces: rounded solids joined by smooth minima (I. Quilez, "Smooth minimum").
// Approximate signed distances, negative inside.
#pragma once

#include <algorithm>
#include <cmath>

#include "base/types.h"

namespace kpsa::engine::scenes {

inline double SmoothUnion(double a, double b, double k) {
  const double h = std::max(k - std::fabs(a - b), 0.0) / k;
  return std::min(a, b) - h * h * k * 0.25;
}
inline double SmoothCut(double a, double tool, double k) { return -SmoothUnion(-a, tool, k); }

inline double Ellipsoid(Double3 p, Double3 center, Double3 r) {
  const Double3 d = p - center;
  const Double3 a = {d.x / r.x, d.y / r.y, d.z / r.z};
  const Double3 b = {a.x / r.x, a.y / r.y, a.z / r.z};
  const double k0 = Length(a), k1 = Length(b);
  return k1 > 1e-9 ? k0 * (k0 - 1) / k1 : -std::min({r.x, r.y, r.z});
}

// A capsule whose radius changes from ra to rb.
inline double Cone(Double3 p, Double3 a, Double3 b, double ra, double rb) {
  const Double3 pa = p - a, ba = b - a;
  const double h = std::clamp(Dot(pa, ba) / Dot(ba, ba), 0.0, 1.0);
  return Length(pa - ba * h) - (ra + (rb - ra) * h);
}

}  // namespace kpsa::engine::scenes
