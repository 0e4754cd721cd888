// The sine of lanes of floats, with the same bits on every target; included once per target.
#if defined(KPSA_NODES_KERNELS_SINE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef KPSA_NODES_KERNELS_SINE_INL_H_
#undef KPSA_NODES_KERNELS_SINE_INL_H_
#else
#define KPSA_NODES_KERNELS_SINE_INL_H_
#endif

#include "nodes/kernels/xyzw-inl.h"

HWY_BEFORE_NAMESPACE();
namespace kpsa::engine {
namespace HWY_NAMESPACE {

// sin(pi h), within 1.5 ulp of the sine of these very h; 0 from 2^22 half turns on, where floats have no
// fractions to speak of. What is not a number stays that.
HWY_INLINE VLanes SinHalfTurns(VLanes h) {
  const DLanes d;
  const hn::RebindToUnsigned<DLanes> bits;
  h = hn::IfThenZeroElse(hn::Ge(hn::Abs(h), hn::Set(d, 4194304.0f)), h);
  // Adding 1.5 * 2^23 rounds to whole half turns; their lowest bit is the sign of the sine
  const VLanes whole = hn::Set(d, 12582912.0f), shifted = hn::Add(h, whole);
  const VLanes r = hn::Sub(h, hn::Sub(shifted, whole)), q = hn::Mul(r, r);
  // sin(pi r) / r - float(pi) on [-1/2, 1/2]: the least largest error, 1.7e-8 of the sine
  VLanes s = Fma(q, hn::Set(d, 0.07854324579238892f), hn::Set(d, -0.5987061858177185f));
  s = Fma(q, s, hn::Set(d, 2.5501363277435303f));
  s = Fma(q, s, hn::Set(d, -5.167712688446045f));
  s = Fma(q, s, hn::Set(d, -8.742278e-8f));
  s = Fma(r, hn::Set(d, 3.14159274f), hn::Mul(r, s));
  return hn::BitCast(d, hn::Xor(hn::BitCast(bits, s), hn::ShiftLeft<31>(hn::BitCast(bits, shifted))));
}

// 1 - cos(pi h), with as many digits where it is small.
HWY_INLINE VLanes VersineHalfTurns(VLanes h) {
  const DLanes d;
  const VLanes half = SinHalfTurns(hn::Mul(h, hn::Set(d, 0.5f)));
  return hn::Mul(hn::Add(half, half), half);
}

}  // namespace HWY_NAMESPACE
}  // namespace kpsa::engine
HWY_AFTER_NAMESPACE();

#endif  // include guard
