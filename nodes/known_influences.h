// What follows a driver finds its influences in every compilation: for what it asks of the driver, and to bind, each time
// for the points that are wanted. What was found of a point is kept beside the driver's rest. Thread-safe.
#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "base/digest.h"
#include "nodes/kernels/wrap.h"

namespace kpsa::engine {

class KnownInfluences {
 public:
  using Find = std::function<WrapInfluences(std::span<const Index> points)>;
  // Of points of a geometry of `total`, in their order; those that are not known are asked of `find`, which gives a point
  // the same influences whichever others are asked with it. key: of all else that they depend on: the geometry's rest
  // shape, and how they are found.
  WrapInfluences Of(const Digest& key, std::size_t total, std::span<const Index> points, const Find& find);

 private:
  static constexpr std::size_t kMostGeometries = 4;      // the latest ones
  static constexpr std::size_t kMostShares = 4'000'000;  // of one: 48 MB
  struct Geometry {
    Digest key;
    std::vector<Index> begin, count;  // by point, in what is below; kNoIndex: not known
    std::vector<Index> points;
    std::vector<double> weights;
  };
  std::shared_ptr<Geometry> GeometryOf(const Digest& key, std::size_t total);

  std::mutex mutex_;
  std::vector<std::shared_ptr<Geometry>> geometries_;  // the newest one last
};

}  // namespace kpsa::engine
