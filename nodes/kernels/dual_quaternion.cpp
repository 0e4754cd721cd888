#include "nodes/kernels/dual_quaternion.h"

#include <algorithm>
#include <cmath>

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
// What one Run hands to the vector code. Of each joint: rotation xyzw, dual part xyzw, the columns x y z 0
// of its stretch, and 1 if it stretches.
struct DualRun : SkinFrame {
  const float* joints;
  float envelope;
  const float* masks;  // null if all 1
  const float* blend;  // null if all 1
  const float* linear[3];
  const Index* offsets;
  const Index* entry_joints;
  const float* entry_weights;
};
inline constexpr std::size_t kDualPart = 4, kStretch = 8, kStretches = 24;
}  // namespace kpsa::engine
#endif

HWY_BEFORE_NAMESPACE();
namespace kpsa::engine {
namespace HWY_NAMESPACE {

// One point: the blended dual quaternion (not unit) and the stretched point, in place.
HWY_INLINE void BlendMotions(const DualRun& run, std::size_t point, float* rotation, float* dual, float* p) {
  const Index begin = run.offsets[point], end = run.offsets[point + 1];
  if (begin == end) {
    Store4(Zero4(), rotation);
    Store4(Zero4(), dual);
    return;
  }
  const float* pivot = run.joints + run.entry_joints[begin];
  F4 w = Splat4(run.entry_weights[begin]);
  F4 q = Mul4(w, Load4(pivot)), d = Mul4(w, Load4(pivot + kDualPart));
  bool stretches = pivot[kStretches] != 0;
  for (Index e = begin + 1; e < end; ++e) {
    const float* m = run.joints + run.entry_joints[e];
    const float cosine = (pivot[0] * m[0] + pivot[1] * m[1]) + (pivot[2] * m[2] + pivot[3] * m[3]);
    w = Splat4(cosine < 0 ? -run.entry_weights[e] : run.entry_weights[e]);
    q = Fma4(w, Load4(m), q);
    d = Fma4(w, Load4(m + kDualPart), d);
    stretches |= m[kStretches] != 0;
  }
  Store4(q, rotation);
  Store4(d, dual);
  if (!stretches) return;
  const float* m = pivot + kStretch;
  w = Splat4(run.entry_weights[begin]);
  F4 c0 = Mul4(w, Load4(m)), c1 = Mul4(w, Load4(m + 4)), c2 = Mul4(w, Load4(m + 8)),
     c3 = Mul4(w, Load4(m + 12));
  for (Index e = begin + 1; e < end; ++e) {
    m = run.joints + run.entry_joints[e] + kStretch;
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
  alignas(64) float rotations[4 * DualQuaternionKernel::kBlock] = {};
  alignas(64) float duals[4 * DualQuaternionKernel::kBlock] = {};
  PackXyzw(in.x + begin, in.y + begin, in.z + begin, 0, count, 1.0f, points);
  for (std::size_t i = 0; i < count; ++i)
    BlendMotions(run, begin + i, rotations + 4 * i, duals + 4 * i, points + 4 * i);

  const bool plain = run.masks == nullptr && run.envelope == 1.0f;
  const VLanes one = hn::Set(d, 1.0f), two = hn::Set(d, 2.0f), tiny = hn::Set(d, 1e-12f);
  for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
    // Unit length, then p + 2 v x (v x p + w p) + 2 (w d - dw v + v x d)
    VLanes vx, vy, vz, vw, dx, dy, dz, dw, px, py, pz, pw;
    hn::LoadInterleaved4(d, rotations + 4 * i, vx, vy, vz, vw);
    hn::LoadInterleaved4(d, duals + 4 * i, dx, dy, dz, dw);
    hn::LoadInterleaved4(d, points + 4 * i, px, py, pz, pw);
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
    const VLanes x = hn::Load(d, in.x + begin + i), y = hn::Load(d, in.y + begin + i);
    const VLanes z = hn::Load(d, in.z + begin + i);
    const VLanes unmoved[3] = {x, y, z};
    float* to[3] = {out.x + begin + i, out.y + begin + i, out.z + begin + i};
    for (std::size_t r = 0; r < 3; ++r) {
      const VLanes origin = hn::Set(d, run.origin[r]);
      VLanes result = hn::Add(moved[r], origin);
      if (!plain) {
        const float* b = run.base + 4 * r;
        const VLanes turned =
            Fma(hn::Set(d, b[0]), x, Fma(hn::Set(d, b[1]), y, hn::Mul(hn::Set(d, b[2]), z)));
        const VLanes base = hn::Add(turned, hn::Set(d, b[3]));
        const VLanes blended = hn::IfThenElse(all, moved[r], Fma(w, hn::Sub(moved[r], base), base));
        const VLanes left =
            run.base_is_identity ? unmoved[r] : hn::Add(turned, hn::Set(d, run.base_offset[r]));
        result = hn::IfThenElse(none, left, hn::Add(blended, origin));
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

// The joint's entry in the scratch: rotation, dual part, stretch about its centre.
void WriteJoint(const Matrix4& m, Double3 center, const double origin[3], float* to) {
  constexpr double kRigid = 1e-6;
  Matrix4 stretch;
  double apart = Determinant3(m) < 0 ? 1 : 0;
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) {
      const double dot = m(0, r) * m(0, c) + m(1, r) * m(1, c) + m(2, r) * m(2, c);
      apart = std::max(apart, std::fabs(dot - (r == c ? 1.0 : 0.0)));
    }
  }
  const bool stretches = apart > 2 * kRigid;
  const Quaternion q = QuaternionFromRotation(stretches ? NearestRotation(m) : m);
  const Matrix4 rotation = RotationFromUnit(q);
  if (stretches) {
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c)
        stretch(r, c) = rotation(0, r) * m(0, c) + rotation(1, r) * m(1, c) + rotation(2, r) * m(2, c);
    }
    const Double3 shift = center - TransformVector(stretch, center);
    for (int r = 0; r < 3; ++r) stretch(r, 3) = shift[r];
  }
  const Double3 moved = TransformPoint(m, center) - TransformVector(rotation, center);
  const Quaternion t{0.5 * (moved.x - origin[0]), 0.5 * (moved.y - origin[1]), 0.5 * (moved.z - origin[2]),
                     0};
  const Quaternion dual = t * q;
  const double parts[8] = {q.x, q.y, q.z, q.w, dual.x, dual.y, dual.z, dual.w};
  for (std::size_t i = 0; i < 8; ++i) to[i] = static_cast<float>(parts[i]);
  for (int c = 0; c < 4; ++c) {
    float* column = to + kStretch + 4 * static_cast<std::size_t>(c);
    for (int r = 0; r < 3; ++r) column[r] = static_cast<float>(stretch(r, c));
    column[3] = 0;
  }
  to[kStretches] = stretches ? 1.0f : 0.0f;
}

}  // namespace

DualQuaternionKernel::DualQuaternionKernel(const SkinWeights& weights, std::span<const Index> out_points,
                                           std::span<const float> point_weights,
                                           std::span<const float> blend_weights)
    : count_(out_points.size()), joint_count_(weights.joint_count) {
  KPSA_CHECK(IsSortedSet(out_points, weights.point_count()));
  KPSA_CHECK(point_weights.empty() || point_weights.size() == count_);
  KPSA_CHECK(blend_weights.empty() || blend_weights.size() == count_);
  const auto wanted = [&](std::size_t i) { return blend_weights.empty() || blend_weights[i] != 0; };

  // The joints that occur, and their places in the run's palette
  std::vector<Index> place(joint_count_, kNoIndex);
  for (std::size_t i = 0; i < count_; ++i) {
    for (Index e = weights.offsets[out_points[i]]; e < weights.offsets[out_points[i] + 1]; ++e) {
      if (weights.weights[e] != 0 && wanted(i)) place[weights.joints[e]] = 0;
    }
  }
  for (Index j = 0; j < joint_count_; ++j) {
    if (place[j] != 0) continue;
    place[j] = static_cast<Index>(kJointFloats * joints_.size());
    joints_.push_back(j);
  }

  // Entries of each point, the largest weight first; a point without any keeps its base through a mask of 0
  std::vector<float> masks(point_weights.begin(), point_weights.end());
  entry_offsets_.push_back(0);
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
        entry_joints_.push_back(place[weights.joints[e]]);
        entry_weights_.push_back(static_cast<float>(weights.weights[e] * scale));
      };
      add(largest);
      for (Index e = begin; e < end; ++e) {
        if (weights.weights[e] != 0 && e != largest) add(e);
      }
    }
    entry_offsets_.push_back(static_cast<Index>(entry_joints_.size()));
  }
  if (!masks.empty()) masks_ = PaddedWeights(masks, count_);
  if (!blend_weights.empty()) blend_ = PaddedWeights(blend_weights, count_);
}

