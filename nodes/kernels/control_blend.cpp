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

bool PackLanes(ConstPointsView offsets, const float* turn, float envelope, float* packed) {
  const DLanes d;
  const VLanes share = hn::Set(d, envelope), zero = hn::Zero(d);
  std::size_t moving = 0;
  for (std::size_t i = 0; i < offsets.count; i += hn::Lanes(d)) {
    VLanes x = hn::Load(d, offsets.x + i), y = hn::Load(d, offsets.y + i), z = hn::Load(d, offsets.z + i);
    if (turn != nullptr) {
      const auto row = [&](const float* m) HWY_ATTR {
        return Fma(hn::Set(d, m[0]), x, Fma(hn::Set(d, m[3]), y, hn::Mul(hn::Set(d, m[6]), z)));
      };
      const VLanes turned_x = row(turn), turned_y = row(turn + 1);
      z = row(turn + 2), x = turned_x, y = turned_y;
    }
    x = hn::Mul(x, share), y = hn::Mul(y, share), z = hn::Mul(z, share);
    const auto rests = hn::And(hn::Eq(x, zero), hn::And(hn::Eq(y, zero), hn::Eq(z, zero)));
    moving += hn::CountTrue(d, hn::AndNot(rests, hn::FirstN(d, offsets.count - i)));
    hn::StoreInterleaved4(x, y, z, zero, d, packed + 4 * i);
  }
  return moving != 0;
}

}  // namespace HWY_NAMESPACE
}  // namespace kpsa::engine
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace kpsa::engine {

HWY_EXPORT(BlendControls);
HWY_EXPORT(PackLanes);

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

bool PackOffsets(ConstPointsView offsets, const Matrix4* turn, double envelope, float* packed) noexcept {
  float linear[9];  // columns
  for (std::size_t k = 0; turn != nullptr && k < 9; ++k)
    linear[k] = static_cast<float>(turn->m[k / 3 * 4 + k % 3]);
  return HWY_DYNAMIC_DISPATCH(PackLanes)(offsets, turn == nullptr ? nullptr : linear,
                                         static_cast<float>(envelope), packed);
}

}  // namespace kpsa::engine
#endif  // HWY_ONCE
