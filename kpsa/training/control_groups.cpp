#include "kpsa/training/control_groups.h"

#include <algorithm>
#include <utility>

#include "base/median.h"
#include "base/types.h"
#include "kpsa/training/mode_choice.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kGroupPoints = 400;  // where it looks
constexpr double kGroupShare = 0.2;        // of a control's largest displacement: it acts on a point
constexpr std::size_t kGroupSize = 8;      // controls that move a point most

}  // namespace

ControlGroups FindControlGroups(const PoseMatrix& poses, std::size_t first, std::size_t controls) {
  if (controls == 0) return {};
  const std::vector<Index> points = EvenSpread(static_cast<Index>(poses.layout().points), kGroupPoints);
  // The median of all sweeps, since most of them leave a point at rest
  std::vector<float> rest(3 * points.size());
  const std::size_t n = controls;
  const auto at = [&](std::size_t row, std::size_t p, std::size_t k) {
    return poses.row(row)[3 * points[p] + k];
  };
  for (std::size_t i = 0; i < rest.size(); ++i) {
    std::vector<float> values;
    for (std::size_t s = 0; s < 2 * n; ++s) values.push_back(at(first + s, i / 3, i % 3));
    rest[i] = UpperMedian(std::move(values));
  }
  std::vector<std::vector<std::pair<double, std::size_t>>> movers(
      points.size());  // by point: displacement, control
  for (std::size_t c = 0; c < n; ++c) {
    std::vector<double> moved(points.size());
    for (std::size_t p = 0; p < points.size(); ++p) {
      for (std::size_t s = first + 2 * c; s < first + 2 * c + 2; ++s) {
        const Double3 d{at(s, p, 0) - rest[3 * p], at(s, p, 1) - rest[3 * p + 1],
                        at(s, p, 2) - rest[3 * p + 2]};
        moved[p] = std::max(moved[p], Length(d));
      }
    }
    const double most = *std::max_element(moved.begin(), moved.end());
    for (std::size_t p = 0; p < points.size() && most > 0; ++p) {
      if (moved[p] > kGroupShare * most) movers[p].emplace_back(moved[p], c);
    }
  }
  ControlGroups groups;
  for (auto& of_point : movers) {
    std::sort(of_point.rbegin(), of_point.rend());
    if (of_point.size() > kGroupSize) of_point.resize(kGroupSize);
    if (of_point.size() < 2) continue;
    std::vector<std::size_t>& group = groups.emplace_back();
    for (const auto& [displacement, control] : of_point) group.push_back(control);
    std::sort(group.begin(), group.end());
  }
  std::sort(groups.begin(), groups.end());
  groups.erase(std::unique(groups.begin(), groups.end()), groups.end());
  return groups;
}

}  // namespace kpsa::engine
