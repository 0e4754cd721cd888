#include "nodes/kernels/shape_paths.h"

namespace kpsa::engine {

void ShapePaths::Path::Add(double weight, std::span<double> weights) const {
  std::size_t i = 0;
  while (i + 2 < stops.size() && weight > stops[i + 1].at) ++i;
  const double t = (weight - stops[i].at) / (stops[i + 1].at - stops[i].at);
  if (stops[i].shape != kNoShape) weights[stops[i].shape] += 1 - t;
  weights[stops[i + 1].shape] += t;
}

Result<ShapePaths> ShapePaths::Make(std::span<const std::int64_t> targets,
                                    std::span<const std::int64_t> shapes, std::span<const double> places,
                                    std::size_t target_count) {
  if (targets.size() != shapes.size() || targets.size() != places.size()) {
    return Status::Invalid(
        "inbetweenTarget, inbetweenShape and inbetweenWeight have {}, {} and {} entries, "
        "expected as many",
        targets.size(), shapes.size(), places.size());
  }
  ShapePaths result;
  for (std::size_t i = 0; i < targets.size(); ++i) {
    const auto count = static_cast<std::int64_t>(target_count);
    if (targets[i] < 0 || targets[i] >= count || shapes[i] < 0 || shapes[i] >= count) {
      return Status::Invalid("in-between {}: expected numbers of targets from 0 to {}", i, count - 1);
    }
    if (targets[i] == shapes[i]) return Status::Invalid("in-between {}: target {} is its own", i, targets[i]);
    if (!(places[i] > 0 && places[i] < 1))
      return Status::Invalid("in-between {}: a weight of {}, expected more than 0 and less than 1", i,
                             places[i]);
    const auto target = static_cast<std::size_t>(targets[i]);
    auto path = std::find_if(result.paths_.begin(), result.paths_.end(),
                             [&](const Path& p) { return p.target == target; });
    if (path == result.paths_.end())
      path = result.paths_.insert(path, {target, {{0, kNoShape}, {1, target}}});
    const auto after = std::find_if(path->stops.begin(), path->stops.end(),
                                    [&](const Stop& stop) { return stop.at >= places[i]; });
    if (after->at == places[i])
      return Status::Invalid("in-between {}: target {} has two at {}", i, target, places[i]);
    path->stops.insert(after, {places[i], static_cast<std::size_t>(shapes[i])});
  }
  return result;
}

}  // namespace kpsa::engine
