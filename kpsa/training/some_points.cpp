#include "kpsa/training/some_points.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "graph/evaluator.h"
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
  Request request;
  for (const auto& mesh : rig.target.meshes) request.outputs.push_back({mesh.stages.back().points, {}});
  const Result<std::shared_ptr<const Plan>> plan = compiler.Compile(*rig.graph, request);
  if (!plan.ok()) return plan.status();
  std::size_t all = 0;
  for (const Plan::Output& output : (*plan)->outputs()) all += output.points.total();
  if (all <= many) return std::optional<TrainingRig>();
  Evaluator evaluator(*plan);
  KPSA_RETURN_IF_ERROR(evaluator.Evaluate());
  TrainingRig of_some = rig;
  while (of_some.every < kLeastOfPoints && all > some * of_some.every) of_some.every *= 2;
  for (std::size_t m = 0; m < rig.target.meshes.size(); ++m) {
    const ConstPointsView rest = evaluator.Points(static_cast<Index>(m));
    std::vector<Index>& points = of_some.some.emplace_back();
    for (std::size_t first = 0; first < rest.count; first += kTilePoints) {
      std::vector<Double3> places;
      for (std::size_t i = first; i < std::min(first + kTilePoints, rest.count); ++i)
        places.push_back({rest.x[i], rest.y[i], rest.z[i]});
      for (const Index i : FarthestApart(places, (places.size() + of_some.every - 1) / of_some.every))
        points.push_back(static_cast<Index>(first) + i);
    }
  }
  return std::optional(std::move(of_some));
}

}  // namespace kpsa::engine
