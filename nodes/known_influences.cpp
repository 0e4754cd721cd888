#include "nodes/known_influences.h"

#include <algorithm>

namespace kpsa::engine {

std::shared_ptr<KnownInfluences::Geometry> KnownInfluences::GeometryOf(const Digest& key, std::size_t total) {
  for (const std::shared_ptr<Geometry>& geometry : geometries_) {
    if (geometry->key == key) return geometry;
  }
  if (geometries_.size() == kMostGeometries) geometries_.erase(geometries_.begin());
  auto made = std::make_shared<Geometry>();
  made->key = key;
  made->begin.assign(total, kNoIndex);
  made->count.assign(total, 0);
  return geometries_.emplace_back(std::move(made));
}

WrapInfluences KnownInfluences::Of(const Digest& key, std::size_t total, std::span<const Index> points,
                                   const Find& find) {
  std::shared_ptr<Geometry> known;
  std::vector<Index> unknown;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    known = GeometryOf(key, total);
    std::ranges::copy_if(points, std::back_inserter(unknown),
                         [&](Index point) { return known->begin[point] == kNoIndex; });
  }
  // Without the lock, since it takes a while; what others find meanwhile is the same
  const WrapInfluences found = unknown.empty() ? WrapInfluences() : find(unknown);
  const std::lock_guard<std::mutex> lock(mutex_);
  const bool fits = known->points.size() + found.points.size() <= kMostShares;
  for (std::size_t i = 0; fits && i < unknown.size(); ++i) {
    const Index begin = found.offsets[i], end = found.offsets[i + 1];
    if (known->begin[unknown[i]] != kNoIndex) continue;
    known->begin[unknown[i]] = static_cast<Index>(known->points.size());
    known->count[unknown[i]] = end - begin;
    known->points.insert(known->points.end(), found.points.begin() + begin, found.points.begin() + end);
    known->weights.insert(known->weights.end(), found.weights.begin() + begin, found.weights.begin() + end);
  }
  WrapInfluences all;
  std::size_t next = 0;  // of the unknown ones
  for (const Index point : points) {
    const bool is_unknown = next < unknown.size() && unknown[next] == point;
    const std::size_t at = next;
    next += is_unknown ? 1 : 0;
    const Index begin = is_unknown ? found.offsets[at] : known->begin[point];
    const Index count = is_unknown ? found.offsets[at + 1] - begin : known->count[point];
    const std::vector<Index>& from = is_unknown ? found.points : known->points;
    const std::vector<double>& shares = is_unknown ? found.weights : known->weights;
    all.points.insert(all.points.end(), from.begin() + begin, from.begin() + begin + count);
    all.weights.insert(all.weights.end(), shares.begin() + begin, shares.begin() + begin + count);
    all.offsets.push_back(static_cast<Index>(all.points.size()));
  }
  return all;
}

}  // namespace kpsa::engine
