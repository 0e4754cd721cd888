// Points in scratch memory. Internal to the room.
#pragma once

#include <algorithm>
#include <span>
#include <vector>

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

// Points that follow each other on both sides, and so are copied at once.
struct PointRun {
  Index from, to, count;
};

inline void AddToRuns(Index from, Index to, std::vector<PointRun>* runs) {
  if (!runs->empty() && runs->back().from + runs->back().count == from &&
      runs->back().to + runs->back().count == to) {
    ++runs->back().count;
  } else {
    runs->push_back({from, to, 1});
  }
}

inline void CopyRuns(ConstPointsView from, std::span<const PointRun> runs, PointsView to) {
  for (const PointRun& run : runs) {
    std::copy_n(from.x + run.from, run.count, to.x + run.to);
    std::copy_n(from.y + run.from, run.count, to.y + run.to);
    std::copy_n(from.z + run.from, run.count, to.z + run.to);
  }
}

}  // namespace kpsa::engine
