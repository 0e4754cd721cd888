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

// Half of them in a vector at most: where one holds all, taking the columns apart again costs more than that
// saves (skins of four influences: 3.1 instead of 2.6 ns a point).
using DColumns = hn::CappedTag<float, 8>;
struct Columns {
  hn::Vec<DColumns> part[16 / hn::MaxLanes(DColumns())];
};

// The e-th of p in all lanes; four that lie together are loaded at once.
template <std::size_t e>
HWY_INLINE hn::Vec<DColumns> SplatOf(const float* p) {
#if HWY_TARGET == HWY_SCALAR
  return hn::Set(DColumns(), p[e]);
#else
  return hn::Broadcast<e % 4>(hn::LoadDup128(DColumns(), p + e / 4 * 4));
#endif
}

HWY_INLINE void AddColumns(const float* columns, hn::Vec<DColumns> weight, bool first, Columns* sum) {
  const DColumns d;
  std::size_t at = 0;
  for (auto& part : sum->part) {
    const auto column = hn::Load(d, columns + at);
    part = first ? hn::Mul(weight, column) : Fma(weight, column, part);
    at += hn::Lanes(d);
  }
}
template <std::size_t n, std::size_t e>
HWY_INLINE void AddBlended(const float* HWY_RESTRICT columns, const Index* HWY_RESTRICT entries,
                           const float* HWY_RESTRICT weights, Columns* HWY_RESTRICT sum) {
  AddColumns(columns + EntryOf<e, n>(entries), SplatOf<e>(weights), e == 0, sum);
  if constexpr (e + 1 < n) AddBlended<n, e + 1>(columns, entries, weights, sum);
}
// The same of many: the e-th goes to the (e % 4)-th of four sums, so that none waits for the one before it.
HWY_INLINE Columns BlendMany(const float* HWY_RESTRICT columns, const Index* HWY_RESTRICT entries,
                             const float* HWY_RESTRICT weights, std::size_t size) {
  Columns a, b, c, d;
  AddColumns(columns + EntryOf<0, 4>(entries), SplatOf<0>(weights), true, &a);
  AddColumns(columns + EntryOf<1, 4>(entries), SplatOf<1>(weights), true, &b);
  AddColumns(columns + EntryOf<2, 4>(entries), SplatOf<2>(weights), true, &c);
  AddColumns(columns + EntryOf<3, 4>(entries), SplatOf<3>(weights), true, &d);
  std::size_t e = 4;
  for (; e + 4 <= size; e += 4) {
    AddColumns(columns + EntryOf<0, 4>(entries + e), SplatOf<0>(weights + e), false, &a);
    AddColumns(columns + EntryOf<1, 4>(entries + e), SplatOf<1>(weights + e), false, &b);
    AddColumns(columns + EntryOf<2, 4>(entries + e), SplatOf<2>(weights + e), false, &c);
    AddColumns(columns + EntryOf<3, 4>(entries + e), SplatOf<3>(weights + e), false, &d);
  }
  if (e < size) AddColumns(columns + entries[e], SplatOf<0>(weights + e), false, &a);
  if (e + 1 < size) AddColumns(columns + entries[e + 1], SplatOf<1>(weights + e), false, &b);
  if (e + 2 < size) AddColumns(columns + entries[e + 2], SplatOf<2>(weights + e), false, &c);
  for (std::size_t k = 0; k < sizeof(a.part) / sizeof(a.part[0]); ++k)
    a.part[k] = hn::Add(hn::Add(a.part[k], b.part[k]), hn::Add(c.part[k], d.part[k]));
  return a;
}
// The sum of weights[e] times the columns that begin at columns + entries[e], over n of these; 0: `size`, at
// least one. Weights are read by fours: up to three more than there are.
template <std::size_t n>
HWY_INLINE Columns BlendColumns(const float* HWY_RESTRICT columns, const Index* HWY_RESTRICT entries,
                                const float* HWY_RESTRICT weights, std::size_t size) {
  Columns sum;
  if constexpr (n != 0) {
    AddBlended<n, 0>(columns, entries, weights, &sum);
  } else {
    if (size >= 4) return BlendMany(columns, entries, weights, size);
    for (std::size_t e = 0; e < size; ++e)
      AddColumns(columns + entries[e], hn::Set(DColumns(), weights[e]), e == 0, &sum);
  }
  return sum;
}

// The columns one by one.
HWY_INLINE void StoreApart(const Columns& m, float* c0, float* c1, float* c2, float* c3) {
#if HWY_MAX_BYTES >= 32
  Store4(hn::LowerHalf(D4(), m.part[0]), c0);
  Store4(hn::UpperHalf(D4(), m.part[0]), c1);
  Store4(hn::LowerHalf(D4(), m.part[1]), c2);
  Store4(hn::UpperHalf(D4(), m.part[1]), c3);
#else
  const DColumns d;
  float* const to[4] = {c0, c1, c2, c3};
  for (std::size_t at = 0; at < 16; at += hn::Lanes(d))
    hn::Store(m.part[at / hn::Lanes(d)], d, to[at / 4] + at % 4);
#endif
}

}  // namespace HWY_NAMESPACE
}  // namespace kpsa::engine
HWY_AFTER_NAMESPACE();

#endif  // include guard
