#include "kpsa/training/some_points.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "kpsa/accelerate.h"
#include "kpsa/tiles.h"

namespace kpsa::engine {
namespace {

constexpr Index kLeastOfPoints = 32;  // of so many points, one

}  // namespace

std::vector<Index> FarthestApart(std::span<const Double3> places, std::size_t count) {
  std::vector<Index> chosen;
  std::vector<double> distance(places.size(), std::numeric_limits<double>::infinity());
  for (std::size_t next = 0; chosen.size() < std::min(count, places.size());) {
    chosen.push_back(static_cast<Index>(next));
    for (std::size_t i = 0; i < places.size(); ++i) {
      const Double3 d = places[i] - places[next];
      distance[i] = std::min(distance[i], Dot(d, d));
    }
    distance[next] = -1;
    next = static_cast<std::size_t>(std::ranges::max_element(distance) - distance.begin());
  }
  std::ranges::sort(chosen);
  return chosen;
}

Result<std::optional<TrainingRig>> SomePointsOf(const TrainingRig& rig, std::size_t many, std::size_t some) {
  KPSA_RETURN_IF_ERROR(rig.set_clip(std::nullopt));
  Compiler compiler;
  std::vector<std::vector<Double3>> rest;
  std::size_t all = 0;
  for (const auto& mesh : rig.target.meshes) {
    Result<std::vector<Double3>> of = RestPoints(*rig.graph, &compiler, mesh.stages.back().points);
    if (!of.ok()) return of.status();
    all += of->size();
    rest.push_back(std::move(*of));
  }
  if (all <= many) return std::optional<TrainingRig>();
  TrainingRig of_some = rig;
  while (of_some.every < kLeastOfPoints && all > some * of_some.every) of_some.every *= 2;
  for (const std::vector<Double3>& of : rest) {
    std::vector<Index>& points = of_some.some.emplace_back();
    for (std::size_t first = 0; first < of.size(); first += kTilePoints) {
      const std::span<const Double3> places =
          std::span(of).subspan(first, std::min(kTilePoints, of.size() - first));
      for (const Index i : FarthestApart(places, (places.size() + of_some.every - 1) / of_some.every))
        points.push_back(static_cast<Index>(first) + i);
    }
  }
  return std::optional(std::move(of_some));
}

}  // namespace kpsa::engine
