#include "rig/build/steps/measure_rest.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace kpsa::engine {

double RestDiagonal(const CharacterGraph& scene, RestPose* rest) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Double3 low{kInfinity, kInfinity, kInfinity}, high{-kInfinity, -kInfinity, -kInfinity};
  for (std::size_t m = 0; m < scene.meshes.size(); ++m) {
    for (const Double3& p : rest->WorldPoints(m)) {
      for (int i = 0; i < 3; ++i) {
        low[i] = std::min(low[i], p[i]);
        high[i] = std::max(high[i], p[i]);
      }
    }
  }
  const double diagonal = Length(high - low);
  return std::isfinite(diagonal) ? diagonal : 0;
}

}  // namespace kpsa::engine
