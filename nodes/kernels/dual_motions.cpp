#include "nodes/kernels/dual_motions.h"

#include <cmath>
#include <cstdint>
#include <cstring>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nodes/kernels/dual_motions.cpp"
#include "hwy/foreach_target.h"

#include "nodes/kernels/affine-inl.h"

HWY_BEFORE_NAMESPACE();
namespace kpsa::engine {
namespace HWY_NAMESPACE {

constexpr double kLeastStretch = 2e-6;  // of what is no rotation, of L^T L

// Here a vector holds one number of each of four joints.
struct JointLanes {
  Four x, y, z;
};
HWY_INLINE Four Dot(const JointLanes& a, const JointLanes& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
HWY_INLINE JointLanes Cross(const JointLanes& a, const JointLanes& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
HWY_INLINE Four LargerOf(Four a, Four b) { return b > a ? b : a; }
HWY_INLINE Four Magnitude(Four a) { return a < 0 ? -a : a; }
HWY_INLINE Four RootOf(Four a) {
  return Four{std::sqrt(a[0]), std::sqrt(a[1]), std::sqrt(a[2]), std::sqrt(a[3])};
}

template <typename V>
HWY_INLINE void Transpose(V (&v)[4]) {
  const V a = __builtin_shufflevector(v[0], v[1], 0, 4, 2, 6);
  const V b = __builtin_shufflevector(v[0], v[1], 1, 5, 3, 7);
  const V c = __builtin_shufflevector(v[2], v[3], 0, 4, 2, 6);
  const V d = __builtin_shufflevector(v[2], v[3], 1, 5, 3, 7);
  v[0] = __builtin_shufflevector(a, c, 0, 1, 4, 5);
  v[1] = __builtin_shufflevector(b, d, 0, 1, 4, 5);
  v[2] = __builtin_shufflevector(a, c, 2, 3, 6, 7);
  v[3] = __builtin_shufflevector(b, d, 2, 3, 6, 7);
}
// A motion: whole vectors, because what is stored in halves is slow to load as a whole.
typedef float EightFloats __attribute__((vector_size(32)));
HWY_INLINE EightFloats LoadMotion(const float* from) {
  EightFloats eight;
  std::memcpy(&eight, from, sizeof(eight));
  return eight;
}
HWY_INLINE void StoreMotion(EightFloats motion, float* to) { std::memcpy(to, &motion, sizeof(motion)); }
HWY_INLINE void StoreJoints(const Four (&rotation)[4], const Four (&dual)[4], float* to) {
  FourFloats a[4], b[4];
  for (std::size_t i = 0; i < 4; ++i) {
    a[i] = __builtin_convertvector(rotation[i], FourFloats);
    b[i] = __builtin_convertvector(dual[i], FourFloats);
  }
  Transpose(a);
  Transpose(b);
  for (std::size_t i = 0; i < 4; ++i)
    StoreMotion(__builtin_shufflevector(a[i], b[i], 0, 1, 2, 3, 4, 5, 6, 7), to + kMotionFloats * i);
}

// The unit quaternion of rotations with these columns. Of the four rows of 4 q q^T it is the one with the largest
// diagonal, made unit; the identity where there is none.
HWY_INLINE void QuaternionsOf(const JointLanes (&c)[4], Four (&q)[4]) {
  const Four one{1, 1, 1, 1}, zero{};
  const Four xx = c[0].x, yy = c[1].y, zz = c[2].z;
  const Four xy = c[0].y + c[1].x, xz = c[2].x + c[0].z, yz = c[1].z + c[2].y;
  const Four wx = c[1].z - c[2].y, wy = c[2].x - c[0].z, wz = c[0].y - c[1].x;
  const Four diagonal[4] = {one + xx - yy - zz, one - xx + yy - zz, one - xx - yy + zz, one + xx + yy + zz};
  const Four rows[4][4] = {{diagonal[0], xy, xz, wx},
                           {xy, diagonal[1], yz, wy},
                           {xz, yz, diagonal[2], wz},
                           {wx, wy, wz, diagonal[3]}};
  Four largest = diagonal[0];
  for (std::size_t i = 0; i < 4; ++i) q[i] = rows[0][i];
  for (std::size_t r = 1; r < 4; ++r) {
    const auto larger = diagonal[r] > largest;
    largest = larger ? diagonal[r] : largest;
    for (std::size_t i = 0; i < 4; ++i) q[i] = larger ? rows[r][i] : q[i];
  }
  const Four length = RootOf(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  const Four scale = one / length;
  const auto exists = (largest > zero) & (scale > zero);
  for (std::size_t i = 0; i < 4; ++i) q[i] = exists ? q[i] * scale : (i == 3 ? one : zero);
}

bool FourMotions(const JointMotions& joints, float* HWY_RESTRICT motions, float* HWY_RESTRICT stretches) {
  const std::size_t row = (joints.count + kJointGroup - 1) / kJointGroup * kJointGroup;
  bool any_stretches = false;
  for (std::size_t j = 0; j < joints.count; j += kJointGroup) {
    JointLanes c[4];
    for (std::size_t column = 0; column < 4; ++column) {
      Four v[4];
      for (std::size_t i = 0; i < 4; ++i)
        v[i] = LoadFour(joints.columns + 16 * HWY_MIN(j + i, joints.count - 1) + 4 * column);
      Transpose(v);
      c[column] = {v[0], v[1], v[2]};
    }
    const Four one{1, 1, 1, 1}, zero{};
    Four apart = Dot(c[0], Cross(c[1], c[2])) < zero ? one : zero;
    for (std::size_t a = 0; a < 3; ++a) {
      apart = LargerOf(apart, Magnitude(Dot(c[a], c[a]) - one));
      apart = LargerOf(apart, Magnitude(Dot(c[a], c[(a + 1) % 3])));
    }
    Four q[4];
    QuaternionsOf(c, q);

    // Half of where the centre goes, less where the rotation takes it
    const JointLanes center{LoadFour(joints.centers + j), LoadFour(joints.centers + row + j),
                            LoadFour(joints.centers + 2 * row + j)};
    const JointLanes axis{q[0], q[1], q[2]};
    JointLanes arm = Cross(axis, center);
    arm = Cross(axis, {arm.x + q[3] * center.x, arm.y + q[3] * center.y, arm.z + q[3] * center.z});
    const auto half = [&](Four own, Four turned, Four x, Four y, Four z, Four place) HWY_ATTR {
      return 0.5 * (place + (x * center.x + y * center.y + z * center.z - own)) - turned;
    };
    const JointLanes t{half(center.x, arm.x, c[0].x, c[1].x, c[2].x, c[3].x),
                       half(center.y, arm.y, c[0].y, c[1].y, c[2].y, c[3].y),
                       half(center.z, arm.z, c[0].z, c[1].z, c[2].z, c[3].z)};
    const JointLanes crossed = Cross(t, axis);
    const Four dual[4] = {q[3] * t.x + crossed.x, q[3] * t.y + crossed.y, q[3] * t.z + crossed.z,
                          -Dot(t, axis)};
    StoreJoints(q, dual, motions + kMotionFloats * j);
    for (std::size_t i = 0; i < kJointGroup && j + i < joints.count; ++i) {
      const bool does = apart[i] > kLeastStretch;
      stretches[kStretchFloats * (j + i + 1) - 1] = does ? 1.0f : 0.0f;
      any_stretches |= does;
    }
  }
  return any_stretches;
}

void TurnedMotions(const MotionPair* HWY_RESTRICT pairs, std::size_t count, const float* HWY_RESTRICT motions,
                   float* HWY_RESTRICT turned) {
  typedef std::int32_t Bits __attribute__((vector_size(32)));
  const Bits sign = Bits{} + INT32_MIN;
  const auto rotation = [](EightFloats motion) HWY_ATTR {
    return __builtin_shufflevector(motion, motion, 0, 1, 2, 3, 0, 1, 2, 3);
  };
  for (std::size_t i = 0; i < count; ++i, turned += kMotionFloats) {
    const EightFloats motion = LoadMotion(motions + kMotionFloats * pairs[i].joint);
    EightFloats cosine = rotation(LoadMotion(motions + kMotionFloats * pairs[i].pivot)) * rotation(motion);
    cosine += __builtin_shufflevector(cosine, cosine, 1, 0, 3, 2, 5, 4, 7, 6);
    cosine += __builtin_shufflevector(cosine, cosine, 2, 3, 0, 1, 6, 7, 4, 5);
    const Bits turns = (cosine < 0) & sign;
    StoreMotion(reinterpret_cast<EightFloats>(reinterpret_cast<Bits>(motion) ^ turns), turned);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace kpsa::engine
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace kpsa::engine {

HWY_EXPORT(FourMotions);
HWY_EXPORT(TurnedMotions);

bool FindMotions(const JointMotions& joints, float* motions, float* stretches) noexcept {
  return HWY_DYNAMIC_DISPATCH(FourMotions)(joints, motions, stretches);
}
void TurnMotions(const MotionPair* pairs, std::size_t count, const float* motions, float* turned) noexcept {
  HWY_DYNAMIC_DISPATCH(TurnedMotions)(pairs, count, motions, turned);
}

}  // namespace kpsa::engine
#endif  // HWY_ONCE
