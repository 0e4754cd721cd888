#include "nodes/kernels/affine_delta.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nodes/kernels/affine_delta.cpp"
#include "hwy/foreach_target.h"

#include "nodes/kernels/xyzw-inl.h"

HWY_BEFORE_NAMESPACE();
namespace kpsa::engine {
namespace HWY_NAMESPACE {

void ApplyAffineDeltaLanes(const AffineDelta& delta, const float* weights, float envelope, ConstPointsView in,
                           PointsView out, std::size_t begin, std::size_t end) {
  const DLanes d;
  const VLanes envelopes = hn::Set(d, envelope), zero = hn::Zero(d);
  VLanes l[9];  // row-major
  for (std::size_t i = 0; i < 9; ++i) l[i] = hn::Set(d, delta.linear[4 * (i % 3) + i / 3]);
  const VLanes pivot_x = hn::Set(d, delta.pivot[0]), pivot_y = hn::Set(d, delta.pivot[1]);
  const VLanes pivot_z = hn::Set(d, delta.pivot[2]), offset_x = hn::Set(d, delta.offset[0]);
  const VLanes offset_y = hn::Set(d, delta.offset[1]), offset_z = hn::Set(d, delta.offset[2]);
  for (std::size_t i = begin; i < end; i += hn::Lanes(d)) {
    const VLanes w = weights == nullptr ? envelopes : hn::Mul(hn::Load(d, weights + i), envelopes);
    const auto moves = hn::Ne(w, zero);
    const VLanes x = hn::Load(d, in.x + i), y = hn::Load(d, in.y + i), z = hn::Load(d, in.z + i);
    const VLanes px = hn::Sub(x, pivot_x), py = hn::Sub(y, pivot_y), pz = hn::Sub(z, pivot_z);
    const VLanes dx = Fma(l[0], px, Fma(l[1], py, Fma(l[2], pz, offset_x)));
    const VLanes dy = Fma(l[3], px, Fma(l[4], py, Fma(l[5], pz, offset_y)));
    const VLanes dz = Fma(l[6], px, Fma(l[7], py, Fma(l[8], pz, offset_z)));
    hn::Store(hn::IfThenElse(moves, Fma(w, dx, x), x), d, out.x + i);
    hn::Store(hn::IfThenElse(moves, Fma(w, dy, y), y), d, out.y + i);
    hn::Store(hn::IfThenElse(moves, Fma(w, dz, z), z), d, out.z + i);
  }
}

void AddTurnedLanes(const float* linear, ConstPointsView from, ConstPointsView to, ConstPointsView in,
                    PointsView out, std::size_t begin, std::size_t end) {
  const DLanes d;
  const VLanes zero = hn::Zero(d);
  for (std::size_t i = begin; i < end; i += hn::Lanes(d)) {
    const VLanes dx = hn::Sub(hn::Load(d, to.x + i), hn::Load(d, from.x + i));
    const VLanes dy = hn::Sub(hn::Load(d, to.y + i), hn::Load(d, from.y + i));
    const VLanes dz = hn::Sub(hn::Load(d, to.z + i), hn::Load(d, from.z + i));
    const auto stays = hn::And(hn::Eq(dx, zero), hn::And(hn::Eq(dy, zero), hn::Eq(dz, zero)));
    const auto moved = [&](std::size_t row, VLanes p) HWY_ATTR {
      const VLanes along_x = hn::Set(d, linear[row]), along_y = hn::Set(d, linear[4 + row]);
      const VLanes sum = Fma(along_x, dx, Fma(along_y, dy, hn::Mul(hn::Set(d, linear[8 + row]), dz)));
      return hn::IfThenElse(stays, p, hn::Add(p, sum));
    };
    const VLanes x = hn::Load(d, in.x + i), y = hn::Load(d, in.y + i), z = hn::Load(d, in.z + i);
    hn::Store(moved(0, x), d, out.x + i);
    hn::Store(moved(1, y), d, out.y + i);
    hn::Store(moved(2, z), d, out.z + i);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace kpsa::engine
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace kpsa::engine {

HWY_EXPORT(ApplyAffineDeltaLanes);
HWY_EXPORT(AddTurnedLanes);

AffineDelta MakeAffineDelta(const Matrix4& matrix, Double3 pivot) {
  AffineDelta delta{};
  delta.is_zero = matrix == Matrix4();
  for (int i = 0; i < 3; ++i) {
    delta.pivot[i] = std::isfinite(pivot[i]) ? static_cast<float>(pivot[i]) : 0.0f;
  }
  const Double3 rounded{delta.pivot[0], delta.pivot[1], delta.pivot[2]};
  const Double3 moved = TransformPoint(matrix, rounded) - rounded;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      delta.linear[4 * column + row] = static_cast<float>(matrix(row, column) - (row == column ? 1.0 : 0.0));
    }
    delta.offset[row] = static_cast<float>(moved[row]);
  }
  return delta;
}

void ApplyAffineDelta(const AffineDelta& delta, const float* weights, float envelope, ConstPointsView in,
                      PointsView out, std::size_t begin, std::size_t end) noexcept {
  HWY_DYNAMIC_DISPATCH(ApplyAffineDeltaLanes)(delta, weights, envelope, in, out, begin, end);
}

void AddTurned(const float* linear, ConstPointsView from, ConstPointsView to, ConstPointsView in,
               PointsView out, std::size_t begin, std::size_t end) noexcept {
  HWY_DYNAMIC_DISPATCH(AddTurnedLanes)(linear, from, to, in, out, begin, end);
}

}  // namespace kpsa::engine
#endif  // HWY_ONCE
