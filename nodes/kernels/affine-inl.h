// Affine matrices in double, a column of four rows at a time, with the same bits on every target (no fused
// multiply-add); included once per target. Last rows are taken as (0, 0, 0, 1): what lies in the fourth lane means
// nothing.
#if defined(KPSA_NODES_KERNELS_AFFINE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef KPSA_NODES_KERNELS_AFFINE_INL_H_
#undef KPSA_NODES_KERNELS_AFFINE_INL_H_
#else
#define KPSA_NODES_KERNELS_AFFINE_INL_H_
#endif

#include <cmath>
#include <cstring>

#include "base/matrix.h"

#include "base/simd-inl.h"

#pragma GCC diagnostic ignored "-Wpsabi"  // how vectors are passed: all of it is inlined

HWY_BEFORE_NAMESPACE();
namespace kpsa::engine {
namespace HWY_NAMESPACE {

// GCC and Clang make as many vectors of it as the target asks for.
typedef double Four __attribute__((vector_size(32)));
typedef float FourFloats __attribute__((vector_size(16)));

HWY_INLINE Four LoadFour(const double* from) {
  Four four;
  std::memcpy(&four, from, sizeof(four));
  return four;
}
HWY_INLINE Four FourOf(Double3 v) { return Four{v.x, v.y, v.z, 0}; }
// Rounded to floats.
HWY_INLINE void StoreFour(Four from, float* to) {
  const FourFloats floats = __builtin_convertvector(from, FourFloats);
  std::memcpy(to, &floats, sizeof(floats));
}
HWY_INLINE void StoreFour(Four from, double* to) { std::memcpy(to, &from, sizeof(from)); }

struct FourColumns {
  Four c[4];
};
HWY_INLINE FourColumns LoadColumns(const Matrix4& m) {
  return {{LoadFour(&m.m[0]), LoadFour(&m.m[4]), LoadFour(&m.m[8]), LoadFour(&m.m[12])}};
}
// m applied to the direction at v, and to the point there.
HWY_INLINE Four Turned(const FourColumns& m, const double* v) {
  return m.c[0] * v[0] + m.c[1] * v[1] + m.c[2] * v[2];
}
HWY_INLINE Four Placed(const FourColumns& m, const double* v) { return Turned(m, v) + m.c[3]; }
// a b; b lies column by column.
HWY_INLINE FourColumns Product(const FourColumns& a, const double* b) {
  return {{Turned(a, b), Turned(a, b + 4), Turned(a, b + 8), Placed(a, b + 12)}};
}

HWY_INLINE Four FourYzx(Four a) { return __builtin_shufflevector(a, a, 1, 2, 0, 3); }
HWY_INLINE Four FourCross(Four a, Four b) { return FourYzx(a * FourYzx(b) - FourYzx(a) * b); }
HWY_INLINE double FourDot(Four a, Four b) {
  const Four product = a * b;
  return product[0] + product[1] + product[2];
}
// The rows of the inverse of m's linear part; false, and those of the identity, where m has none.
HWY_INLINE bool InverseRows(const FourColumns& m, Four (&rows)[3]) {
  rows[0] = FourCross(m.c[1], m.c[2]);
  rows[1] = FourCross(m.c[2], m.c[0]);
  rows[2] = FourCross(m.c[0], m.c[1]);
  const double det = FourDot(m.c[0], rows[0]), scale = 1 / det;
  const double place = (m.c[3][0] + m.c[3][1] + m.c[3][2]) * 0;  // not a number where it is none
  const bool regular = det != 0 && std::isfinite(det + place) && std::isfinite(scale);
  if (!regular) [[unlikely]] {
    rows[0] = Four{1, 0, 0, 0}, rows[1] = Four{0, 1, 0, 0}, rows[2] = Four{0, 0, 1, 0};
    return false;
  }
  for (Four& row : rows) row *= scale;
  return true;
}

}  // namespace HWY_NAMESPACE
}  // namespace kpsa::engine
HWY_AFTER_NAMESPACE();

#endif  // include guard
