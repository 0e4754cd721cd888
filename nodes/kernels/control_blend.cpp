#include "nodes/kernels/control_blend.h"

#include "base/check.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nodes/kernels/control_blend.cpp"
#include "hwy/foreach_target.h"

#include "nodes/kernels/xyzw-inl.h"

HWY_BEFORE_NAMESPACE();
namespace kpsa::engine {
namespace HWY_NAMESPACE {

template <std::size_t kWidth>  // 0: `width` at run time
HWY_INLINE void Blend(const Index* points, const Index* controls, const float* weights, std::size_t width,
                      std::size_t count, const float* offsets, PointsView out) {
  if constexpr (kWidth != 0) width = kWidth;
  for (std::size_t i = 0; i < count; ++i, controls += width, weights += width) {
    F4 sum = Mul4(Splat4(weights[0]), Load4(offsets + 4 * controls[0]));
    for (std::size_t c = 1; c < width; ++c)
      sum = Fma4(Splat4(weights[c]), Load4(offsets + 4 * controls[c]), sum);
    HWY_ALIGN float xyzw[4];
    Store4(sum, xyzw);
    const Index p = points[i];
    out.x[p] += xyzw[0];
    out.y[p] += xyzw[1];
    out.z[p] += xyzw[2];
  }
}

void BlendControls(const Index* points, const Index* controls, const float* weights, std::size_t width,
                   std::size_t count, const float* offsets, PointsView out) {
  switch (width) {
    case 2:
      return Blend<2>(points, controls, weights, width, count, offsets, out);
    case 4:
      return Blend<4>(points, controls, weights, width, count, offsets, out);
    case 8:
      return Blend<8>(points, controls, weights, width, count, offsets, out);
    default:
      return Blend<0>(points, controls, weights, width, count, offsets, out);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace kpsa::engine
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace kpsa::engine {

HWY_EXPORT(BlendControls);

ControlBlend::ControlBlend(std::size_t width, std::span<const Index> controls, std::span<const float> weights)
    : width_(width) {
  KPSA_CHECK(width > 0 && controls.size() == weights.size() && controls.size() % width == 0);
  for (std::size_t i = 0; i < controls.size() / width; ++i) {
    const auto row = weights.subspan(i * width, width);
    bool moves = false;
    for (float w : row) moves |= w != 0;
    if (!moves) continue;
    points_.push_back(static_cast<Index>(i));
    controls_.insert(controls_.end(), controls.begin() + i * width, controls.begin() + (i + 1) * width);
    weights_.insert(weights_.end(), row.begin(), row.end());
  }
}

void ControlBlend::Run(const float* offsets, PointsView points, const Parallel* parallel) const noexcept {
  ForRanges(parallel, points_.size(), 1024, [&](std::size_t begin, std::size_t end) {
    HWY_DYNAMIC_DISPATCH(BlendControls)
    (points_.data() + begin, controls_.data() + begin * width_, weights_.data() + begin * width_, width_,
     end - begin, offsets, points);
  });
}

}  // namespace kpsa::engine
#endif  // HWY_ONCE
