#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <utility>

#include "nodes/kernels/wrap.h"

namespace kpsa::engine {
namespace {

using Row = std::vector<std::pair<Index, double>>;  // driver point, weight; ascending

void AddRow(const Row& row, WrapInfluences* influences) {
  double all = 0, sum = 0;
  for (const auto& [point, weight] : row) all += weight;
  const auto counts = [&](double weight) { return weight > kLeastShare * all; };
  for (const auto& [point, weight] : row) sum += counts(weight) ? weight : 0;
  for (const auto& [point, weight] : row) {
    if (!counts(weight)) continue;
    influences->points.push_back(point);
    influences->weights.push_back(weight / sum);
  }
  influences->offsets.push_back(static_cast<Index>(influences->points.size()));
}

// Half of every weight goes to the neighbours.
Row Smoothed(const Topology& topology, const Row& row) {
  std::map<Index, double> sums;
  for (const auto& [point, weight] : row) {
    const auto neighbors = topology.neighbors().row(point);
    sums[point] += weight / (neighbors.empty() ? 1 : 2);
    for (const Index j : neighbors) sums[j] += weight / (2 * static_cast<double>(neighbors.size()));
  }
  return {sums.begin(), sums.end()};
}

Double3 At(ConstPointsView points, Index i) { return {points.x[i], points.y[i], points.z[i]}; }

}  // namespace

WrapInfluences SurfaceInfluences(const TriangleTree& driver, const Topology& topology, ConstPointsView rest,
                                 std::span<const Index> out_points, double max_distance, int smooth,
                                 std::span<const float> point_weights) {
  WrapInfluences influences;
  for (std::size_t i = 0; i < out_points.size(); ++i) {
    Row row;
    if (point_weights.empty() || point_weights[i] != 0) {
      const SurfacePoint place = driver.Closest(At(rest, out_points[i]), max_distance);
      for (std::size_t k = 0; k < 3 && place.triangle != kNoIndex; ++k) {
        if (place.weights[k] != 0)
          row.emplace_back(driver.triangles()[3 * std::size_t{place.triangle} + k], place.weights[k]);
      }
      std::sort(row.begin(), row.end());
      for (int step = 0; step < smooth; ++step) row = Smoothed(topology, row);
    }
    AddRow(row, &influences);
  }
  return influences;
}

WrapInfluences NearestInfluences(const TriangleTree& driver, ConstPointsView rest,
                                 std::span<const Index> out_points, double max_distance, std::size_t count,
                                 std::span<const float> point_weights) {
  WrapInfluences influences;
  std::vector<SurfacePoint> found;
  for (std::size_t i = 0; i < out_points.size(); ++i) {
    Row row;
    if (point_weights.empty() || point_weights[i] != 0) {
      driver.ClosestSeveral(At(rest, out_points[i]), count + 1, max_distance, &found);
      // The next one beyond the count says where the influences end
      double end = max_distance * max_distance;
      if (found.size() > count) {
        end = found.back().squared;
        found.pop_back();
      } else if (!found.empty() && !(end < std::numeric_limits<double>::infinity())) {
        end = 4 * found.back().squared;  // the driver has no more points
      }
      double sum = 0;
      for (const SurfacePoint& near : found) {
        const double fade = end > 0 ? std::max(0.0, 1 - near.squared / end) : 0;
        row.emplace_back(driver.triangles()[3 * std::size_t{near.triangle}], fade * fade);
        sum += fade * fade;
      }
      if (!(sum > 0)) {  // all at the same distance
        for (auto& [point, weight] : row) weight = 1;
      }
      std::sort(row.begin(), row.end());
    }
    AddRow(row, &influences);
  }
  return influences;
}

std::vector<Index> PointTriangles(const Topology& topology) {
  std::vector<Index> triangles;
  for (Index p = 0; p < topology.point_count(); ++p) {
    if (!topology.point_triangles().row(p).empty()) triangles.insert(triangles.end(), {p, p, p});
  }
  return triangles;
}

std::vector<Index> WrapDemand(const Topology& driver, std::span<const Double3> driver_rest,
                              const WrapInfluences& influences, WrapMode mode) {
  std::vector<char> asked(driver.point_count(), 0);
  for (const Index point : influences.points) asked[point] = 1;
  std::vector<Index> points;
  for (Index point = 0; point < asked.size(); ++point) {
    if (asked[point] != 0) points.push_back(point);
  }
  if (mode == WrapMode::kSnap) return points;
  const std::vector<Index> rings = DriverFramesDemand(driver, driver_rest, points);
  std::vector<Index> all;
  std::set_union(points.begin(), points.end(), rings.begin(), rings.end(), std::back_inserter(all));
  return all;
}

}  // namespace kpsa::engine
