#include "base/scalar_math.h"
#include "scenes/head_shape.h"

namespace kpsa::engine::scenes {

EyeShape MakeEyeShape(const HeadDesign& design) {
  EyeShape eye;
  const double radius = design.eye_radius;
  constexpr int kAround = 20;
  // Rings from the pupil's floor to the back: angle from the axis, radius share, part
  struct Ring {
    double angle, radius;
    int part;
  };
  constexpr Ring kRings[] = {{0.10, 0.80, 2},  {0.16, 0.84, 2},   {0.185, 0.955, 1}, {0.26, 0.945, 1},
                             {0.36, 0.955, 1}, {0.425, 0.975, 0}, {0.47, 1.0, 0},    {0.62, 1.0, 0},
                             {0.90, 1.0, 0},   {1.25, 1.0, 0},    {1.65, 1.0, 0},    {2.1, 1.0, 0},
                             {2.6, 1.0, 0}};
  eye.points.push_back({0, 0, 0.80 * radius});
  eye.part.push_back(2);
  for (const Ring& ring : kRings) {
    for (int k = 0; k < kAround; ++k) {
      const double around = 2 * kPi * k / kAround, r = radius * ring.radius;
      const double angle = ring.angle < 0.5 ? ring.angle * design.iris_size : ring.angle;
      eye.points.push_back({r * Sin(angle) * Cos(around), r * Sin(angle) * Sin(around), r * Cos(angle)});
      eye.part.push_back(ring.part);
    }
  }
  eye.points.push_back({0, 0, -radius});
  eye.part.push_back(0);
  const int rings = static_cast<int>(std::size(kRings)), last = static_cast<int>(eye.points.size()) - 1;
  for (int k = 0; k < kAround; ++k) {
    const int next = (k + 1) % kAround;
    eye.quads.push_back({0, 1 + k, 1 + next, 1 + next});
    for (int ring = 0; ring + 1 < rings; ++ring) {
      const int a = 1 + ring * kAround, b = a + kAround;
      eye.quads.push_back({a + k, b + k, b + next, a + next});
    }
    const int a = 1 + (rings - 1) * kAround;
    eye.quads.push_back({a + k, last, a + next, a + next});
  }
  return eye;
}

}  // namespace kpsa::engine::scenes
