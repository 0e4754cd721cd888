// How a deltaMush is bound: its closure, and the order in which its points are smoothed. Runs once, in double.
#include <algorithm>
#include <cmath>

#include "base/check.h"
#include "nodes/kernels/delta_mush.h"
#include "nodes/kernels/delta_mush_run.h"
#include "nodes/kernels/weights.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kBlock = 512;  // points that are sorted by their number of neighbours together

// The smoothed part of the demand, sorted by (level, mesh index). Level 0: outputs that change; 1: their
// rings, for the frames; then the rings of what smooths, one more for each iteration.
std::vector<Index> Closure(const Topology& topology, const DeltaMushSettings& settings,
                           std::span<const Index> out_points, std::span<const float> point_weights,
                           std::vector<int>* level_of) {
  std::vector<Index> found;
  level_of->clear();
  if (settings.iterations == 0) return found;
  std::vector<bool> seen(topology.point_count(), false);
  for (std::size_t i = 0; i < out_points.size(); ++i) {
    const bool weighted = point_weights.empty() || point_weights[i] != 0;
    if (!weighted || !Smooths(topology, settings, out_points[i])) continue;
    seen[out_points[i]] = true;
    found.push_back(out_points[i]);
  }
  level_of->assign(found.size(), 0);
  std::size_t begin = 0;
  for (int level = 1; level <= settings.iterations + 1 && begin < found.size(); ++level) {
    const std::size_t end = found.size();
    for (; begin < end; ++begin) {
      if (!Smooths(topology, settings, found[begin])) continue;
      for (Index q : topology.neighbors().row(found[begin])) {
        if (!seen[q]) seen[q] = true, found.push_back(q);
      }
    }
    std::sort(found.begin() + static_cast<std::ptrdiff_t>(end), found.end());
    level_of->resize(found.size(), level);
  }
  return found;
}

}  // namespace

bool Smooths(const Topology& topology, const DeltaMushSettings& settings, Index point) {
  return settings.step != 0 && topology.neighbors().row(point).size() >= 2 &&
         !(settings.pin_borders && topology.is_border(point));
}

Status DeltaMushSettings::Validate() const {
  if (iterations < 0 || iterations > 1000) {
    return Status::Invalid("deltaMush with {} iterations, expected 0 to 1000", iterations);
  }
  if (!(step >= 0 && step <= 1))
    return Status::Invalid("deltaMush with a smoothing step of {}, expected 0 to 1", step);
  if (!(distance_weight >= 0 && distance_weight <= 1)) {
    return Status::Invalid("deltaMush with a distance weight of {}, expected 0 to 1", distance_weight);
  }
  return {};
}

Double3 MiddleOf(ConstPointsView points) {
  Double3 sum;
  for (std::size_t i = 0; i < points.count; ++i) sum = sum + Double3{points.x[i], points.y[i], points.z[i]};
  return points.count == 0 ? sum : sum * (1.0 / static_cast<double>(points.count));
}

std::vector<Index> DeltaMushDemand(const Topology& topology, const DeltaMushSettings& settings,
                                   std::span<const Index> out_points, std::span<const float> point_weights) {
  std::vector<int> level;
  std::vector<Index> demand = Closure(topology, settings, out_points, point_weights, &level);
  demand.insert(demand.end(), out_points.begin(), out_points.end());
  std::sort(demand.begin(), demand.end());
  demand.erase(std::unique(demand.begin(), demand.end()), demand.end());
  return demand;
}

