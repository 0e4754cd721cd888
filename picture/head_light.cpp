#include "picture/head_light.h"

#include "base/scalar_math.h"
#include "nodes/illumination.h"

namespace kpsa::engine {

Double3 HeadLightColor(const PathTracer& surfaces, const Matrix4& world_from_screen) {
  constexpr Index kRays = 16;  // each way
  double sum = 0;
  int hits = 0;
  for (Index pixel = 0; pixel < kRays * kRays; ++pixel) {
    Double3 origin, direction;
    PixelRay(world_from_screen, pixel, kRays, kRays, &origin, &direction);
    const ShadingPlace place = surfaces.Look(origin, direction);
    if (!place.hit) continue;
    const Double3 away = place.position - origin;
    sum += Dot(away, away);
    ++hits;
  }
  const double intensity = hits > 0 ? kPi * sum / hits : kPi;  // irradiance pi on what faces it, there
  return {intensity, intensity, intensity};
}

}  // namespace kpsa::engine
