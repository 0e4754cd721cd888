#include "nodes/kernels/wrap_run.h"

#include <cmath>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nodes/kernels/wrap_run.cpp"
#include "hwy/foreach_target.h"

#include "nodes/kernels/columns-inl.h"

HWY_BEFORE_NAMESPACE();
namespace kpsa::engine {
namespace HWY_NAMESPACE {

constexpr float kFoldedSquare = 1e-10f;  // of the tangents' lengths, squared

void PackDriver(ConstPointsView points, std::size_t begin, std::size_t end, float* driver) {
  PackXyzw(points.x, points.y, points.z, begin, end, 0.0f, driver);
}

struct Lanes3 {
  VLanes x, y, z;
};
HWY_INLINE VLanes Dot3(const Lanes3& a, const Lanes3& b) {
  return Fma(a.x, b.x, Fma(a.y, b.y, hn::Mul(a.z, b.z)));
}
HWY_INLINE Lanes3 Cross3(const Lanes3& a, const Lanes3& b) {
  return {Fma(a.y, b.z, hn::Neg(hn::Mul(a.z, b.y))), Fma(a.z, b.x, hn::Neg(hn::Mul(a.x, b.z))),
          Fma(a.x, b.y, hn::Neg(hn::Mul(a.y, b.x)))};
}
HWY_INLINE Lanes3 Scaled3(const Lanes3& a, VLanes s) {
  return {hn::Mul(a.x, s), hn::Mul(a.y, s), hn::Mul(a.z, s)};
}
HWY_INLINE Lanes3 Sub3(const Lanes3& a, const Lanes3& b) {
  return {hn::Sub(a.x, b.x), hn::Sub(a.y, b.y), hn::Sub(a.z, b.z)};
}
HWY_INLINE Lanes3 Load3(const float* rows, std::size_t row) {
  const DLanes d;
  return {hn::Load(d, rows), hn::Load(d, rows + row), hn::Load(d, rows + 2 * row)};
}
HWY_INLINE void Store3(const Lanes3& a, float* rows, std::size_t row) {
  const DLanes d;
  hn::Store(a.x, d, rows);
  hn::Store(a.y, d, rows + row);
  hn::Store(a.z, d, rows + 2 * row);
}

// Sums over influences, of a block of points: of the frames, column by column. Their spare lanes hold the
// anchor's x, y and z.
struct WrapSums {
  alignas(64) float x[4 * kWrapBlock], y[4 * kWrapBlock], z[4 * kWrapBlock], normals[4 * kWrapBlock];
};

// `count` points of n influences each; 0: `size`.
template <std::size_t n>
HWY_INLINE void SumGroup(const Index* HWY_RESTRICT entries, const float* HWY_RESTRICT shares,
                         std::size_t size, std::size_t count, const float* HWY_RESTRICT frames, std::size_t k,
                         WrapSums* HWY_RESTRICT sums) {
  if constexpr (n != 0) size = n;
  for (const std::size_t end = k + count; k < end; ++k, entries += size, shares += size) {
    const Columns sum = BlendColumns<n>(frames, entries, shares, size);
    StoreApart(sum, sums->x + 4 * k, sums->y + 4 * k, sums->z + 4 * k, sums->normals + 4 * k);
  }
}

HWY_INLINE void SumFrames(const WrapRun& run, const float* frames, std::size_t begin, std::size_t size,
                          WrapSums* sums) {
  const Index* offsets = run.offsets + begin;
  for (std::size_t k = 0; k < size;) {
    const Index row = offsets[k + 1] - offsets[k];
    std::size_t end = k + 1;
    while (end < size && offsets[end + 1] - offsets[end] == row) ++end;
    const Index* entries = run.entries + offsets[k];
    const float* shares = run.shares + offsets[k];
    switch (row) {  // loops without a branch to mispredict
      case 0:
        for (std::size_t i = k; i < end; ++i)
          for (float* column : {sums->x, sums->y, sums->z, sums->normals}) Store4(Zero4(), column + 4 * i);
        break;
      case 2:
        SumGroup<2>(entries, shares, row, end - k, frames, k, sums);
        break;
      case 3:
        SumGroup<3>(entries, shares, row, end - k, frames, k, sums);
        break;
      case 8:
        SumGroup<8>(entries, shares, row, end - k, frames, k, sums);
        break;
      default:
        SumGroup<0>(entries, shares, row, end - k, frames, k, sums);
        break;
    }
    k = end;
  }
  for (std::size_t k = size; k % 16 != 0; ++k)  // what fills the last vector
    for (float* column : {sums->x, sums->y, sums->z, sums->normals}) Store4(Zero4(), column + 4 * k);
}
HWY_INLINE void SumAnchors(const WrapRun& run, const float* HWY_RESTRICT driver, std::size_t begin,
                           std::size_t size, float* HWY_RESTRICT anchors) {
  for (std::size_t k = 0; k < size; ++k) {
    F4 anchor = Zero4();
    for (Index e = run.offsets[begin + k]; e < run.offsets[begin + k + 1]; ++e)
      anchor = Fma4(Splat4(run.shares[e]), Load4(driver + run.entries[e]), anchor);
    Store4(anchor, anchors + 4 * k);
  }
}

// The anchor of the sums at `at`, of point i, and its frame: whether it exists, and then its axes.
HWY_INLINE auto FrameOf(const WrapRun& run, const WrapSums& sums, std::size_t at, std::size_t i,
                        Lanes3* anchor, Lanes3* t, Lanes3* b, Lanes3* n) {
  const DLanes d;
  const VLanes folded = hn::Set(d, kFoldedSquare), one = hn::Set(d, 1.0f);
  Lanes3 x, y, z;
  VLanes spare;
  hn::LoadInterleaved4(d, sums.x + 4 * at, x.x, x.y, x.z, anchor->x);
  hn::LoadInterleaved4(d, sums.y + 4 * at, y.x, y.y, y.z, anchor->y);
  hn::LoadInterleaved4(d, sums.z + 4 * at, z.x, z.y, z.z, anchor->z);
  hn::LoadInterleaved4(d, sums.normals + 4 * at, n->x, n->y, n->z, spare);
  const auto carried = [&](const Lanes3& along) HWY_ATTR {
    return Lanes3{Fma(x.x, along.x, Fma(y.x, along.y, hn::Mul(z.x, along.z))),
                  Fma(x.y, along.x, Fma(y.y, along.y, hn::Mul(z.y, along.z))),
                  Fma(x.z, along.x, Fma(y.z, along.y, hn::Mul(z.z, along.z)))};
  };
  *t = carried(Load3(run.directions + i, run.row));
  *b = carried(Load3(run.directions + i + 3 * run.row, run.row));
  const VLanes tt = Dot3(*t, *t), bb = Dot3(*b, *b), nn = Dot3(*n, *n);
  // Not "nn > ...": what is not a number must come out as such
  auto exists = hn::Not(hn::Or(hn::Le(nn, folded), hn::Le(hn::Add(tt, bb), hn::Zero(d))));
  *n = Scaled3(*n, hn::Div(one, hn::Sqrt(nn)));
  if (run.stretches) return exists;
  // The rotation in the plane across n that is nearest to (t, b)
  const VLanes nt = hn::Neg(Dot3(*n, *t));
  const Lanes3 turned_b = Cross3(*b, *n);
  const Lanes3 turned{hn::Add(Fma(n->x, nt, t->x), turned_b.x), hn::Add(Fma(n->y, nt, t->y), turned_b.y),
                      hn::Add(Fma(n->z, nt, t->z), turned_b.z)};
  const VLanes square = Dot3(turned, turned);
  exists = hn::And(exists, hn::Not(hn::Le(square, hn::Mul(folded, hn::Add(tt, bb)))));
  *t = Scaled3(turned, hn::Div(one, hn::Sqrt(square)));
  *b = Cross3(*n, *t);
  return exists;
}

void Places(const WrapRun& run, const float* frames, std::size_t begin, std::size_t end, float* places) {
  const DLanes d;
  WrapSums sums;
  for (std::size_t i = begin; i < end; i += hn::Lanes(d)) {
    const std::size_t at = (i - begin) % kWrapBlock;
    if (at == 0) SumFrames(run, frames, i, HWY_MIN(kWrapBlock, end - i), &sums);
    Lanes3 anchor, t, b, n;
    const auto exists = FrameOf(run, sums, at, i, &anchor, &t, &b, &n);
    float* to = places + i;
    Store3(anchor, to, run.row);
    Store3(t, to + 3 * run.row, run.row);
    Store3(b, to + 6 * run.row, run.row);
    Store3(n, to + 9 * run.row, run.row);
    hn::Store(hn::IfThenElseZero(exists, hn::Set(d, 1.0f)), d, to + 12 * run.row);
  }
}

HWY_INLINE void StoreMoved(const WrapRun& run, const Lanes3& p, const Lanes3& move, std::size_t i,
                           PointsView out) {
  const DLanes d;
  const VLanes w = hn::Mul(hn::Load(d, run.weights + i), hn::Set(d, run.envelope));
  const auto stays = hn::Eq(w, hn::Zero(d));
  hn::Store(hn::IfThenElse(stays, p.x, Fma(w, move.x, p.x)), d, out.x + i);
  hn::Store(hn::IfThenElse(stays, p.y, Fma(w, move.y, p.y)), d, out.y + i);
  hn::Store(hn::IfThenElse(stays, p.z, Fma(w, move.z, p.z)), d, out.z + i);
}

// Goals as moves from where the point would be at rest: what rests stays, to the bit.
void Wrap(const WrapRun& run, const float* frames, ConstPointsView in, PointsView out, std::size_t begin,
          std::size_t end) {
  const DLanes d;
  const std::size_t row = run.row;
  WrapSums sums;
  for (std::size_t i = begin; i < end; i += hn::Lanes(d)) {
    const std::size_t at = (i - begin) % kWrapBlock;
    if (at == 0) SumFrames(run, frames, i, HWY_MIN(kWrapBlock, end - i), &sums);
    const Lanes3 p{hn::Load(d, in.x + i), hn::Load(d, in.y + i), hn::Load(d, in.z + i)};
    Lanes3 anchor, t, b, n;
    auto turns = FrameOf(run, sums, at, i, &anchor, &t, &b, &n);
    const float* rest = run.rest + i;
    const Lanes3 rest_anchor = Load3(rest, row), rest_t = Load3(rest + 3 * row, row),
                 rest_b = Load3(rest + 6 * row, row), rest_n = Load3(rest + 9 * row, row);
    turns = hn::And(turns, hn::Gt(hn::Load(d, rest + 12 * row), hn::Zero(d)));
    const Lanes3 offset = Sub3(p, rest_anchor);
    const VLanes along_t = hn::IfThenElseZero(turns, Dot3(rest_t, offset));
    const VLanes along_b = hn::IfThenElseZero(turns, Dot3(rest_b, offset));
    const VLanes along_n = hn::IfThenElseZero(turns, Dot3(rest_n, offset));
    const auto axis = [&](VLanes now, VLanes then)
                          HWY_ATTR { return hn::IfThenElseZero(turns, hn::Sub(now, then)); };
    Lanes3 move = Sub3(anchor, rest_anchor);
    move.x = Fma(axis(t.x, rest_t.x), along_t,
                 Fma(axis(b.x, rest_b.x), along_b, Fma(axis(n.x, rest_n.x), along_n, move.x)));
    move.y = Fma(axis(t.y, rest_t.y), along_t,
                 Fma(axis(b.y, rest_b.y), along_b, Fma(axis(n.y, rest_n.y), along_n, move.y)));
    move.z = Fma(axis(t.z, rest_t.z), along_t,
                 Fma(axis(b.z, rest_b.z), along_b, Fma(axis(n.z, rest_n.z), along_n, move.z)));
    StoreMoved(run, p, move, i, out);
  }
}

void Snap(const WrapRun& run, const float* driver, ConstPointsView in, PointsView out, std::size_t begin,
          std::size_t end) {
  const DLanes d;
  alignas(64) float anchors[4 * kWrapBlock] = {};
  for (std::size_t i = begin; i < end; i += hn::Lanes(d)) {
    const std::size_t at = (i - begin) % kWrapBlock;
    if (at == 0) SumAnchors(run, driver, i, HWY_MIN(kWrapBlock, end - i), anchors);
    Lanes3 anchor;
    VLanes spare;
    hn::LoadInterleaved4(d, anchors + 4 * at, anchor.x, anchor.y, anchor.z, spare);
    const Lanes3 p{hn::Load(d, in.x + i), hn::Load(d, in.y + i), hn::Load(d, in.z + i)};
    StoreMoved(run, p, Sub3(anchor, p), i, out);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace kpsa::engine
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace kpsa::engine {

HWY_EXPORT(PackDriver);
HWY_EXPORT(Places);
HWY_EXPORT(Wrap);
HWY_EXPORT(Snap);

void PackWrapDriver(ConstPointsView points, std::size_t begin, std::size_t end, float* driver) noexcept {
  HWY_DYNAMIC_DISPATCH(PackDriver)(points, begin, end, driver);
}
void FindWrapPlaces(const WrapRun& run, const float* frames, std::size_t begin, std::size_t end,
                    float* places) noexcept {
  HWY_DYNAMIC_DISPATCH(Places)(run, frames, begin, end, places);
}
void RunWrap(const WrapRun& run, const float* frames, ConstPointsView in, PointsView out, std::size_t begin,
             std::size_t end) noexcept {
  HWY_DYNAMIC_DISPATCH(Wrap)(run, frames, in, out, begin, end);
}
void RunSnap(const WrapRun& run, const float* driver, ConstPointsView in, PointsView out, std::size_t begin,
             std::size_t end) noexcept {
  HWY_DYNAMIC_DISPATCH(Snap)(run, driver, in, out, begin, end);
}

}  // namespace kpsa::engine
#endif  // HWY_ONCE
