// How a deltaMush is bound: its closure, the order of its points, frames and detail. Runs once, in double.
#include <algorithm>
#include <cmath>

#include "base/check.h"
#include "base/matrix.h"
#include "nodes/kernels/delta_mush.h"
#include "nodes/kernels/delta_mush_run.h"
#include "nodes/kernels/weights.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kBlock = 512;  // points that are sorted by their number of neighbours together

bool Smooths(const Topology& topology, const DeltaMushSettings& settings, Index point) {
  return settings.step != 0 && topology.neighbors().row(point).size() >= 2 &&
         !(settings.pin_borders && topology.is_border(point));
}

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

// What is left beside the diagonal counts as nothing below this share of it: a turn by less changes no double.
constexpr double kDiagonal = 1e-18;

// The eigenvectors of a symmetric 3x3 matrix by Jacobi rotations; values descending.
void SymmetricEigen(double a[3][3], double values[3], Double3 vectors[3]) {
  double v[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  for (int sweep = 0; sweep < 12; ++sweep) {
    const double least = kDiagonal * (std::fabs(a[0][0]) + std::fabs(a[1][1]) + std::fabs(a[2][2]));
    if (std::fabs(a[0][1]) <= least && std::fabs(a[0][2]) <= least && std::fabs(a[1][2]) <= least) break;
    for (int p = 0; p < 2; ++p) {
      for (int q = p + 1; q < 3; ++q) {
        if (a[p][q] == 0) continue;
        const double theta = (a[q][q] - a[p][p]) / (2 * a[p][q]);
        const double t = (theta >= 0 ? 1.0 : -1.0) / (std::fabs(theta) + std::sqrt(theta * theta + 1));
        const double c = 1 / std::sqrt(t * t + 1), s = t * c;
        for (int k = 0; k < 3; ++k) {
          const double kp = a[k][p], kq = a[k][q];
          a[k][p] = c * kp - s * kq, a[k][q] = s * kp + c * kq;
        }
        for (int k = 0; k < 3; ++k) {
          const double pk = a[p][k], qk = a[q][k];
          a[p][k] = c * pk - s * qk, a[q][k] = s * pk + c * qk;
        }
        for (auto& row : v) {
          const double kp = row[p], kq = row[q];
          row[p] = c * kp - s * kq, row[q] = s * kp + c * kq;
        }
      }
    }
  }
  int order[3] = {0, 1, 2};
  std::stable_sort(order, order + 3, [&](int i, int j) { return a[i][i] > a[j][j]; });
  for (int i = 0; i < 3; ++i) {
    values[i] = a[order[i]][order[i]];
    vectors[i] = {v[0][order[i]], v[1][order[i]], v[2][order[i]]};
  }
}

}  // namespace

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
  out_in_ = PositionsIn(in_points, out_points);
  if (in_count_ == count_) out_in_.clear();

  std::vector<int> level;
  const std::vector<Index> local = Closure(topology, settings, out_points, point_weights, &level);
  local_count_ = local.size();
  if (local_count_ == 0) return;
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
  std::vector<float> masks(point_weights.begin(), point_weights.end());
  for (std::size_t i = 0; i < count_; ++i) {
    const Index at = local_of[out_points[i]];
    if (at != kNoIndex && level[at] == 0) continue;
    if (masks.empty()) masks.assign(count_, 1.0f);
    masks[i] = 0;
  }
  if (!masks.empty()) masks_ = PaddedWeights(masks, count_);

  BuildRows(topology, rest, settings, local, level, local_of);
  PointBuffer rest_in(in_count_);
  GatherPoints(rest, in_points, rest_in.view());
  BuildFrames(topology, rest_in.view(), out_points, local_of, rest_pivot);
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

void DeltaMushKernel::BuildFrames(const Topology& topology, ConstPointsView rest,
                                  std::span<const Index> out_points, std::span<const Index> local_of,
                                  Double3 rest_pivot) {
  const float pivot[3] = {static_cast<float>(rest_pivot.x), static_cast<float>(rest_pivot.y),
                          static_cast<float>(rest_pivot.z)};
  AlignedFloats scratch(ScratchFloats());
  const float* smoothed = Smooth(rest, pivot, scratch.span(), nullptr);
  const auto point = [&](Index local4) {
    return Double3{smoothed[local4], smoothed[local4 + 1], smoothed[local4 + 2]};
  };
  const auto changes = [&](std::size_t i) { return masks_.size() == 0 || masks_.data()[i] != 0; };
  const auto ring_of = [&](std::size_t i) { return topology.neighbors().row(out_points[i]); };
  for (std::size_t i = 0; i < count_; ++i) lanes_.push_back(static_cast<std::uint8_t>(i % kFinishBlock));
  for (std::size_t begin = 0; begin < count_; begin += kFinishBlock) {
    const auto first = lanes_.begin() + static_cast<std::ptrdiff_t>(begin);
    std::stable_sort(first, first + static_cast<std::ptrdiff_t>(std::min(kFinishBlock, count_ - begin)),
                     [&](std::uint8_t a, std::uint8_t b) {
                       return ring_of(begin + a).size() < ring_of(begin + b).size();
                     });
  }
  frame_offsets_.push_back(0);
  for (std::size_t k = 0; k < count_; ++k) {
    const std::size_t i = k / kFinishBlock * kFinishBlock + lanes_[k];
    out_local_.push_back(changes(i) ? 4 * local_of[out_points[i]] : 0);
    if (changes(i)) {
      // The plane of the two largest spreads of the ring; tangents by least squares in it
      const Double3 center = point(out_local_.back());
      double spread[3][3] = {}, values[3];
      Double3 axes[3];
      for (Index q : ring_of(i)) {
        const Double3 edge = point(4 * local_of[q]) - center;
        for (int r = 0; r < 3; ++r) {
          for (int c = 0; c < 3; ++c) spread[r][c] += edge[r] * edge[c];
        }
      }
      SymmetricEigen(spread, values, axes);
      const bool flat = values[1] > 1e-10 * values[0];  // otherwise the ring is a line: no frame
      for (Index q : ring_of(i)) {
        const Double3 edge = point(4 * local_of[q]) - center;
        frame_neighbors_.push_back(4 * local_of[q]);
        frame_weights_.push_back(flat ? static_cast<float>(Dot(edge, axes[0]) / values[0]) : 0.0f);
        frame_weights_.push_back(flat ? static_cast<float>(Dot(edge, axes[1]) / values[1]) : 0.0f);
      }
    }
    frame_offsets_.push_back(static_cast<Index>(frame_neighbors_.size()));
  }
  frame_weights_.resize(frame_weights_.size() + 2);  // they are read by fours
  detail_ = AlignedFloats(3 * PaddedCount(count_));
  float* detail = detail_.data();
  const std::size_t row = PaddedCount(count_);
  const MushFinish run{smoothed,
                       lanes_.data(),
                       out_local_.data(),
                       frame_offsets_.data(),
                       frame_neighbors_.data(),
                       frame_weights_.data(),
                       out_in_.empty() ? nullptr : out_in_.data(),
                       nullptr,
                       detail,
                       detail + row,
                       detail + 2 * row,
                       1,
                       1,
                       {pivot[0], pivot[1], pivot[2]}};
  ComputeMushDetail(run, rest, 0, count_);
}

std::size_t DeltaMushKernel::SmoothingSteps() const {
  std::size_t steps = 0;
  for (std::size_t j = 1; j < block_counts_.size(); ++j) {
    for (Index g = 0; g < blocks_[block_counts_[j]]; ++g) steps += groups_[g].count;
  }
  return steps;
}

}  // namespace kpsa::engine
