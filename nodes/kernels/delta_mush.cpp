#include "nodes/kernels/delta_mush.h"

#include <algorithm>
#include <cmath>

#include "base/check.h"
#include "base/matrix.h"
#include "nodes/kernels/weights.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nodes/kernels/delta_mush.cpp"
#include "hwy/foreach_target.h"
#include "nodes/kernels/xyzw-inl.h"

#ifndef KPSA_NODES_KERNELS_DELTA_MUSH_RUN_
#define KPSA_NODES_KERNELS_DELTA_MUSH_RUN_
namespace kpsa {
inline constexpr std::size_t kFinishBlock = 64;
// Points with equally many neighbours.
struct MushRows {
  const Index *order, *neighbors;
  const float *weights, *steps;  // weights: null if all alike
  std::size_t neighbor_count, count;
};
struct MushFinish {
  const float* smoothed;
  const std::uint8_t* lanes;  // place in its block of 64 of each frame, sorted by the number of neighbours
  const Index *out_local, *frame_offsets, *frame_neighbors;  // by frame
  const float* frame_weights;
  const Index* out_in;  // by output; null: the same
  const float* masks;   // null: all 1
  float *detail_x, *detail_y, *detail_z;
  float envelope, displacement;
  float pivot[3];
};
}  // namespace kpsa
#endif