void DualQuaternionKernel::Run(const Inputs& inputs, ConstPointsView in, PointsView out,
                               std::span<float> scratch, const Parallel* parallel) const noexcept {
  KPSA_CHECK_EQ(inputs.palette.size(), joint_count_);
  KPSA_CHECK_EQ(inputs.centers.size(), joint_count_);
  KPSA_CHECK_EQ(in.count, count_);
  KPSA_CHECK_EQ(out.count, count_);
  KPSA_CHECK_LE(ScratchFloats(), scratch.size());
  KPSA_CHECK(blend_.size() == 0 || inputs.linear.count == count_);
  if (count_ == 0) return;

  DualRun run{};
  static_cast<SkinFrame&>(run) = SkinFrameOf(inputs.palette[0], inputs.world_from_mesh);
  const double origin[3] = {run.origin[0], run.origin[1], run.origin[2]};
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    WriteJoint(inputs.palette[joints_[j]], inputs.centers[joints_[j]], origin,
               scratch.data() + kJointFloats * j);
  }
  run.joints = scratch.data();
  run.envelope = static_cast<float>(inputs.envelope);
  run.masks = masks_.data();
  run.blend = blend_.data();
  run.linear[0] = inputs.linear.x, run.linear[1] = inputs.linear.y, run.linear[2] = inputs.linear.z;
  run.offsets = entry_offsets_.data();
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
