#include "nodes/kernels/dual_quaternion.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <type_traits>
#include <utility>

#include "base/check.h"
#include "nodes/kernels/transform_math.h"
#include "nodes/kernels/weights.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nodes/kernels/dual_quaternion.cpp"
#include "hwy/foreach_target.h"

#include "nodes/kernels/xyzw-inl.h"

#ifndef KPSA_NODES_KERNELS_DUAL_QUATERNION_RUN_
#define KPSA_NODES_KERNELS_DUAL_QUATERNION_RUN_
namespace kpsa::engine {
// What one Run hands to the vector code.
struct DualRun {
  float origin[3];
  const float* motions;  // rotation xyzw, dual part xyzw
  const float*
      stretches;  // columns x y z 0, but for the last number: whether the joint stretches; null: none does
  float envelope;
  const float* masks;  // null if all 1
  const float* blend;  // null if all 1
  const float* linear[3];
  const std::uint16_t* lanes;
  const Index *offsets, *entry_motions, *entry_joints;
  const float* entry_weights;
};
}  // namespace kpsa::engine
#endif

HWY_BEFORE_NAMESPACE();
namespace kpsa::engine {
namespace HWY_NAMESPACE {

// Rotation and dual part in as few vectors as there are
using DMotion = hn::CappedTag<float, 8>;
constexpr std::size_t kMotionParts = 8 / HWY_MIN(8, HWY_LANES(float));
struct Motion {
  hn::Vec<DMotion> part[kMotionParts];
};

template <std::size_t n, std::size_t e>
HWY_INLINE void AddMotions(const float* HWY_RESTRICT motions, const Index* HWY_RESTRICT entries,
                           const float* HWY_RESTRICT weights, Motion* HWY_RESTRICT sum) {
  const DMotion d;
#if HWY_TARGET == HWY_SCALAR
  const auto w = hn::Set(d, weights[e]);
#else
  const auto w = hn::Broadcast<e % 4>(hn::LoadDup128(d, weights + e / 4 * 4));
#endif
  for (std::size_t k = 0; k < kMotionParts; ++k) {
    const auto m = hn::Load(d, motions + EntryOf<e, n>(entries) + k * hn::Lanes(d));
    sum->part[k] = e == 0 ? hn::Mul(w, m) : Fma(w, m, sum->part[k]);
  }
  if constexpr (e + 1 < n) AddMotions<n, e + 1>(motions, entries, weights, sum);
}
HWY_INLINE void StoreMotion(const Motion& m, float* rotation, float* dual) {
#if HWY_MAX_BYTES >= 32
  Store4(hn::LowerHalf(D4(), m.part[0]), rotation);
  Store4(hn::UpperHalf(D4(), m.part[0]), dual);
#else
  const DMotion d;
  float* to[2] = {rotation, dual};
  for (std::size_t k = 0; k < kMotionParts; ++k)
    hn::Store(m.part[k], d, to[k * hn::Lanes(d) / 4] + k * hn::Lanes(d) % 4);
#endif
}

// Blended dual quaternions (not unit) of `count` points of n entries each; 0: `size`.
template <std::size_t n>
HWY_INLINE void BlendGroup(const float* HWY_RESTRICT motions, const std::uint16_t* HWY_RESTRICT lanes,
                           const Index* HWY_RESTRICT entries, const float* HWY_RESTRICT weights,
                           std::size_t size, std::size_t count, float* HWY_RESTRICT rotations,
                           float* HWY_RESTRICT duals) {
  if constexpr (n != 0) size = n;
  for (std::size_t i = 0; i < count; ++i, entries += size, weights += size) {
    Motion sum;
    if constexpr (n != 0) {
      AddMotions<n, 0>(motions, entries, weights, &sum);
    } else {
      const DMotion d;
      for (auto& part : sum.part) part = hn::Zero(d);
      for (std::size_t e = 0; e < size; ++e) {
        const auto w = hn::Set(d, weights[e]);
        for (std::size_t k = 0; k < kMotionParts; ++k) {
          const auto m = hn::Load(d, motions + entries[e] + k * hn::Lanes(d));
          sum.part[k] = e == 0 ? hn::Mul(w, m) : Fma(w, m, sum.part[k]);
        }
      }
    }
    StoreMotion(sum, rotations + 4 * lanes[i], duals + 4 * lanes[i]);
  }
}

void BlendMotions(const DualRun& run, std::size_t begin, std::size_t end, float* rotations, float* duals) {
  for (std::size_t i = begin; i < end;) {
    const Index first = run.offsets[i], size = run.offsets[i + 1] - first;
    std::size_t last = i + 1;
    while (last < end && run.offsets[last + 1] - run.offsets[last] == size) ++last;
    const std::uint16_t* lanes = run.lanes + i;
    const Index* entries = run.entry_motions + first;
    const float* weights = run.entry_weights + first;
    const auto blend = [&](auto n) HWY_ATTR {
      BlendGroup<n()>(run.motions, lanes, entries, weights, size, last - i, rotations, duals);
    };
    switch (size) {  // loops without a branch to mispredict
      case 1:
        blend(std::integral_constant<std::size_t, 1>());
        break;
      case 2:
        blend(std::integral_constant<std::size_t, 2>());
        break;
      case 3:
        blend(std::integral_constant<std::size_t, 3>());
        break;
      case 4:
        blend(std::integral_constant<std::size_t, 4>());
        break;
      case 5:
        blend(std::integral_constant<std::size_t, 5>());
        break;
      case 6:
        blend(std::integral_constant<std::size_t, 6>());
        break;
      case 7:
        blend(std::integral_constant<std::size_t, 7>());
        break;
      case 8:
        blend(std::integral_constant<std::size_t, 8>());
        break;
      default:
        blend(std::integral_constant<std::size_t, 0>());
        break;
    }
    i = last;
  }
}

// The stretched point, in place, where one of its joints stretches.
HWY_INLINE void Stretch(const DualRun& run, std::size_t point, float* p) {
  const Index begin = run.offsets[point], end = run.offsets[point + 1];
  bool stretches = false;
  for (Index e = begin; e < end; ++e) stretches |= run.stretches[run.entry_joints[e] + 15] != 0;
  if (!stretches) return;
  const float* m = run.stretches + run.entry_joints[begin];
  F4 w = Splat4(run.entry_weights[begin]);
  F4 c0 = Mul4(w, Load4(m)), c1 = Mul4(w, Load4(m + 4)), c2 = Mul4(w, Load4(m + 8)),
     c3 = Mul4(w, Load4(m + 12));
  for (Index e = begin + 1; e < end; ++e) {
    m = run.stretches + run.entry_joints[e];
    w = Splat4(run.entry_weights[e]);
    c0 = Fma4(w, Load4(m), c0);
    c1 = Fma4(w, Load4(m + 4), c1);
    c2 = Fma4(w, Load4(m + 8), c2);
    c3 = Fma4(w, Load4(m + 12), c3);
  }
  Store4(Fma4(c0, Splat4(p[0]), Fma4(c1, Splat4(p[1]), Fma4(c2, Splat4(p[2]), c3))), p);
}

void DualBlockLanes(const DualRun& run, std::size_t begin, std::size_t end, ConstPointsView in,
                    PointsView out) {
  const DLanes d;
  const std::size_t count = end - begin;
  alignas(64) float points[4 * DualQuaternionKernel::kBlock];
  alignas(64) float rotations[4 * DualQuaternionKernel::kBlock];
  alignas(64) float duals[4 * DualQuaternionKernel::kBlock];
  for (std::size_t i = count; i < (count + 15) / 16 * 16; ++i) {
    Store4(Zero4(), rotations + 4 * i);
    Store4(Zero4(), duals + 4 * i);
  }
  BlendMotions(run, begin, end, rotations, duals);
  if (run.stretches != nullptr) {
    PackXyzw(in.x + begin, in.y + begin, in.z + begin, 0, count, 1.0f, points);
    for (std::size_t i = begin; i < end; ++i) Stretch(run, i, points + 4 * run.lanes[i]);
  }

  const bool plain = run.masks == nullptr && run.envelope == 1.0f;
  const VLanes one = hn::Set(d, 1.0f), two = hn::Set(d, 2.0f), tiny = hn::Set(d, 1e-12f);
  for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
    // Unit length, then p + 2 v x (v x p + w p) + 2 (w d - dw v + v x d)
    VLanes vx, vy, vz, vw, dx, dy, dz, dw, px, py, pz, pw;
    hn::LoadInterleaved4(d, rotations + 4 * i, vx, vy, vz, vw);
    hn::LoadInterleaved4(d, duals + 4 * i, dx, dy, dz, dw);
    const VLanes x = hn::Load(d, in.x + begin + i), y = hn::Load(d, in.y + begin + i);
    const VLanes z = hn::Load(d, in.z + begin + i);
    px = x, py = y, pz = z;
    if (run.stretches != nullptr) hn::LoadInterleaved4(d, points + 4 * i, px, py, pz, pw);
    const VLanes square = Fma(vx, vx, Fma(vy, vy, Fma(vz, vz, hn::Mul(vw, vw))));
    const VLanes scale = hn::Div(one, hn::Sqrt(hn::IfThenElse(hn::Lt(square, tiny), tiny, square)));
    vx = hn::Mul(vx, scale), vy = hn::Mul(vy, scale), vz = hn::Mul(vz, scale), vw = hn::Mul(vw, scale);
    dx = hn::Mul(dx, scale), dy = hn::Mul(dy, scale), dz = hn::Mul(dz, scale), dw = hn::Mul(dw, scale);
    const auto cross = [&](VLanes a1, VLanes a2, VLanes b1, VLanes b2)
                           HWY_ATTR { return Fma(a1, b2, hn::Neg(hn::Mul(a2, b1))); };
    const VLanes cx = Fma(vw, px, cross(vy, vz, py, pz)), cy = Fma(vw, py, cross(vz, vx, pz, px));
    const VLanes cz = Fma(vw, pz, cross(vx, vy, px, py));
    const VLanes tx = Fma(vw, dx, Fma(hn::Neg(dw), vx, cross(vy, vz, dy, dz)));
    const VLanes ty = Fma(vw, dy, Fma(hn::Neg(dw), vy, cross(vz, vx, dz, dx)));
    const VLanes tz = Fma(vw, dz, Fma(hn::Neg(dw), vz, cross(vx, vy, dx, dy)));
    const VLanes moved[3] = {Fma(two, hn::Add(cross(vy, vz, cy, cz), tx), px),
                             Fma(two, hn::Add(cross(vz, vx, cz, cx), ty), py),
                             Fma(two, hn::Add(cross(vx, vy, cx, cy), tz), pz)};

    // Back to world space, with the envelope and the linear result where there are such
    VLanes w = hn::Set(d, run.envelope);
    if (run.masks != nullptr) w = hn::Mul(w, hn::Load(d, run.masks + begin + i));
    const auto all = hn::Eq(w, one), none = hn::Eq(w, hn::Zero(d));
    const VLanes unmoved[3] = {x, y, z};
    float* to[3] = {out.x + begin + i, out.y + begin + i, out.z + begin + i};
    for (std::size_t r = 0; r < 3; ++r) {
      const VLanes origin = hn::Set(d, run.origin[r]);
      VLanes result = hn::Add(moved[r], origin);
      if (!plain) {
        const VLanes base = hn::Sub(unmoved[r], origin);
        const VLanes blended = hn::IfThenElse(all, moved[r], Fma(w, hn::Sub(moved[r], base), base));
        result = hn::IfThenElse(none, unmoved[r], hn::Add(blended, origin));
      }
      if (run.blend != nullptr) {
        const VLanes share = hn::Load(d, run.blend + begin + i);
        const VLanes linear = hn::Load(d, run.linear[r] + begin + i);
        const VLanes mixed = Fma(share, hn::Sub(result, linear), linear);
        result = hn::IfThenElse(hn::Eq(share, hn::Zero(d)), linear,
                                hn::IfThenElse(hn::Eq(share, one), result, mixed));
      }
      hn::Store(result, d, to[r]);
    }
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace kpsa::engine
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace kpsa::engine {

HWY_EXPORT(DualBlockLanes);

namespace {

// Of a joint that stretches, with these columns relative to the origin: its motion, and its stretch about its centre.
void WriteStretched(const double* columns, Double3 center, float* motion, float* stretch_to) {
  Matrix4 m, stretch;
  for (std::size_t i = 0; i < 16; ++i) m.m[i] = i % 4 == 3 ? (i == 15 ? 1 : 0) : columns[i];
  const Quaternion q = QuaternionFromRotation(NearestRotation(m));
  const Matrix4 rotation = RotationFromUnit(q);
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c)
      stretch(r, c) = rotation(0, r) * m(0, c) + rotation(1, r) * m(1, c) + rotation(2, r) * m(2, c);
  }
  const Double3 shift = center - TransformVector(stretch, center);
  for (int r = 0; r < 3; ++r) stretch(r, 3) = shift[r];
  const Double3 t = (TransformPoint(m, center) - TransformVector(rotation, center)) * 0.5;
  const Quaternion dual = Quaternion{t.x, t.y, t.z, 0} * q;
  const double parts[8] = {q.x, q.y, q.z, q.w, dual.x, dual.y, dual.z, dual.w};
  for (std::size_t i = 0; i < 8; ++i) motion[i] = static_cast<float>(parts[i]);
  for (std::size_t i = 0; i < 15; ++i) stretch_to[i] = i % 4 == 3 ? 0 : static_cast<float>(stretch.m[i]);
}

void WriteUnstretched(float* stretch_to) {
  for (std::size_t i = 0; i < 15; ++i) stretch_to[i] = i % 5 == 0 ? 1 : 0;
}

}  // namespace

DualQuaternionKernel::DualQuaternionKernel(const SkinWeights& weights, std::span<const Double3> centers,
                                           std::span<const Index> out_points,
                                           std::span<const float> point_weights,
                                           std::span<const float> blend_weights)
    : count_(out_points.size()) {
  KPSA_CHECK_EQ(centers.size(), weights.joint_count);
  KPSA_CHECK(IsSortedSet(out_points, weights.point_count()));
  KPSA_CHECK(point_weights.empty() || point_weights.size() == count_);
  KPSA_CHECK(blend_weights.empty() || blend_weights.size() == count_);
  const auto wanted = [&](std::size_t i) { return blend_weights.empty() || blend_weights[i] != 0; };

  // The joints that occur, and their places in the palette
  std::vector<Index> joints, place(weights.joint_count, kNoIndex);
  for (std::size_t i = 0; i < count_; ++i) {
    for (Index e = weights.offsets[out_points[i]]; e < weights.offsets[out_points[i] + 1]; ++e) {
      if (weights.weights[e] != 0 && wanted(i)) place[weights.joints[e]] = 0;
    }
  }
  for (Index j = 0; j < weights.joint_count; ++j) {
    if (place[j] != 0) continue;
    place[j] = static_cast<Index>(joints.size());
    joints.push_back(j);
    centers_.push_back(centers[j]);
  }
  palette_ = SkinPalette(joints, weights.joint_from_bind, weights.joint_count);
  center_rows_.resize(3 * PaddedJoints());
  for (std::size_t j = 0; j < joints.size(); ++j) {
    for (int a = 0; a < 3; ++a)
      center_rows_[static_cast<std::size_t>(a) * PaddedJoints() + j] = centers_[j][a];
  }

  // Entries of each point, the largest weight first; a point without any stays through a mask of 0
  std::vector<float> masks(point_weights.begin(), point_weights.end());
  std::vector<std::vector<std::pair<Index, float>>> rows(count_);  // place of the joint, weight
  for (std::size_t i = 0; i < count_; ++i) {
    const Index begin = weights.offsets[out_points[i]], end = weights.offsets[out_points[i] + 1];
    double sum = 0;
    Index largest = end, used = 0;
    for (Index e = begin; e < end; ++e) {
      if (weights.weights[e] == 0) continue;
      ++used;
      sum += weights.weights[e];
      if (largest == end || weights.weights[e] > weights.weights[largest]) largest = e;
    }
    if (used == 0) {
      if (masks.empty()) masks.assign(count_, 1.0f);
      masks[i] = 0;
    } else if (wanted(i)) {
      const double scale = std::fabs(sum) > 1e-6 ? 1 / sum : 1;
      const auto add = [&](Index e) {
        rows[i].emplace_back(place[weights.joints[e]], static_cast<float>(weights.weights[e] * scale));
      };
      add(largest);
      for (Index e = begin; e < end; ++e) {
        if (weights.weights[e] != 0 && e != largest) add(e);
      }
    }
  }
  AddEntries(rows);
  if (!masks.empty()) masks_ = PaddedWeights(masks, count_);
  if (!blend_weights.empty()) blend_ = PaddedWeights(blend_weights, count_);
}

void DualQuaternionKernel::AddEntries(std::span<const std::vector<std::pair<Index, float>>> rows) {
  std::map<std::pair<Index, Index>, Index> motions;  // pivot and joint
  entry_offsets_.push_back(0);
  for (std::size_t begin = 0; begin < count_; begin += kBlock) {
    const std::size_t end = std::min(begin + kBlock, count_);
    for (std::size_t i = begin; i < end; ++i) lanes_.push_back(static_cast<std::uint16_t>(i - begin));
    std::stable_sort(lanes_.begin() + static_cast<std::ptrdiff_t>(begin), lanes_.end(),
                     [&](auto a, auto b) { return rows[begin + a].size() < rows[begin + b].size(); });
    for (std::size_t i = begin; i < end; ++i) {
      const auto& row = rows[begin + lanes_[i]];
      for (const auto& [joint, weight] : row) {
        const Index pivot = row.front().first;
        Index motion = joint;
        if (joint != pivot) {
          const auto [at, fresh] =
              motions.emplace(std::pair(pivot, joint), static_cast<Index>(PaddedJoints() + pairs_.size()));
          if (fresh) pairs_.push_back({pivot, joint});
          motion = at->second;
        }
        entry_motions_.push_back(kMotionFloats * motion);
        entry_joints_.push_back(kStretchFloats * joint);
        entry_weights_.push_back(weight);
      }
      entry_offsets_.push_back(static_cast<Index>(entry_motions_.size()));
    }
  }
  entry_weights_.resize(entry_weights_.size() + 3);  // they are read by fours
}

void DualQuaternionKernel::Run(const Inputs& inputs, ConstPointsView in, PointsView out,
                               std::span<float> scratch, const Parallel* parallel) const noexcept {
  KPSA_CHECK_EQ(in.count, count_);
  KPSA_CHECK_EQ(out.count, count_);
  KPSA_CHECK_LE(ScratchFloats(), scratch.size());
  KPSA_CHECK(blend_.size() == 0 || inputs.linear.count == count_);
  if (count_ == 0) return;

  DualRun run{};
  const std::size_t count = joints().size();
  auto* columns = reinterpret_cast<double*>(scratch.data());
  float* motions = scratch.data() + ColumnFloats();
  float* stretches = motions + MotionFloats();
  palette_.Run(inputs.joints, run.origin, columns);
  const bool any_stretches = FindMotions({count, columns, center_rows_.data()}, motions, stretches);
  for (std::size_t j = 0; any_stretches && j < count; ++j) {
    float* stretch = stretches + kStretchFloats * j;
    if (stretch[kStretchFloats - 1] == 0) {
      WriteUnstretched(stretch);
    } else {
      WriteStretched(columns + 16 * j, centers_[j], motions + kMotionFloats * j, stretch);
    }
  }
  TurnMotions(pairs_.data(), pairs_.size(), motions, motions + kMotionFloats * PaddedJoints());
  run.motions = motions;
  run.stretches = any_stretches ? stretches : nullptr;
  run.envelope = static_cast<float>(inputs.envelope);
  run.masks = masks_.data();
  run.blend = blend_.data();
  run.linear[0] = inputs.linear.x, run.linear[1] = inputs.linear.y, run.linear[2] = inputs.linear.z;
  run.lanes = lanes_.data();
  run.offsets = entry_offsets_.data();
  run.entry_motions = entry_motions_.data();
  run.entry_joints = entry_joints_.data();
  run.entry_weights = entry_weights_.data();
  const std::size_t blocks = (count_ + kBlock - 1) / kBlock;
  ForRanges(parallel, blocks, 8, [&](std::size_t first, std::size_t last) {
    for (std::size_t b = first; b < last; ++b) {
      HWY_DYNAMIC_DISPATCH(DualBlockLanes)(run, b * kBlock, std::min((b + 1) * kBlock, count_), in, out);
    }
  });
}

}  // namespace kpsa::engine
#endif  // HWY_ONCE
