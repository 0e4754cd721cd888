// Places on the surface of a head, and the two shapes of steps that the generators share.
#include <algorithm>
#include <cmath>

#include "scenes/head_shape.h"

namespace kpsa::engine::scenes {

Double3 HeadNormal(const HeadDesign& design, Double3 p) {
  constexpr double kStep = 1e-3;
  const auto& distance = design.distance;
  const Double3 g = {distance({p.x + kStep, p.y, p.z}) - distance({p.x - kStep, p.y, p.z}),
                     distance({p.x, p.y + kStep, p.z}) - distance({p.x, p.y - kStep, p.z}),
                     distance({p.x, p.y, p.z + kStep}) - distance({p.x, p.y, p.z - kStep})};
  const double length = Length(g);
  return length > 0 ? g * (1 / length) : Double3{0, 0, 1};
}

Double3 ProjectToHead(const HeadDesign& design, Double3 p) {
  for (int i = 0; i < 12; ++i) {
    const double d = design.distance(p);
    if (std::fabs(d) < 1e-7) break;
    p = p - HeadNormal(design, p) * std::clamp(d, -0.8, 0.8);
  }
  return p;
}

double Smooth(double edge0, double edge1, double x) {
  const double t = std::clamp((x - edge0) / (edge1 - edge0), 0.0, 1.0);
  return t * t * t * (t * (6 * t - 15) + 10);
}

double Bump(double x, double half_width) { return Smooth(half_width, 0, std::fabs(x)); }

}  // namespace kpsa::engine::scenes
