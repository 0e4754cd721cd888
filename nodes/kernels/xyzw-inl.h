// Four floats that are one point (x y z and a spare lane), on every target; included once per target.
#if defined(KPSA_NODES_KERNELS_XYZW_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef KPSA_NODES_KERNELS_XYZW_INL_H_
#undef KPSA_NODES_KERNELS_XYZW_INL_H_
#else
#define KPSA_NODES_KERNELS_XYZW_INL_H_
#endif

#include <bit>
#include <cstdint>
#include <cstring>

#include "base/points.h"

#include "base/simd-inl.h"

HWY_BEFORE_NAMESPACE();
namespace kpsa::engine {
namespace HWY_NAMESPACE {

#if HWY_TARGET == HWY_SCALAR
struct F4 {
  float v[4];
};
HWY_INLINE F4 Zero4() { return {{0, 0, 0, 0}}; }
HWY_INLINE F4 Splat4(float a) { return {{a, a, a, a}}; }
HWY_INLINE F4 Load4(const float* p) { return {{p[0], p[1], p[2], p[3]}}; }
HWY_INLINE void Store4(F4 a, float* p) {
  for (int i = 0; i < 4; ++i) p[i] = a.v[i];
}
HWY_INLINE F4 Add4(F4 a, F4 b) {
  return {{a.v[0] + b.v[0], a.v[1] + b.v[1], a.v[2] + b.v[2], a.v[3] + b.v[3]}};
}
HWY_INLINE F4 Sub4(F4 a, F4 b) {
  return {{a.v[0] - b.v[0], a.v[1] - b.v[1], a.v[2] - b.v[2], a.v[3] - b.v[3]}};
}
HWY_INLINE F4 Mul4(F4 a, F4 b) {
  return {{a.v[0] * b.v[0], a.v[1] * b.v[1], a.v[2] * b.v[2], a.v[3] * b.v[3]}};
}
HWY_INLINE F4 Fma4(F4 a, F4 b, F4 c) {
  return {{std::fma(a.v[0], b.v[0], c.v[0]), std::fma(a.v[1], b.v[1], c.v[1]),
           std::fma(a.v[2], b.v[2], c.v[2]), std::fma(a.v[3], b.v[3], c.v[3])}};
}
HWY_INLINE F4 Neg4(F4 a) { return {{-a.v[0], -a.v[1], -a.v[2], -a.v[3]}}; }
HWY_INLINE F4 Yzx4(F4 a) { return {{a.v[1], a.v[2], a.v[0], a.v[3]}}; }
#else
using D4 = hn::FixedTag<float, 4>;
using F4 = hn::Vec<D4>;
HWY_INLINE F4 Zero4() { return hn::Zero(D4()); }
HWY_INLINE F4 Splat4(float a) { return hn::Set(D4(), a); }
HWY_INLINE F4 Load4(const float* p) { return hn::Load(D4(), p); }
HWY_INLINE void Store4(F4 a, float* p) { hn::Store(a, D4(), p); }
HWY_INLINE F4 Add4(F4 a, F4 b) { return hn::Add(a, b); }
HWY_INLINE F4 Sub4(F4 a, F4 b) { return hn::Sub(a, b); }
HWY_INLINE F4 Mul4(F4 a, F4 b) { return hn::Mul(a, b); }
HWY_INLINE F4 Fma4(F4 a, F4 b, F4 c) { return Fma(a, b, c); }
HWY_INLINE F4 Neg4(F4 a) { return hn::Neg(a); }
HWY_INLINE F4 Yzx4(F4 a) {
  HWY_ALIGN static constexpr std::int32_t kYzxw[4] = {1, 2, 0, 3};
  return hn::TableLookupLanes(a, hn::SetTableIndices(D4(), kYzxw));
}
#endif

// The e-th of n numbers. Two are loaded at once, since loads are what kernels that gather have to wait for.
template <std::size_t e, std::size_t n>
HWY_INLINE Index EntryOf(const Index* entries) {
  if constexpr (e % 2 == 0 && e + 1 == n) return entries[e];
  std::uint64_t two;
  std::memcpy(&two, entries + e / 2 * 2, sizeof(two));
  const bool low = (e % 2 == 0) == (std::endian::native == std::endian::little);
  return static_cast<Index>(low ? two : two >> 32);
}

// The e-th of p in all lanes; four that lie together are loaded at once.
template <std::size_t e>
HWY_INLINE F4 SplatOf4(const float* p) {
#if HWY_TARGET == HWY_SCALAR
  return Splat4(p[e]);
#else
  return hn::Broadcast<e % 4>(hn::LoadU(D4(), p + e / 4 * 4));
#endif
}

// a x b
HWY_INLINE F4 Cross4(F4 a, F4 b) { return Yzx4(Fma4(a, Yzx4(b), Neg4(Mul4(Yzx4(a), b)))); }

// Lanes of one block of points in structure-of-arrays form: at most 16, a divisor of 16.
using DLanes = hn::CappedTag<float, 16>;
using VLanes = hn::Vec<DLanes>;

// The points [begin, end) of x, y, z as xyzw with w = `spare`; begin a multiple of 16, writes whole vectors.
HWY_INLINE void PackXyzw(const float* x, const float* y, const float* z, std::size_t begin, std::size_t end,
                         float spare, float* xyzw) {
  const DLanes d;
  const VLanes w = hn::Set(d, spare);
  for (std::size_t i = begin; i < end; i += hn::Lanes(d)) {
    hn::StoreInterleaved4(hn::Load(d, x + i), hn::Load(d, y + i), hn::Load(d, z + i), w, d, xyzw + 4 * i);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace kpsa::engine
HWY_AFTER_NAMESPACE();

#endif  // include guard
