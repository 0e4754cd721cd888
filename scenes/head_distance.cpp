// The implicit surface of the head: rounded solids joined by smooth minima (I. Quilez, "Smooth minimum").
#include <algorithm>
#include <cmath>

#include "scenes/head_shape.h"

namespace kpsa::scenes {
namespace {

double SmoothUnion(double a, double b, double k) {
  const double h = std::max(k - std::fabs(a - b), 0.0) / k;
  return std::min(a, b) - h * h * k * 0.25;
}
double SmoothCut(double a, double tool, double k) { return -SmoothUnion(-a, tool, k); }

double Ellipsoid(Double3 p, Double3 center, Double3 r) {
  const Double3 d = p - center;
  const Double3 a = {d.x / r.x, d.y / r.y, d.z / r.z};
  const Double3 b = {a.x / r.x, a.y / r.y, a.z / r.z};
  const double k0 = Length(a), k1 = Length(b);
  return k1 > 1e-9 ? k0 * (k0 - 1) / k1 : -std::min({r.x, r.y, r.z});
}

// A capsule whose radius changes from ra to rb.
double Cone(Double3 p, Double3 a, Double3 b, double ra, double rb) {
  const Double3 pa = p - a, ba = b - a;
  const double h = std::clamp(Dot(pa, ba) / Dot(ba, ba), 0.0, 1.0);
  return Length(pa - ba * h) - (ra + (rb - ra) * h);
}

}  // namespace

double HeadDistance(Double3 p) {
  p.x = std::sqrt(p.x * p.x + 1e-6);  // mirrored, without a crease
  // Skull, face, jaw
  double d = Ellipsoid(p, {0, 21.6, -1.1}, {7.5, 8.5, 9.4});
  d = SmoothUnion(d, Ellipsoid(p, {0, 21.6, 3.7}, {6.2, 5.7, 5.9}), 2.0);            // forehead
  d = SmoothUnion(d, Ellipsoid(p, {0, 15.4, 2.6}, {5.6, 6.2, 6.0}), 2.2);            // mid face
  d = SmoothUnion(d, Ellipsoid(p, {0, 11.6, 3.4}, {4.9, 4.0, 5.2}), 2.0);            // jaw
  d = SmoothUnion(d, Cone(p, {5.0, 13.6, -0.2}, {1.6, 8.7, 6.2}, 1.25, 1.15), 2.0);  // jaw line
  d = SmoothUnion(d, Ellipsoid(p, {0, 8.75, 7.0}, {1.85, 1.45, 1.75}), 1.5);         // chin
  d = SmoothUnion(d, Ellipsoid(p, {4.25, 16.15, 5.35}, {1.75, 1.4, 1.6}), 2.0);      // cheek bone
  d = SmoothUnion(d, Ellipsoid(p, {3.5, 13.3, 5.6}, {1.9, 2.1, 1.7}), 1.8);          // cheek
  // Neck
  d = SmoothUnion(d, Cone(p, {0, -4, -2.9}, {0, 11, -1.5}, 5.4, 4.55), 2.4);
  d = SmoothUnion(d, Cone(p, {0.9, -1, 1.5}, {5.2, 13.5, -2.6}, 0.7, 0.7), 1.8);  // sternomastoid
  d = SmoothUnion(d, Ellipsoid(p, {0, 4.4, 2.5}, {0.8, 1.2, 0.6}), 1.4);          // larynx
  d = SmoothUnion(d, Cone(p, {3.4, -5, -4.4}, {1.9, 12, -5.2}, 2.2, 1.3), 2.6);   // trapezius
  // Eye sockets, brows
  d = SmoothCut(d, Ellipsoid(p, {3.1, 18.65, 9.0}, {2.1, 1.35, 1.75}), 1.6);
  d = SmoothCut(d, Ellipsoid(p, {1.45, 18.9, 9.2}, {0.9, 1.2, 1.1}), 1.2);
  d = SmoothUnion(d, Cone(p, {1.3, 20.25, 7.85}, {4.9, 20.5, 5.9}, 0.72, 0.62), 1.3);
  d = SmoothUnion(d, Ellipsoid(p, {0, 20.7, 7.9}, {1.6, 0.9, 1.1}), 1.4);
  d = SmoothCut(d, Ellipsoid(p, {7.9, 20.3, 3.4}, {1.4, 2.4, 2.4}), 2.0);  // temple
  // Nose
  d = SmoothUnion(d, Cone(p, {0, 19.2, 7.85}, {0, 15.3, 10.0}, 0.60, 0.84), 1.3);
  d = SmoothUnion(d, Ellipsoid(p, {0, 14.95, 10.3}, {0.98, 0.82, 0.9}), 0.7);
  d = SmoothUnion(d, Ellipsoid(p, {1.15, 14.55, 9.45}, {0.66, 0.68, 0.95}), 0.9);  // wing
  d = SmoothUnion(d, Cone(p, {0, 14.2, 10.3}, {0, 13.9, 9.2}, 0.35, 0.45), 0.6);   // columella
  // Mouth
  d = SmoothUnion(d, Ellipsoid(p, {0, 11.75, 7.0}, {3.3, 2.5, 2.5}), 1.4);
  d = SmoothCut(d, Cone(p, {0, 13.6, 9.75}, {0, 12.5, 9.85}, 0.28, 0.26), 0.45);   // philtrum
  d = SmoothCut(d, Cone(p, {0, 9.95, 9.35}, {1.2, 10.1, 8.95}, 0.32, 0.2), 0.9);   // under the lower lip
  d = SmoothCut(d, Cone(p, {2.1, 14.0, 9.3}, {3.5, 11.7, 8.2}, 0.14, 0.20), 1.0);  // fold beside the mouth
  // Lids over the eyeballs
  d = SmoothUnion(d, Ellipsoid(p, kEyeCenter + Double3{0.02, 0.02, 0}, {1.60, 1.44, 1.47}), 0.6);
  return d;
}

Double3 HeadNormal(Double3 p) {
  constexpr double kStep = 1e-3;
  const Double3 g = {HeadDistance({p.x + kStep, p.y, p.z}) - HeadDistance({p.x - kStep, p.y, p.z}),
                     HeadDistance({p.x, p.y + kStep, p.z}) - HeadDistance({p.x, p.y - kStep, p.z}),
                     HeadDistance({p.x, p.y, p.z + kStep}) - HeadDistance({p.x, p.y, p.z - kStep})};
  const double length = Length(g);
  return length > 0 ? g * (1 / length) : Double3{0, 0, 1};
}

Double3 ProjectToHead(Double3 p) {
  for (int i = 0; i < 12; ++i) {
    const double d = HeadDistance(p);
    if (std::fabs(d) < 1e-7) break;
    p = p - HeadNormal(p) * std::clamp(d, -0.8, 0.8);
  }
  return p;
}

double Smooth(double edge0, double edge1, double x) {
  const double t = std::clamp((x - edge0) / (edge1 - edge0), 0.0, 1.0);
  return t * t * t * (t * (6 * t - 15) + 10);
}

double Bump(double x, double half_width) { return Smooth(half_width, 0, std::fabs(x)); }

}  // namespace kpsa::scenes