HWY_BEFORE_NAMESPACE();
namespace kpsa {
namespace HWY_NAMESPACE {

// The points minus the pivot, as xyzw by local number.
void PackLocal(ConstPointsView in, const Index* source, const float* pivot, std::size_t begin, std::size_t end,
               float* xyzw) {
  if (source != nullptr) {
    for (std::size_t i = begin; i < end; ++i) {
      const Index p = source[i];
      float* to = xyzw + 4 * i;
      to[0] = in.x[p] - pivot[0], to[1] = in.y[p] - pivot[1], to[2] = in.z[p] - pivot[2], to[3] = 0;
    }
    return;
  }
  const DLanes d;
  const VLanes px = hn::Set(d, pivot[0]), py = hn::Set(d, pivot[1]), pz = hn::Set(d, pivot[2]);
  for (std::size_t i = begin; i < end; i += hn::Lanes(d)) {
    hn::StoreInterleaved4(hn::Sub(hn::Load(d, in.x + i), px), hn::Sub(hn::Load(d, in.y + i), py),
                          hn::Sub(hn::Load(d, in.z + i), pz), hn::Zero(d), d, xyzw + 4 * i);
  }
}

template <std::size_t n, bool kWeighted>  // n = 0: at run time
HWY_INLINE void SmoothGroup(const MushRows& rows, const float* HWY_RESTRICT from, float* HWY_RESTRICT to) {
  const std::size_t neighbor_count = n == 0 ? rows.neighbor_count : n, count = rows.count;
  const Index *HWY_RESTRICT neighbors = rows.neighbors, *HWY_RESTRICT order = rows.order;
  const float *HWY_RESTRICT weights = rows.weights, *HWY_RESTRICT steps = rows.steps;
  for (std::size_t i = 0; i < count; ++i, neighbors += neighbor_count) {
    const F4 s = Load4(from + order[i]);
    F4 sum = Sub4(Load4(from + neighbors[0]), s);
    if constexpr (kWeighted) sum = Mul4(Splat4(weights[0]), sum);
    for (std::size_t j = 1; j < neighbor_count; ++j) {
      const F4 edge = Sub4(Load4(from + neighbors[j]), s);
      sum = kWeighted ? Fma4(Splat4(weights[j]), edge, sum) : Add4(sum, edge);
    }
    if constexpr (kWeighted) weights += neighbor_count;
    Store4(Fma4(Splat4(steps[i]), sum, s), to + order[i]);
  }
}

// One iteration of a group.
void SmoothRows(const MushRows& rows, const float* from, float* to) {
  if (rows.neighbor_count == 0) {
    for (std::size_t i = 0; i < rows.count; ++i) Store4(Load4(from + rows.order[i]), to + rows.order[i]);
    return;
  }
  if (rows.weights != nullptr) return SmoothGroup<0, true>(rows, from, to);
  switch (rows.neighbor_count) {
    case 3: return SmoothGroup<3, false>(rows, from, to);
    case 4: return SmoothGroup<4, false>(rows, from, to);
    case 5: return SmoothGroup<5, false>(rows, from, to);
    case 6: return SmoothGroup<6, false>(rows, from, to);
    case 7: return SmoothGroup<7, false>(rows, from, to);
    case 8: return SmoothGroup<8, false>(rows, from, to);
    default: return SmoothGroup<0, false>(rows, from, to);
  }
}

// The frames of the outputs [begin, end), and with them either the detail (kBind) or the points.
// The frame is the rotation of the polar decomposition of the tangents (t b): with C = (t b)^T (t b) = (E F; F G) and
// s = sqrt(det C) = |t x b|, the root of C is (C + s I) / sqrt(tr C + 2 s).
template <bool kBind>
HWY_INLINE void Finish(const MushFinish& run, ConstPointsView in, PointsView out, std::size_t begin, std::size_t end) {
  const DLanes d;
  const VLanes zero = hn::Zero(d), one = hn::Set(d, 1.0f);
  // Blocks of points: what is gathered has left the store buffer before the wider loads read it
  alignas(64) float smoothed[4 * kFinishBlock] = {}, tangents[4 * kFinishBlock] = {}, bitangents[4 * kFinishBlock] = {};
  alignas(64) float incoming[3 * kFinishBlock] = {};
  for (std::size_t i = begin; i < end; i += hn::Lanes(d)) {
    const std::size_t at = (i - begin) % kFinishBlock;
    if (at == 0) {
      const std::size_t size = HWY_MIN(kFinishBlock, end - i);
      for (std::size_t k = 0; k < size; ++k) {
        const std::size_t lane = run.lanes[i + k];
        const F4 s = Load4(run.smoothed + run.out_local[i + k]);
        F4 t = Zero4(), b = t;
        const Index last = run.frame_offsets[i + k + 1];
        for (Index e = run.frame_offsets[i + k]; e < last; ++e) {
          const F4 edge = Sub4(Load4(run.smoothed + run.frame_neighbors[e]), s);
          t = Fma4(Splat4(run.frame_weights[2 * e]), edge, t);
          b = Fma4(Splat4(run.frame_weights[2 * e + 1]), edge, b);
        }
        Store4(s, smoothed + 4 * lane);
        Store4(t, tangents + 4 * lane);
        Store4(b, bitangents + 4 * lane);
      }
      for (std::size_t k = 0; k < (run.out_in == nullptr ? 0 : size); ++k) {
        const Index p = run.out_in[i + k];
        incoming[k] = in.x[p], incoming[kFinishBlock + k] = in.y[p], incoming[2 * kFinishBlock + k] = in.z[p];
      }
    }
    VLanes sx, sy, sz, tx, ty, tz, bx, by, bz, spare;
    hn::LoadInterleaved4(d, smoothed + 4 * at, sx, sy, sz, spare);
    hn::LoadInterleaved4(d, tangents + 4 * at, tx, ty, tz, spare);
    hn::LoadInterleaved4(d, bitangents + 4 * at, bx, by, bz, spare);

    // Frame; the axes of space where the tangents are (nearly) parallel or have no length
    const VLanes cx = Fma(ty, bz, hn::Neg(hn::Mul(tz, by)));
    const VLanes cy = Fma(tz, bx, hn::Neg(hn::Mul(tx, bz)));
    const VLanes cz = Fma(tx, by, hn::Neg(hn::Mul(ty, bx)));
    const VLanes e = Fma(tx, tx, Fma(ty, ty, hn::Mul(tz, tz)));
    const VLanes f = Fma(tx, bx, Fma(ty, by, hn::Mul(tz, bz)));
    const VLanes g = Fma(bx, bx, Fma(by, by, hn::Mul(bz, bz)));
    const VLanes s2 = Fma(cx, cx, Fma(cy, cy, hn::Mul(cz, cz)));
    // Not "s2 > ...": what is not a number must come out as such
    const auto regular = hn::Not(hn::Or(hn::Le(s2, hn::Mul(hn::Set(d, 1e-10f), hn::Mul(e, g))),
                                        hn::Le(s2, hn::Set(d, 1e-30f))));
    const VLanes s = hn::Sqrt(s2);
    const VLanes root = hn::Sqrt(hn::Add(hn::Add(e, g), hn::Add(s, s)));
    const VLanes scale = hn::Div(one, hn::Mul(root, s)), inverse_s = hn::Mul(scale, root);
    const VLanes gs = hn::Mul(hn::Add(g, s), scale), es = hn::Mul(hn::Add(e, s), scale);
    const VLanes fs = hn::Neg(hn::Mul(f, scale));
    const VLanes ux = hn::IfThenElse(regular, Fma(gs, tx, hn::Mul(fs, bx)), one);
    const VLanes uy = hn::IfThenElseZero(regular, Fma(gs, ty, hn::Mul(fs, by)));
    const VLanes uz = hn::IfThenElseZero(regular, Fma(gs, tz, hn::Mul(fs, bz)));
    const VLanes vx = hn::IfThenElseZero(regular, Fma(es, bx, hn::Mul(fs, tx)));
    const VLanes vy = hn::IfThenElse(regular, Fma(es, by, hn::Mul(fs, ty)), one);
    const VLanes vz = hn::IfThenElseZero(regular, Fma(es, bz, hn::Mul(fs, tz)));
    const VLanes nx = hn::IfThenElseZero(regular, hn::Mul(cx, inverse_s));
    const VLanes ny = hn::IfThenElseZero(regular, hn::Mul(cy, inverse_s));
    const VLanes nz = hn::IfThenElse(regular, hn::Mul(cz, inverse_s), one);

    VLanes x, y, z;
    if (run.out_in == nullptr) {
      x = hn::Load(d, in.x + i), y = hn::Load(d, in.y + i), z = hn::Load(d, in.z + i);
    } else {
      const float* row = incoming + at;
      x = hn::Load(d, row), y = hn::Load(d, row + kFinishBlock), z = hn::Load(d, row + 2 * kFinishBlock);
    }
    if constexpr (kBind) {  // with a pivot of 0
      x = hn::Sub(x, sx), y = hn::Sub(y, sy), z = hn::Sub(z, sz);
      hn::Store(Fma(ux, x, Fma(uy, y, hn::Mul(uz, z))), d, run.detail_x + i);
      hn::Store(Fma(vx, x, Fma(vy, y, hn::Mul(vz, z))), d, run.detail_y + i);
      hn::Store(Fma(nx, x, Fma(ny, y, hn::Mul(nz, z))), d, run.detail_z + i);
      continue;
    }
    const VLanes scale_detail = hn::Set(d, run.displacement);
    const VLanes du = hn::Load(d, run.detail_x + i), dv = hn::Load(d, run.detail_y + i);
    const VLanes dn = hn::Load(d, run.detail_z + i);
    const VLanes mx = Fma(scale_detail, Fma(du, ux, Fma(dv, vx, hn::Mul(dn, nx))), sx);
    const VLanes my = Fma(scale_detail, Fma(du, uy, Fma(dv, vy, hn::Mul(dn, ny))), sy);
    const VLanes mz = Fma(scale_detail, Fma(du, uz, Fma(dv, vz, hn::Mul(dn, nz))), sz);
    VLanes w = hn::Set(d, run.envelope);
    if (run.masks != nullptr) w = hn::Mul(w, hn::Load(d, run.masks + i));
    const auto all = hn::Eq(w, one), none = hn::Eq(w, zero);
    const auto mix = [&](const VLanes relative, const float pivot, const VLanes unmoved) HWY_ATTR {
      const VLanes mush = hn::Add(relative, hn::Set(d, pivot));
      const VLanes part = hn::IfThenElse(all, mush, Fma(w, hn::Sub(mush, unmoved), unmoved));
      return hn::IfThenElse(none, unmoved, part);
    };
    hn::Store(mix(mx, run.pivot[0], x), d, out.x + i);
    hn::Store(mix(my, run.pivot[1], y), d, out.y + i);
    hn::Store(mix(mz, run.pivot[2], z), d, out.z + i);
  }
}

void FinishPoints(const MushFinish& run, ConstPointsView in, PointsView out, std::size_t begin, std::size_t end) {
  Finish<false>(run, in, out, begin, end);
}
void FinishDetail(const MushFinish& run, ConstPointsView rest, std::size_t begin, std::size_t end) {
  Finish<true>(run, rest, {}, begin, end);
}

}  // namespace HWY_NAMESPACE
}  // namespace kpsa
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace kpsa {

HWY_EXPORT(PackLocal);
HWY_EXPORT(SmoothRows);
HWY_EXPORT(FinishPoints);
HWY_EXPORT(FinishDetail);

namespace {

constexpr std::size_t kBlock = 512;  // points that are sorted by their number of neighbours together

bool Smooths(const Topology& topology, const DeltaMushSettings& settings, Index point) {
  return settings.step != 0 && topology.neighbors().row(point).size() >= 2 &&
         !(settings.pin_borders && topology.is_border(point));
}

// The smoothed part of the demand, sorted by (level, mesh index). Level 0: outputs that change; 1: their rings, for
// the frames; then the rings of what smooths, one more for each iteration.
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

// The eigenvectors of a symmetric 3x3 matrix by Jacobi rotations; values descending.
void SymmetricEigen(double a[3][3], double values[3], Double3 vectors[3]) {
  double v[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  for (int sweep = 0; sweep < 12; ++sweep) {
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
  if (!(step >= 0 && step <= 1)) return Status::Invalid("deltaMush with a smoothing step of {}, expected 0 to 1", step);
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

DeltaMushKernel::DeltaMushKernel(const Topology& topology, ConstPointsView rest, const DeltaMushSettings& settings,
                                 std::span<const Index> out_points, std::span<const Index> in_points,
                                 std::span<const float> point_weights)
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
  BuildFrames(topology, rest_in.view(), out_points, local_of);
}

void DeltaMushKernel::BuildRows(const Topology& topology, ConstPointsView rest, const DeltaMushSettings& settings,
                                std::span<const Index> local, std::span<const int> level,
                                std::span<const Index> local_of) {
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
    std::stable_sort(members.begin(), members.end(), [&](Index a, Index b) { return row_size(a) < row_size(b); });
    for (Index p : members) {
      const Index size = row_size(p);
      if (p == members.front() || groups_.back().neighbors != size) {
        groups_.push_back({size, 0, static_cast<Index>(order_.size()), static_cast<Index>(neighbors_.size())});
      }
      ++groups_.back().count;
      order_.push_back(4 * local_of[p]);
      steps_.push_back(static_cast<float>(settings.distance_weight == 0 && size > 0 ? settings.step / size : settings.step));
      if (size == 0) continue;
      double inverse_sum = 0;
      const auto inverse_length = [&](Index q) { return 1 / std::max(Length(point(q) - point(p)), 1e-9); };
      for (Index q : topology.neighbors().row(p)) inverse_sum += inverse_length(q);
      for (Index q : topology.neighbors().row(p)) {
        neighbors_.push_back(4 * local_of[q]);
        if (settings.distance_weight == 0) continue;
        neighbor_weights_.push_back(static_cast<float>((1 - settings.distance_weight) / size +
                                                       settings.distance_weight * inverse_length(q) / inverse_sum));
      }
    }
    begin = end;
  }
  blocks_.push_back(static_cast<Index>(groups_.size()));
  for (int j = 0; j <= settings.iterations; ++j) {
    Index count = 0;
    while (count < block_level.size() && block_level[count] <= settings.iterations + 1 - j) ++count;
    block_counts_.push_back(count);
  }
}

void DeltaMushKernel::BuildFrames(const Topology& topology, ConstPointsView rest, std::span<const Index> out_points,
                                  std::span<const Index> local_of) {
  constexpr float kNoPivot[3] = {0, 0, 0};
  AlignedFloats scratch(ScratchFloats());
  const float* smoothed = Smooth(rest, kNoPivot, scratch.span(), nullptr);
  const auto point = [&](Index local4) {
    return Double3{smoothed[local4], smoothed[local4 + 1], smoothed[local4 + 2]};
  };
  const auto changes = [&](std::size_t i) { return masks_.size() == 0 || masks_.data()[i] != 0; };
  const auto ring_of = [&](std::size_t i) { return topology.neighbors().row(out_points[i]); };
  for (std::size_t i = 0; i < count_; ++i) lanes_.push_back(static_cast<std::uint8_t>(i % kFinishBlock));
  for (std::size_t begin = 0; begin < count_; begin += kFinishBlock) {
    const auto first = lanes_.begin() + static_cast<std::ptrdiff_t>(begin);
    std::stable_sort(first, first + static_cast<std::ptrdiff_t>(std::min(kFinishBlock, count_ - begin)),
                     [&](std::uint8_t a, std::uint8_t b) { return ring_of(begin + a).size() < ring_of(begin + b).size(); });
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
  detail_ = AlignedFloats(3 * PaddedCount(count_));
  float* detail = detail_.data();
  const std::size_t row = PaddedCount(count_);
  const MushFinish run{smoothed, lanes_.data(), out_local_.data(), frame_offsets_.data(), frame_neighbors_.data(),
                       frame_weights_.data(), out_in_.empty() ? nullptr : out_in_.data(), nullptr,
                       detail, detail + row, detail + 2 * row, 1, 1, {}};
  HWY_DYNAMIC_DISPATCH(FinishDetail)(run, rest, 0, count_);
}

const float* DeltaMushKernel::Smooth(ConstPointsView in, const float* pivot, std::span<float> scratch,
                                     const Parallel* parallel) const noexcept {
  float *from = scratch.data(), *to = from + BufferFloats();
  ForRanges(parallel, local_count_, 8192, [&](std::size_t begin, std::size_t end) {
    HWY_DYNAMIC_DISPATCH(PackLocal)(in, source_.empty() ? nullptr : source_.data(), pivot, begin, end, from);
  });
  for (int j = 1; j <= iterations_; ++j) {
    ForRanges(parallel, block_counts_[static_cast<std::size_t>(j)], 4, [&](std::size_t begin, std::size_t end) {
      const auto smooth_rows = HWY_DYNAMIC_DISPATCH(SmoothRows);
      for (Index g = blocks_[begin]; g < blocks_[end]; ++g) {
        const Group& group = groups_[g];
        const float* weights = neighbor_weights_.empty() ? nullptr : neighbor_weights_.data() + group.first_neighbor;
        smooth_rows({order_.data() + group.first_point, neighbors_.data() + group.first_neighbor, weights,
                     steps_.data() + group.first_point, group.neighbors, group.count},
                    from, to);
      }
    });
    std::swap(from, to);
  }
  return from;
}

void DeltaMushKernel::Run(const Inputs& inputs, ConstPointsView in, PointsView out, std::span<float> scratch,
                          const Parallel* parallel) const noexcept {
  KPSA_CHECK_EQ(in.count, in_count_);
  KPSA_CHECK_EQ(out.count, count_);
  KPSA_CHECK_LE(ScratchFloats(), scratch.size());
  const float envelope = static_cast<float>(inputs.envelope);
  if (local_count_ == 0 || envelope == 0) {
    if (out_in_.empty()) return CopyPoints(in, out);
    return GatherPoints(in, out_in_, out);
  }
  const float pivot[3] = {static_cast<float>(inputs.pivot.x), static_cast<float>(inputs.pivot.y),
                          static_cast<float>(inputs.pivot.z)};
  const float* smoothed = Smooth(in, pivot, scratch, parallel);
  const std::size_t row = PaddedCount(count_);
  float* detail = const_cast<float*>(detail_.data());  // read only, unless the kernel is bound
  const MushFinish run{smoothed, lanes_.data(), out_local_.data(), frame_offsets_.data(), frame_neighbors_.data(),
                       frame_weights_.data(), out_in_.empty() ? nullptr : out_in_.data(), masks_.data(),
                       detail, detail + row, detail + 2 * row, envelope, static_cast<float>(inputs.displacement),
                       {pivot[0], pivot[1], pivot[2]}};
  ForRanges(parallel, count_, 1024, [&](std::size_t begin, std::size_t end) {
    HWY_DYNAMIC_DISPATCH(FinishPoints)(run, in, out, begin, end);
  });
}

std::size_t DeltaMushKernel::SmoothingSteps() const {
  std::size_t steps = 0;
  for (std::size_t j = 1; j < block_counts_.size(); ++j) {
    for (Index g = 0; g < blocks_[block_counts_[j]]; ++g) steps += groups_[g].count;
  }
  return steps;
}

}  // namespace kpsa
#endif  // HWY_ONCE
