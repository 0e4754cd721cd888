#include "kpsa/rigid_points.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kpsa/rigid_points.cpp"
#include "hwy/foreach_target.h"

#include "base/simd-inl.h"

HWY_BEFORE_NAMESPACE();
namespace kpsa::engine {
namespace HWY_NAMESPACE {

void TransformAll(const float* m, PointsView p) {
  const hn::CappedTag<float, 16> d;
  using V = hn::Vec<decltype(d)>;
  V a[12];
  for (int i = 0; i < 12; ++i) a[i] = hn::Set(d, m[i]);
  for (std::size_t i = 0; i < p.count; i += hn::Lanes(d)) {  // the padding may be written
    const V x = hn::Load(d, p.x + i), y = hn::Load(d, p.y + i), z = hn::Load(d, p.z + i);
    hn::Store(Fma(a[0], x, Fma(a[3], y, Fma(a[6], z, a[9]))), d, p.x + i);
    hn::Store(Fma(a[1], x, Fma(a[4], y, Fma(a[7], z, a[10]))), d, p.y + i);
    hn::Store(Fma(a[2], x, Fma(a[5], y, Fma(a[8], z, a[11]))), d, p.z + i);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace kpsa::engine
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace kpsa::engine {

HWY_EXPORT(TransformAll);

FloatMatrix ToFloats(const Matrix4& matrix) {
  FloatMatrix m;
  for (int column = 0; column < 4; ++column) {
    for (int row = 0; row < 3; ++row)
      m[static_cast<std::size_t>(3 * column + row)] = static_cast<float>(matrix(row, column));
  }
  return m;
}

void TransformPoints(const FloatMatrix& matrix, PointsView points) {
  HWY_DYNAMIC_DISPATCH(TransformAll)(matrix.data(), points);
}

}  // namespace kpsa::engine
#endif