DeltaMushKernel::DeltaMushKernel(const Topology& topology, ConstPointsView rest,
                                 const DeltaMushSettings& settings, std::span<const Index> out_points,
                                 std::span<const Index> in_points, std::span<const float> point_weights,
                                 Double3 rest_pivot)
    : count_(out_points.size()), in_count_(in_points.size()), iterations_(settings.iterations) {
  KPSA_CHECK(settings.Validate().ok());
  KPSA_CHECK_EQ(rest.count, topology.point_count());
  KPSA_CHECK(IsSortedSet(out_points, rest.count) && IsSortedSet(in_points, rest.count));
  KPSA_CHECK(point_weights.empty() || point_weights.size() == count_);
  KPSA_CHECK_LT(rest.count, std::size_t{1} << 29);
  std::vector<int> level;
  const std::vector<Index> local = Closure(topology, settings, out_points, point_weights, &level);
  local_count_ = local.size();
  std::vector<Index> local_of(topology.point_count(), kNoIndex), place(topology.point_count(), kNoIndex);
  for (std::size_t i = 0; i < local_count_; ++i) local_of[local[i]] = static_cast<Index>(i);
  for (std::size_t i = 0; i < in_count_; ++i) place[in_points[i]] = static_cast<Index>(i);
  bool same = true;
  for (std::size_t i = 0; i < local_count_; ++i) {
    KPSA_CHECK(place[local[i]] != kNoIndex);
    source_.push_back(place[local[i]]);
    same &= source_.back() == i;
  }
  if (same) source_.clear();

  // Outputs that do not change have no local point: a mask of 0 lets them through
  MushFrames::Outputs outputs{out_points, {}, {point_weights.begin(), point_weights.end()}};
  if (in_count_ != count_) outputs.in = PositionsIn(in_points, out_points);
  for (std::size_t i = 0; i < count_; ++i) {
    const Index at = local_of[out_points[i]];
    if (at != kNoIndex && level[at] == 0) continue;
    if (outputs.masks.empty()) outputs.masks.assign(count_, 1.0f);
    outputs.masks[i] = 0;
  }

  BuildRows(topology, rest, settings, local, level, local_of);
  PointBuffer rest_in(in_count_);
  GatherPoints(rest, in_points, rest_in.view());
  const float pivot[3] = {static_cast<float>(rest_pivot.x), static_cast<float>(rest_pivot.y),
                          static_cast<float>(rest_pivot.z)};
  AlignedFloats scratch(ScratchFloats());
  const float* smoothed = Smooth(rest_in.view(), pivot, scratch.span(), nullptr);
  frames_ = MushFrames(topology, std::move(outputs), local_of, rest_in.view(), smoothed, pivot);
}

void DeltaMushKernel::BuildRows(const Topology& topology, ConstPointsView rest,
                                const DeltaMushSettings& settings, std::span<const Index> local,
                                std::span<const int> level, std::span<const Index> local_of) {
  const auto row_size = [&](Index p) {
    return Smooths(topology, settings, p) ? static_cast<Index>(topology.neighbors().row(p).size()) : 0;
  };
  const auto point = [&](Index p) { return Double3{rest.x[p], rest.y[p], rest.z[p]}; };
  std::vector<int> block_level;
  for (std::size_t begin = 0; begin < local_count_ && level[begin] <= settings.iterations;) {
    std::size_t end = begin;
    while (end < local_count_ && end - begin < kBlock && level[end] == level[begin]) ++end;
    blocks_.push_back(static_cast<Index>(groups_.size()));
    block_level.push_back(level[begin]);
    std::vector<Index> members(local.begin() + static_cast<std::ptrdiff_t>(begin),
                               local.begin() + static_cast<std::ptrdiff_t>(end));
    std::stable_sort(members.begin(), members.end(),
                     [&](Index a, Index b) { return row_size(a) < row_size(b); });
    for (Index p : members) {
      const Index size = row_size(p);
      if (p == members.front() || groups_.back().neighbors != size) {
        const double step = settings.distance_weight == 0 && size > 0 ? settings.step / size : settings.step;
        groups_.push_back({size, 0, static_cast<Index>(rows_.size()),
                           static_cast<Index>(neighbor_weights_.size()), static_cast<float>(step)});
      }
      ++groups_.back().count;
      double inverse_sum = 0;
      const auto inverse_length = [&](Index q) { return 1 / std::max(Length(point(q) - point(p)), 1e-9); };
      const auto ring = topology.neighbors().row(p).first(size);
      for (Index q : ring) inverse_sum += inverse_length(q);
      for (Index q : ring) {
        rows_.push_back(4 * local_of[q]);
        if (settings.distance_weight == 0) continue;
        neighbor_weights_.push_back(
            static_cast<float>((1 - settings.distance_weight) / size +
                               settings.distance_weight * inverse_length(q) / inverse_sum));
      }
      rows_.push_back(4 * local_of[p]);
    }
    begin = end;
  }
  blocks_.push_back(static_cast<Index>(groups_.size()));
  if (!neighbor_weights_.empty()) neighbor_weights_.resize(neighbor_weights_.size() + 3);  // read by fours
  for (int j = 0; j <= settings.iterations; ++j) {
    Index count = 0;
    while (count < block_level.size() && block_level[count] <= settings.iterations + 1 - j) ++count;
    block_counts_.push_back(count);
  }
}

std::size_t DeltaMushKernel::SmoothingSteps() const {
  std::size_t steps = 0;
  for (std::size_t j = 1; j < block_counts_.size(); ++j) {
    for (Index g = 0; g < blocks_[block_counts_[j]]; ++g) steps += groups_[g].count;
  }
  return steps;
}

}  // namespace kpsa::engine
