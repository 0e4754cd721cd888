#include "nodes/kernels/skin.h"

#include <algorithm>
#include <cmath>

#include "base/check.h"
#include "nodes/kernels/weights.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nodes/kernels/skin.cpp"
#include "hwy/foreach_target.h"

#include "nodes/kernels/columns-inl.h"

#ifndef KPSA_NODES_KERNELS_SKIN_RUN_
#define KPSA_NODES_KERNELS_SKIN_RUN_
namespace kpsa::engine {
// What one Run hands to the vector code.
struct SkinRun {
  const float* palette;  // columns of each joint, relative to `origin`
  float origin[3];
  float envelope;
  const float* sums;   // minus 1
  const float* masks;  // null if all 1
};
struct SkinBlock {
  const SkinKernel::Group* groups;
  std::size_t group_count;
  const std::uint16_t* lanes;
  const Index* joints;
  const float* weights;
  std::size_t begin, end;  // points
};
}  // namespace kpsa::engine
#endif

HWY_BEFORE_NAMESPACE();
namespace kpsa::engine {
namespace HWY_NAMESPACE {

// (c0 x + c2 z) + (c1 y + c3) on every target. p: x y z 1.
#if HWY_MAX_BYTES >= 32
HWY_INLINE F4 Transform(const Columns& m, const float* p) {
  const DColumns d;
  HWY_ALIGN static constexpr std::int32_t kXy[8] = {0, 0, 0, 0, 1, 1, 1, 1},
                                          kZw[8] = {2, 2, 2, 2, 3, 3, 3, 3};
  const auto point = hn::LoadDup128(d, p);
  const auto xy = hn::TableLookupLanes(point, hn::SetTableIndices(d, kXy));
  const auto zw = hn::TableLookupLanes(point, hn::SetTableIndices(d, kZw));
  const auto half = hn::Add(hn::Mul(m.part[0], xy), hn::Mul(m.part[1], zw));
  return hn::Add(hn::LowerHalf(D4(), half), hn::UpperHalf(D4(), half));
}
#elif HWY_TARGET == HWY_SCALAR
HWY_INLINE F4 Transform(const Columns& m, const float* p) {
  F4 r;
  for (std::size_t i = 0; i < 4; ++i) {
    const float c0 = hn::GetLane(m.part[i]), c1 = hn::GetLane(m.part[4 + i]), c2 = hn::GetLane(m.part[8 + i]);
    r.v[i] = (c0 * p[0] + c2 * p[2]) + (c1 * p[1] + hn::GetLane(m.part[12 + i]) * p[3]);
  }
  return r;
}
#else
HWY_INLINE F4 Transform(const Columns& m, const float* p) {
  const F4 even = hn::Add(hn::Mul(m.part[0], Splat4(p[0])), hn::Mul(m.part[2], Splat4(p[2])));
  return hn::Add(even, hn::Add(hn::Mul(m.part[1], Splat4(p[1])), m.part[3]));
}
#endif

// `count` points of n influences each; n = 0: `influences` at run time.
template <std::size_t n>
HWY_INLINE void SkinGroup(const float* palette, std::size_t influences, std::size_t count,
                          const std::uint16_t* lanes, const Index* joints, const float* weights,
                          const float* points, float* result) {
  if constexpr (n != 0) influences = n;
  for (std::size_t i = 0; i < count; ++i, joints += influences, weights += influences) {
    const Columns m = BlendColumns<n>(palette, joints, weights, influences);
    const std::size_t lane = 4u * lanes[i];
    Store4(Transform(m, points + lane), result + lane);
  }
}

void SkinBlockLanes(const SkinRun& run, const SkinBlock& block, ConstPointsView in, PointsView out) {
  const DLanes d;
  alignas(64) float points[4 * SkinKernel::kBlock];
  alignas(64) float result[4 * SkinKernel::kBlock];
  const std::size_t begin = block.begin, count = block.end - block.begin;
  PackXyzw(in.x + begin, in.y + begin, in.z + begin, 0, count, 1.0f, points);

  // Blend the matrices and transform, group by group of equally many influences
  const std::uint16_t* lanes = block.lanes;
  const Index* joints = block.joints;
  const float* weights = block.weights;
  for (std::size_t g = 0; g < block.group_count; ++g) {
    const std::size_t n = block.groups[g].influences, size = block.groups[g].count;
    switch (n) {
      case 0:
        for (std::size_t i = 0; i < size; ++i) Store4(Zero4(), result + 4 * lanes[i]);
        break;
      case 1:
        SkinGroup<1>(run.palette, n, size, lanes, joints, weights, points, result);
        break;
      case 2:
        SkinGroup<2>(run.palette, n, size, lanes, joints, weights, points, result);
        break;
      case 3:
        SkinGroup<3>(run.palette, n, size, lanes, joints, weights, points, result);
        break;
      case 4:
        SkinGroup<4>(run.palette, n, size, lanes, joints, weights, points, result);
        break;
      case 5:
        SkinGroup<5>(run.palette, n, size, lanes, joints, weights, points, result);
        break;
      case 6:
        SkinGroup<6>(run.palette, n, size, lanes, joints, weights, points, result);
        break;
      case 7:
        SkinGroup<7>(run.palette, n, size, lanes, joints, weights, points, result);
        break;
      case 8:
        SkinGroup<8>(run.palette, n, size, lanes, joints, weights, points, result);
        break;
      default:
        SkinGroup<0>(run.palette, n, size, lanes, joints, weights, points, result);
        break;
    }
    lanes += size;
    joints += n * size;
    weights += n * size;
  }

  // Back to world space, with the envelope where there is one
  const VLanes ox = hn::Set(d, run.origin[0]), oy = hn::Set(d, run.origin[1]), oz = hn::Set(d, run.origin[2]);
  const bool plain = run.masks == nullptr && run.envelope == 1.0f;
  for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
    VLanes rx, ry, rz, rw;
    hn::LoadInterleaved4(d, result + 4 * i, rx, ry, rz, rw);
    const VLanes excess = hn::Load(d, run.sums + begin + i);
    rx = Fma(excess, ox, rx);
    ry = Fma(excess, oy, ry);
    rz = Fma(excess, oz, rz);
    if (plain) {
      hn::Store(hn::Add(rx, ox), d, out.x + begin + i);
      hn::Store(hn::Add(ry, oy), d, out.y + begin + i);
      hn::Store(hn::Add(rz, oz), d, out.z + begin + i);
      continue;
    }
    VLanes w = hn::Set(d, run.envelope);
    if (run.masks != nullptr) w = hn::Mul(w, hn::Load(d, run.masks + begin + i));
    const auto all = hn::Eq(w, hn::Set(d, 1.0f)), none = hn::Eq(w, hn::Zero(d));
    const VLanes x = hn::Load(d, in.x + begin + i), y = hn::Load(d, in.y + begin + i);
    const VLanes z = hn::Load(d, in.z + begin + i);
    const auto row = [&](const VLanes skinned, const VLanes origin, const VLanes unmoved) HWY_ATTR {
      const VLanes base = hn::Sub(unmoved, origin);
      const VLanes blended = hn::IfThenElse(all, skinned, Fma(w, hn::Sub(skinned, base), base));
      return hn::IfThenElse(none, unmoved, hn::Add(blended, origin));
    };
    hn::Store(row(rx, ox, x), d, out.x + begin + i);
    hn::Store(row(ry, oy, y), d, out.y + begin + i);
    hn::Store(row(rz, oz, z), d, out.z + begin + i);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace kpsa::engine
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace kpsa::engine {

HWY_EXPORT(SkinBlockLanes);

Status SkinWeights::Validate() const {
  if (offsets.empty() || offsets.front() != 0 || offsets.back() != joints.size() ||
      joints.size() != weights.size()) {
    return Status::Invalid("skin weights: the rows do not cover the {} joints and {} weights", joints.size(),
                           weights.size());
  }
  if (joint_count == 0) return Status::Invalid("skin weights: no joints, expected at least one");
  for (std::size_t p = 0; p < point_count(); ++p) {
    if (offsets[p] > offsets[p + 1] || offsets[p + 1] > joints.size()) {
      return Status::Invalid("skin weights: the offsets do not ascend at point {}", p);
    }
    if (offsets[p + 1] - offsets[p] > 4096) {
      return Status::Invalid("skin weights: point {} has {} influences, expected at most 4096", p,
                             offsets[p + 1] - offsets[p]);
    }
    for (Index i = offsets[p]; i < offsets[p + 1]; ++i) {
      if (joints[i] >= joint_count) {
        return Status::Invalid("skin weights: point {} names joint {}, expected an index below {}", p,
                               joints[i], joint_count);
      }
      if (!std::isfinite(weights[i])) {
        return Status::Invalid("skin weights: a weight of point {} is not a finite number", p);
      }
    }
  }
  return {};
}

SkinKernel::SkinKernel(const SkinWeights& weights, std::span<const Index> out_points,
                       std::span<const float> point_weights)
    : count_(out_points.size()), sums_(PaddedCount(out_points.size())) {
  KPSA_CHECK(IsSortedSet(out_points, weights.point_count()));
  KPSA_CHECK(point_weights.empty() || point_weights.size() == count_);

  // The joints that occur, and their places in the palette
  std::vector<Index> joints, place(weights.joint_count, kNoIndex);
  for (Index p : out_points) {
    for (Index e = weights.offsets[p]; e < weights.offsets[p + 1]; ++e) {
      if (weights.weights[e] != 0) place[weights.joints[e]] = 0;
    }
  }
  for (Index j = 0; j < weights.joint_count; ++j) {
    if (place[j] == 0) place[j] = 16 * static_cast<Index>(joints.size()), joints.push_back(j);
  }
  palette_ = SkinPalette(joints, weights.joint_from_bind, weights.joint_count);

  // Sums; a point without weights stays through a mask of 0
  std::vector<std::uint16_t> influence_count(count_);
  std::vector<float> masks(point_weights.begin(), point_weights.end());
  for (std::size_t i = 0; i < count_; ++i) {
    double sum = 0;
    for (Index e = weights.offsets[out_points[i]]; e < weights.offsets[out_points[i] + 1]; ++e) {
      if (weights.weights[e] != 0) ++influence_count[i], sum += weights.weights[e];
    }
    sums_.data()[i] = std::fabs(sum - 1) <= 1e-5 ? 0.0f : static_cast<float>(sum - 1);
    if (influence_count[i] == 0) {
      if (masks.empty()) masks.assign(count_, 1.0f);
      masks[i] = 0;
    }
  }
  if (!masks.empty()) masks_ = PaddedWeights(masks, count_);

  // Entries, block by block, points of equally many influences together
  lanes_.reserve(count_);
  for (std::size_t begin = 0; begin < count_; begin += kBlock) {
    const std::size_t size = std::min(kBlock, count_ - begin), first_lane = lanes_.size();
    block_groups_.push_back(static_cast<Index>(groups_.size()));
    block_entries_.push_back(static_cast<Index>(entry_joints_.size()));
    for (std::size_t i = 0; i < size; ++i) lanes_.push_back(static_cast<std::uint16_t>(i));
    std::stable_sort(lanes_.begin() + static_cast<std::ptrdiff_t>(first_lane), lanes_.end(),
                     [&](std::uint16_t a, std::uint16_t b) {
                       return influence_count[begin + a] < influence_count[begin + b];
                     });
    for (std::size_t i = 0; i < size; ++i) {
      const std::size_t at = begin + lanes_[first_lane + i];
      if (i == 0 || groups_.back().influences != influence_count[at])
        groups_.push_back({influence_count[at], 0});
      ++groups_.back().count;
      for (Index e = weights.offsets[out_points[at]]; e < weights.offsets[out_points[at] + 1]; ++e) {
        if (weights.weights[e] == 0) continue;
        entry_joints_.push_back(place[weights.joints[e]]);
        entry_weights_.push_back(weights.weights[e]);
      }
    }
  }
  block_groups_.push_back(static_cast<Index>(groups_.size()));
  entry_weights_.resize(entry_weights_.size() + 3);  // they are read by fours
}

void SkinKernel::Run(const Inputs& inputs, ConstPointsView in, PointsView out, std::span<float> scratch,
                     const Parallel* parallel) const noexcept {
  KPSA_CHECK_EQ(in.count, count_);
  KPSA_CHECK_EQ(out.count, count_);
  KPSA_CHECK_LE(ScratchFloats(), scratch.size());
  if (count_ == 0) return;

  SkinRun run{};
  palette_.Run(inputs.joints, run.origin, scratch.data());
  run.palette = scratch.data();
  run.envelope = static_cast<float>(inputs.envelope);
  run.sums = sums_.data();
  run.masks = masks_.data();

  const std::size_t blocks = block_groups_.size() - 1;
  ForRanges(parallel, blocks, 8, [&](std::size_t first, std::size_t last) {
    for (std::size_t b = first; b < last; ++b) {
      const std::size_t begin = b * kBlock, entry = block_entries_[b];
      const SkinBlock block{
          groups_.data() + block_groups_[b], block_groups_[b + 1] - block_groups_[b], lanes_.data() + begin,
          entry_joints_.data() + entry,      entry_weights_.data() + entry,           begin,
          std::min(begin + kBlock, count_)};
      HWY_DYNAMIC_DISPATCH(SkinBlockLanes)(run, block, in, out);
    }
  });
}

}  // namespace kpsa::engine
#endif  // HWY_ONCE
