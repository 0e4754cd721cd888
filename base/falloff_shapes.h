// Falloffs in space: 1 at and inside their middle, 0 from their rim on. Lengths in one unit of the caller's;
// radii and widths above 0. Pure, any thread. Maya: primitiveFalloff, proximityFalloff.
#pragma once

#include <algorithm>

#include "base/types.h"

namespace kpsa::engine {

// How the weight gets from 0 at the rim to 1: t is 0 at the rim, 1 in the middle.
enum class FalloffFade : std::uint8_t { kSmooth, kLinear };
inline double Fade(FalloffFade fade, double t) {
  t = std::clamp(t, 0.0, 1.0);
  return fade == FalloffFade::kSmooth ? t * t * (3 - 2 * t) : t;
}

// By a distance (from a centre, a mesh, ...): 1 at 0, 0 at the radius.
inline double DistanceFalloff(double distance, double radius, FalloffFade fade) {
  return Fade(fade, 1 - distance / radius);
}

inline double SegmentDistance(Double3 p, Double3 a, Double3 b) {
  const Double3 along = b - a;
  const double square = Dot(along, along);
  const double t = square > 0 ? std::clamp(Dot(p - a, along) / square, 0.0, 1.0) : 0;
  return Length(p - (a + along * t));
}

// Around the segment from a to b.
inline double CapsuleFalloff(Double3 p, Double3 a, Double3 b, double radius, FalloffFade fade) {
  return DistanceFalloff(SegmentDistance(p, a, b), radius, fade);
}

// By the height above a plane: 1 at `from` (and beyond it), 0 at `to`; from and to differ. normal: unit
// length.
inline double PlaneFalloff(Double3 p, Double3 at, Double3 normal, double from, double to, FalloffFade fade) {
  return Fade(fade, (to - Dot(p - at, normal)) / (to - from));
}

}  // namespace kpsa::engine
