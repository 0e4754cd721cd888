// How the frames of a deltaMush are bound: tangents by least squares, and the detail. Runs once, in double.
#include <algorithm>
#include <cmath>

#include "base/check.h"
#include "base/matrix.h"
#include "nodes/kernels/delta_mush_run.h"
#include "nodes/kernels/mush_frames.h"
#include "nodes/kernels/weights.h"

namespace kpsa::engine {
namespace {

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

Double3 PointAt(const float* xyzw) { return {xyzw[0], xyzw[1], xyzw[2]}; }

}  // namespace

MushFrames::MushFrames(const Topology& topology, Outputs outputs, std::span<const Index> local_of,
                       ConstPointsView rest, const float* smoothed, const float* pivot)
    : count_(outputs.points.size()), out_in_(std::move(outputs.in)) {
  KPSA_CHECK(outputs.masks.empty() || outputs.masks.size() == count_);
  KPSA_CHECK(out_in_.empty() || out_in_.size() == count_);
  if (count_ == 0) return;
  if (!outputs.masks.empty()) {
    if (std::ranges::all_of(outputs.masks, [](float w) { return w == 0; })) return;
    masks_ = PaddedWeights(outputs.masks, count_);
  }
  SortLanes(topology, outputs.points);
  frame_offsets_.push_back(0);
  for (std::size_t k = 0; k < count_; ++k) {
    const std::size_t i = k / kFinishBlock * kFinishBlock + lanes_[k];
    const Index p = outputs.points[i];
    out_local_.push_back(Changes(i) ? 4 * local_of[p] : 0);
    if (Changes(i)) AddRing(topology.neighbors().row(p), local_of, smoothed, smoothed + out_local_.back());
    frame_offsets_.push_back(static_cast<Index>(frame_neighbors_.size()));
  }
  frame_weights_.resize(frame_weights_.size() + 2);  // they are read by fours
  detail_ = AlignedFloats(3 * PaddedCount(count_));
  ComputeMushDetail(FinishOf({1, 1, {pivot[0], pivot[1], pivot[2]}}, smoothed, detail_.data()), rest, 0,
                    count_);
}

void MushFrames::SortLanes(const Topology& topology, std::span<const Index> points) {
  const auto ring_size = [&](std::size_t i) { return topology.neighbors().row(points[i]).size(); };
  for (std::size_t i = 0; i < count_; ++i) lanes_.push_back(static_cast<std::uint8_t>(i % kFinishBlock));
  for (std::size_t begin = 0; begin < count_; begin += kFinishBlock) {
    const auto first = lanes_.begin() + static_cast<std::ptrdiff_t>(begin);
    std::stable_sort(
        first, first + static_cast<std::ptrdiff_t>(std::min(kFinishBlock, count_ - begin)),
        [&](std::uint8_t a, std::uint8_t b) { return ring_size(begin + a) < ring_size(begin + b); });
  }
}

void MushFrames::AddRing(std::span<const Index> ring, std::span<const Index> local_of, const float* smoothed,
                         const float* center) {
  // The plane of the two largest spreads of the ring; tangents by least squares in it
  double spread[3][3] = {}, values[3];
  Double3 axes[3];
  const auto edge_to = [&](Index q) { return PointAt(smoothed + 4 * local_of[q]) - PointAt(center); };
  for (Index q : ring) {
    const Double3 edge = edge_to(q);
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) spread[r][c] += edge[r] * edge[c];
    }
  }
  SymmetricEigen(spread, values, axes);
  const bool flat = values[1] > 1e-10 * values[0];  // otherwise the ring is a line: no frame
  for (Index q : ring) {
    const Double3 edge = edge_to(q);
    frame_neighbors_.push_back(4 * local_of[q]);
    frame_weights_.push_back(flat ? static_cast<float>(Dot(edge, axes[0]) / values[0]) : 0.0f);
    frame_weights_.push_back(flat ? static_cast<float>(Dot(edge, axes[1]) / values[1]) : 0.0f);
  }
}

MushFinish MushFrames::FinishOf(const Inputs& inputs, const float* smoothed, float* detail) const noexcept {
  const std::size_t row = PaddedCount(count_);
  return {smoothed,
          lanes_.data(),
          out_local_.data(),
          frame_offsets_.data(),
          frame_neighbors_.data(),
          frame_weights_.data(),
          out_in_.empty() ? nullptr : out_in_.data(),
          masks_.size() == 0 ? nullptr : masks_.data(),
          detail,
          detail + row,
          detail + 2 * row,
          inputs.envelope,
          inputs.displacement,
          {inputs.pivot[0], inputs.pivot[1], inputs.pivot[2]}};
}

void MushFrames::Pass(ConstPointsView in, PointsView out) const noexcept {
  if (out_in_.empty()) return CopyPoints(in, out);
  GatherPoints(in, out_in_, out);
}

}  // namespace kpsa::engine
