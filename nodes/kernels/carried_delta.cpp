#include "nodes/kernels/carried_delta.h"

#include <cmath>
#include <cstdint>
#include <cstring>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nodes/kernels/carried_delta.cpp"
#include "hwy/foreach_target.h"

#include "base/simd-inl.h"

HWY_BEFORE_NAMESPACE();
namespace kpsa::engine {
namespace HWY_NAMESPACE {

// A column, or a row: GCC and Clang make as many vectors of it as the target asks for.
typedef double Four __attribute__((vector_size(32)));
typedef std::int64_t FourBits __attribute__((vector_size(32)));
typedef double Two __attribute__((vector_size(16)));

// c = a b, with sums in the order of the definition; b(row, column) = at(row, column).
template <typename At>
HWY_INLINE void Multiply(const Four (&a)[4], At at, Four (&c)[4]) {
  for (std::size_t k = 0; k < 4; ++k)
    c[k] = a[0] * at(0, k) + a[1] * at(1, k) + a[2] * at(2, k) + a[3] * at(3, k);
}
struct ByColumns {
  const double* m;
  HWY_INLINE double operator()(std::size_t row, std::size_t column) const { return m[4 * column + row]; }
};
// Row by row, columns 1 0 3 2.
struct ByTurnedRows {
  alignas(32) double m[16];
  HWY_INLINE double operator()(std::size_t row, std::size_t column) const {
    return m[4 * row + (column ^ 1)];
  }
};

// As base/matrix.h's Invert; the identity where there is none.
HWY_INLINE void Inverse(const Four (&m)[4], ByTurnedRows* inverse) {
  // 2x2 minors of the upper two rows and of the lower two
  Two minor[6];
  Four rows02[4], rows13[4];  // rows 0 2 1 3 and 1 3 0 2
  for (std::size_t c = 0; c < 4; ++c) {
    rows02[c] = __builtin_shufflevector(m[c], m[c], 0, 2, 1, 3);
    rows13[c] = __builtin_shufflevector(m[c], m[c], 1, 3, 0, 2);
  }
  for (std::size_t i = 0, at = 0; i < 4; ++i) {
    for (std::size_t j = i + 1; j < 4; ++j, ++at) {
      const Four products = rows02[i] * rows13[j];
      minor[at] = __builtin_shufflevector(products, products, 0, 1) -
                  __builtin_shufflevector(products, products, 2, 3);
    }
  }
  const double det = minor[0][0] * minor[5][1] - minor[1][0] * minor[4][1] + minor[2][0] * minor[3][1] +
                     minor[3][0] * minor[2][1] - minor[4][0] * minor[1][1] + minor[5][0] * minor[0][1];
  const double scale = 1 / det;
  if (det == 0 || !std::isfinite(det) || !std::isfinite(scale)) {
    for (std::size_t i = 0; i < 16; ++i) inverse->m[i] = i / 4 == (i % 4 ^ 1) ? 1 : 0;
    return;
  }
  Four k[6];
  for (std::size_t i = 0; i < 6; ++i) k[i] = __builtin_shufflevector(minor[i], minor[i], 1, 1, 0, 0);
  // Signs turn on the factors, which rounds nothing
  constexpr std::int64_t kSign = INT64_MIN;
  Four odd[4], even[4];
  for (std::size_t c = 0; c < 4; ++c) {
    odd[c] = reinterpret_cast<Four>(reinterpret_cast<FourBits>(m[c]) ^ FourBits{kSign, 0, kSign, 0});
    even[c] = reinterpret_cast<Four>(reinterpret_cast<FourBits>(m[c]) ^ FourBits{0, kSign, 0, kSign});
  }
  const Four rows[4] = {(odd[1] * k[5] - odd[2] * k[4] + odd[3] * k[3]) * scale,
                        (even[0] * k[5] - even[2] * k[2] + even[3] * k[1]) * scale,
                        (odd[0] * k[4] - odd[1] * k[2] + odd[3] * k[0]) * scale,
                        (even[0] * k[3] - even[1] * k[1] + even[2] * k[0]) * scale};
  std::memcpy(inverse->m, rows, sizeof(rows));
}

void FindDelta(const double* HWY_RESTRICT handle, const double* HWY_RESTRICT parent_from_handle,
               const double* HWY_RESTRICT parent, const double* HWY_RESTRICT parent_rest_inverse,
               double* HWY_RESTRICT delta, double* HWY_RESTRICT motion) {
  Four of_handle[4], of_parent[4], product[4], result[4];
  std::memcpy(of_handle, handle, sizeof(of_handle));
  std::memcpy(of_parent, parent, sizeof(of_parent));
  ByTurnedRows inverse;
  Inverse(of_parent, &inverse);
  Multiply(of_handle, ByColumns{parent_from_handle}, product);
  Multiply(of_parent, ByColumns{parent_rest_inverse}, result);
  std::memcpy(motion, result, sizeof(result));
  Multiply<const ByTurnedRows&>(product, inverse, result);
  std::memcpy(delta, result, sizeof(result));
}

}  // namespace HWY_NAMESPACE
}  // namespace kpsa::engine
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace kpsa::engine {

HWY_EXPORT(FindDelta);

void FindCarriedDelta(const Matrix4& handle, const Matrix4& parent_from_handle, const Matrix4& parent,
                      const Matrix4& parent_rest_inverse, CarriedDelta* result) noexcept {
  HWY_DYNAMIC_DISPATCH(FindDelta)
  (handle.m.data(), parent_from_handle.m.data(), parent.m.data(), parent_rest_inverse.m.data(),
   result->delta.m.data(), result->motion.m.data());
}

}  // namespace kpsa::engine
#endif  // HWY_ONCE
