// As many points of four floats (x y z and a spare lane) at once as a vector holds; included once per target.
#if defined(KPSA_NODES_KERNELS_BLOCKS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef KPSA_NODES_KERNELS_BLOCKS_INL_H_
#undef KPSA_NODES_KERNELS_BLOCKS_INL_H_
#else
#define KPSA_NODES_KERNELS_BLOCKS_INL_H_
#endif

#include "nodes/kernels/xyzw-inl.h"

HWY_BEFORE_NAMESPACE();
namespace kpsa::engine {
namespace HWY_NAMESPACE {

#if HWY_TARGET == HWY_SCALAR
constexpr std::size_t kBlocks = 1;
using Blocks = F4;
HWY_INLINE Blocks ZeroBlocks() { return Zero4(); }
HWY_INLINE Blocks LoadBlocks(const float* p) { return Load4(p); }
HWY_INLINE Blocks GatherBlocks(const float* p, const Index* at) { return Load4(p + at[0]); }
HWY_INLINE Blocks SubBlocks(Blocks a, Blocks b) { return Sub4(a, b); }
HWY_INLINE Blocks FmaBlocks(Blocks a, Blocks b, Blocks c) { return Fma4(a, b, c); }
HWY_INLINE Blocks YzxBlocks(Blocks a) { return Yzx4(a); }
template <int lane>
HWY_INLINE Blocks SplatInBlocks(Blocks a) {
  return Splat4(a.v[lane]);
}
HWY_INLINE Blocks WithSpare(Blocks a, Blocks spare) { return {{a.v[0], a.v[1], a.v[2], spare.v[3]}}; }
HWY_INLINE Blocks UnitBlocks(Blocks a) {
  const float length = std::sqrt((a.v[0] * a.v[0] + a.v[1] * a.v[1]) + (a.v[2] * a.v[2] + a.v[3] * a.v[3]));
  return Mul4(a, Splat4(length == 0 ? 1.0f : 1.0f / length));
}
HWY_INLINE void ScatterBlocks(Blocks a, float* to, std::size_t) { Store4(a, to); }
#else
constexpr std::size_t kBlocks = HWY_MIN(16, HWY_LANES(float)) / 4;
using Blocks = VLanes;
HWY_INLINE Blocks ZeroBlocks() { return hn::Zero(DLanes()); }
HWY_INLINE Blocks LoadBlocks(const float* p) { return hn::Load(DLanes(), p); }
// The points that begin at p + at[0], p + at[1], ..
HWY_INLINE Blocks GatherBlocks(const float* p, const Index* at) {
#if HWY_MAX_BYTES == 64
  const DLanes d;
  const hn::Half<DLanes> dh;
  return hn::Combine(d, hn::Combine(dh, Load4(p + EntryOf<3, 4>(at)), Load4(p + EntryOf<2, 4>(at))),
                     hn::Combine(dh, Load4(p + EntryOf<1, 4>(at)), Load4(p + EntryOf<0, 4>(at))));
#elif HWY_MAX_BYTES == 32
  return hn::Combine(DLanes(), Load4(p + EntryOf<1, 2>(at)), Load4(p + EntryOf<0, 2>(at)));
#else
  return Load4(p + at[0]);
#endif
}
HWY_INLINE Blocks SubBlocks(Blocks a, Blocks b) { return hn::Sub(a, b); }
HWY_INLINE Blocks FmaBlocks(Blocks a, Blocks b, Blocks c) { return Fma(a, b, c); }
HWY_INLINE Blocks YzxBlocks(Blocks a) {
  HWY_ALIGN static constexpr std::int32_t kYzxw[16] = {1, 2, 0, 3, 5, 6, 4, 7, 9, 10, 8, 11, 13, 14, 12, 15};
  return hn::TableLookupLanes(a, hn::SetTableIndices(DLanes(), kYzxw));
}
template <int lane>
HWY_INLINE Blocks SplatInBlocks(Blocks a) {
  return hn::Broadcast<lane>(a);
}
// a, its spare lanes taken from the other.
HWY_INLINE Blocks WithSpare(Blocks a, Blocks spare) {
  HWY_ALIGN static constexpr float kSpare[16] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  const DLanes d;
  return hn::IfThenElse(hn::Eq(hn::Load(d, kSpare), hn::Set(d, 1.0f)), spare, a);
}
// Of length 1; 0 stays 0, and what is not a number stays that. The spare lanes are 0.
HWY_INLINE Blocks UnitBlocks(Blocks a) {
  const DLanes d;
  const Blocks one = hn::Set(d, 1.0f), square = hn::Mul(a, a),
               pairs = hn::Add(square, hn::Shuffle2301(square));
  const Blocks length = hn::Sqrt(hn::Add(pairs, hn::Shuffle1032(pairs)));
  return hn::Mul(a, hn::IfThenElse(hn::Eq(length, hn::Zero(d)), one, hn::Div(one, length)));
}
// To `to`, `to` + stride, ..
HWY_INLINE void ScatterBlocks(Blocks a, float* to, std::size_t stride) {
#if HWY_MAX_BYTES == 64
  const hn::Half<DLanes> dh;
  const auto low = hn::LowerHalf(dh, a), high = hn::UpperHalf(dh, a);
  Store4(hn::LowerHalf(D4(), low), to);
  Store4(hn::UpperHalf(D4(), low), to + stride);
  Store4(hn::LowerHalf(D4(), high), to + 2 * stride);
  Store4(hn::UpperHalf(D4(), high), to + 3 * stride);
#elif HWY_MAX_BYTES == 32
  Store4(hn::LowerHalf(D4(), a), to);
  Store4(hn::UpperHalf(D4(), a), to + stride);
#else
  (void)stride;
  Store4(a, to);
#endif
}
#endif

}  // namespace HWY_NAMESPACE
}  // namespace kpsa::engine
HWY_AFTER_NAMESPACE();

#endif  // include guard
