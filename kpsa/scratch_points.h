// Points in scratch memory. Internal to the room.
#pragma once

#include <span>

#include "base/points.h"

namespace kpsa::engine {

// Floats of a view of so many points, and that view of as many floats, aligned to 64 bytes.
inline std::size_t FloatsOf(std::size_t points) { return 3 * PaddedCount(points); }
inline PointsView ViewOf(std::span<float> floats, std::size_t count) {
  const std::size_t padded = PaddedCount(count);
  return {floats.data(), floats.data() + padded, floats.data() + 2 * padded, count};
}

inline void CopyPoint(ConstPointsView from, std::size_t i, PointsView to, std::size_t j) {
  to.x[j] = from.x[i], to.y[j] = from.y[i], to.z[j] = from.z[i];
}

}  // namespace kpsa::engine
