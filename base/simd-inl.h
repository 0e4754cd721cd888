// Per-target helpers; included once per target by kernel sources, after hwy/foreach_target.h.
// Fma(a, b, c) = a * b + c with one rounding on every target: hardware FMA where the target has it, otherwise
// std::fma lane by lane, so that all targets give the same bits.
#if defined(KPSA_BASE_SIMD_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef KPSA_BASE_SIMD_INL_H_
#undef KPSA_BASE_SIMD_INL_H_
#else
#define KPSA_BASE_SIMD_INL_H_
#endif

#include <cmath>

#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace kpsa::engine {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

#if HWY_TARGET == HWY_EMU128 || HWY_TARGET == HWY_SCALAR
template <class V>
HWY_INLINE V Fma(V a, V b, V c) {
  using D = hn::DFromV<V>;
  const D d;
  HWY_ALIGN float aa[HWY_MAX_BYTES / sizeof(float)], bb[HWY_MAX_BYTES / sizeof(float)],
      cc[HWY_MAX_BYTES / sizeof(float)];
  hn::Store(a, d, aa);
  hn::Store(b, d, bb);
  hn::Store(c, d, cc);
  for (std::size_t i = 0; i < hn::Lanes(d); ++i) cc[i] = std::fma(aa[i], bb[i], cc[i]);
  return hn::Load(d, cc);
}
#else
template <class V>
HWY_INLINE V Fma(V a, V b, V c) {
  return hn::MulAdd(a, b, c);
}
#endif

}  // namespace HWY_NAMESPACE
}  // namespace kpsa::engine
HWY_AFTER_NAMESPACE();

#endif  // include guard
