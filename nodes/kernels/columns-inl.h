// Sixteen floats in as few vectors as there are, on every target: four columns of x y z and a spare lane.
// Included once per target.
#if defined(KPSA_NODES_KERNELS_COLUMNS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef KPSA_NODES_KERNELS_COLUMNS_INL_H_
#undef KPSA_NODES_KERNELS_COLUMNS_INL_H_
#else
#define KPSA_NODES_KERNELS_COLUMNS_INL_H_
#endif

#include "nodes/kernels/xyzw-inl.h"

HWY_BEFORE_NAMESPACE();
namespace kpsa::engine {
namespace HWY_NAMESPACE {

constexpr std::size_t kParts = 16 / HWY_MIN(16, HWY_LANES(float));
struct M16 {
  VLanes part[kParts];
};

HWY_INLINE M16 LoadColumns(const float* columns) {
  const DLanes d;
  M16 m;
  for (std::size_t k = 0; k < kParts; ++k) m.part[k] = hn::Load(d, columns + k * hn::Lanes(d));
  return m;
}
HWY_INLINE void StoreColumns(const M16& m, float* columns) {
  const DLanes d;
  for (std::size_t k = 0; k < kParts; ++k) hn::Store(m.part[k], d, columns + k * hn::Lanes(d));
}
HWY_INLINE M16 MulColumns(const M16& a, const M16& b) {
  M16 m;
  for (std::size_t k = 0; k < kParts; ++k) m.part[k] = hn::Mul(a.part[k], b.part[k]);
  return m;
}
HWY_INLINE M16 SubColumns(const M16& a, const M16& b) {
  M16 m;
  for (std::size_t k = 0; k < kParts; ++k) m.part[k] = hn::Sub(a.part[k], b.part[k]);
  return m;
}
HWY_INLINE M16 FmaColumns(const M16& a, const M16& b, const M16& c) {
  M16 m;
  for (std::size_t k = 0; k < kParts; ++k) m.part[k] = Fma(a.part[k], b.part[k], c.part[k]);
  return m;
}
HWY_INLINE M16 SplatColumns(float a) {
  M16 m;
  for (std::size_t k = 0; k < kParts; ++k) m.part[k] = hn::Set(DLanes(), a);
  return m;
}
// Every column p: x y z w of p four times.
HWY_INLINE M16 RepeatColumns(const float* p) {
  const DLanes d;
  M16 m;
#if HWY_TARGET == HWY_SCALAR
  for (std::size_t k = 0; k < kParts; ++k) m.part[k] = hn::Set(d, p[k % 4]);
#else
  for (std::size_t k = 0; k < kParts; ++k) m.part[k] = hn::LoadDup128(d, p);
#endif
  return m;
}
// Column k is p[k] in all lanes.
HWY_INLINE M16 SpreadColumns(const float* p) {
  const DLanes d;
  M16 m;
#if HWY_MAX_BYTES >= 32
  HWY_ALIGN static constexpr std::int32_t kSpread[16] = {0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3};
  const VLanes repeated = hn::LoadDup128(d, p);
  for (std::size_t k = 0; k < kParts; ++k)
    m.part[k] = hn::TableLookupLanes(repeated, hn::SetTableIndices(d, kSpread + k * hn::Lanes(d)));
#else
  for (std::size_t k = 0; k < kParts; ++k) m.part[k] = hn::Set(d, p[k * hn::Lanes(d) / 4]);
#endif
  return m;
}
// The e-th of p in all lanes; four that lie together are loaded at once.
template <std::size_t e>
HWY_INLINE VLanes SplatOf(const float* p) {
  const DLanes d;
#if HWY_TARGET == HWY_SCALAR
  return hn::Set(d, p[e]);
#else
  return hn::Broadcast<e % 4>(hn::LoadDup128(d, p + e / 4 * 4));
#endif
}
template <std::size_t n, std::size_t e>
HWY_INLINE void AddBlended(const float* HWY_RESTRICT columns, const Index* HWY_RESTRICT entries,
                           const float* HWY_RESTRICT weights, M16* HWY_RESTRICT sum) {
  const M16 m = LoadColumns(columns + EntryOf<e, n>(entries));
  const VLanes w = SplatOf<e>(weights);
  for (std::size_t k = 0; k < kParts; ++k)
    sum->part[k] = e == 0 ? hn::Mul(w, m.part[k]) : Fma(w, m.part[k], sum->part[k]);
  if constexpr (e + 1 < n) AddBlended<n, e + 1>(columns, entries, weights, sum);
}
// The sum of weights[e] times the columns that begin at columns + entries[e], over n of these; 0: `size`, at
// least one. Weights are read by fours: three more than there are.
template <std::size_t n>
HWY_INLINE M16 BlendColumns(const float* HWY_RESTRICT columns, const Index* HWY_RESTRICT entries,
                            const float* HWY_RESTRICT weights, std::size_t size) {
  M16 sum;
  if constexpr (n != 0) {
    AddBlended<n, 0>(columns, entries, weights, &sum);
  } else {
    sum = MulColumns(SplatColumns(weights[0]), LoadColumns(columns + entries[0]));
    for (std::size_t e = 1; e < size; ++e)
      sum = FmaColumns(SplatColumns(weights[e]), LoadColumns(columns + entries[e]), sum);
  }
  return sum;
}
// The columns one by one.
HWY_INLINE void StoreApart(const M16& m, float* c0, float* c1, float* c2, float* c3) {
#if HWY_MAX_BYTES == 64
  const hn::Half<DLanes> dh;
  const auto low = hn::LowerHalf(dh, m.part[0]), high = hn::UpperHalf(dh, m.part[0]);
  Store4(hn::LowerHalf(D4(), low), c0);
  Store4(hn::UpperHalf(D4(), low), c1);
  Store4(hn::LowerHalf(D4(), high), c2);
  Store4(hn::UpperHalf(D4(), high), c3);
#elif HWY_MAX_BYTES == 32
  Store4(hn::LowerHalf(D4(), m.part[0]), c0);
  Store4(hn::UpperHalf(D4(), m.part[0]), c1);
  Store4(hn::LowerHalf(D4(), m.part[1]), c2);
  Store4(hn::UpperHalf(D4(), m.part[1]), c3);
#else
  float* to[4] = {c0, c1, c2, c3};
  const DLanes d;
  for (std::size_t k = 0; k < kParts; ++k)
    hn::Store(m.part[k], d, to[k * hn::Lanes(d) / 4] + k * hn::Lanes(d) % 4);
#endif
}

}  // namespace HWY_NAMESPACE
}  // namespace kpsa::engine
HWY_AFTER_NAMESPACE();

#endif  // include guard
