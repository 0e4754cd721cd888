#include "nodes/kernels/wrap_run.h"

#include <cmath>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nodes/kernels/wrap_run.cpp"
#include "hwy/foreach_target.h"

#include "nodes/kernels/xyzw-inl.h"

HWY_BEFORE_NAMESPACE();
namespace kpsa::engine {
namespace HWY_NAMESPACE {

constexpr float kFoldedSquare = 1e-10f;  // of the tangents' lengths, squared

void NormalsOf(const Index* HWY_RESTRICT triangles, const float* HWY_RESTRICT driver, std::size_t begin,
               std::size_t end, float* HWY_RESTRICT normals) {
  for (std::size_t t = begin; t < end; ++t) {
    const Index* corner = triangles + 3 * t;
    const F4 a = Load4(driver + 4 * std::size_t{corner[0]});
    const F4 b = Sub4(Load4(driver + 4 * std::size_t{corner[1]}), a);
    const F4 c = Sub4(Load4(driver + 4 * std::size_t{corner[2]}), a);
    Store4(Cross4(b, c), normals + 4 * t);
  }
}

void FramesOf(const FramesRun& run, const float* HWY_RESTRICT driver, const float* HWY_RESTRICT normals,
              std::size_t begin, std::size_t end, float* HWY_RESTRICT frames) {
  for (std::size_t f = begin; f < end; ++f) {
    const Index first = run.edge_offsets[f], last = run.edge_offsets[f + 1];
    if (first == last) continue;
    F4 sum = Zero4();
    for (Index t = run.triangle_offsets[f]; t < run.triangle_offsets[f + 1]; ++t)
      sum = Add4(sum, Load4(normals + 4 * std::size_t{run.around[t]}));
    alignas(16) float n[4];
    Store4(sum, n);
    const float length = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    const F4 normal = length == 0 ? sum : Mul4(sum, Splat4(1 / length));  // not a number stays what it is
    const float* dual = run.normal_duals + 4 * f;
    F4 x = Mul4(normal, Splat4(dual[0])), y = Mul4(normal, Splat4(dual[1])),
       z = Mul4(normal, Splat4(dual[2]));
    const F4 own = Load4(driver + 4 * std::size_t{run.own[f]});
    for (Index e = first; e < last; ++e) {
      const F4 edge = Sub4(Load4(driver + 4 * std::size_t{run.edge_points[e]}), own);
      dual = run.duals + 4 * std::size_t{e};
      x = Fma4(edge, Splat4(dual[0]), x);
      y = Fma4(edge, Splat4(dual[1]), y);
      z = Fma4(edge, Splat4(dual[2]), z);
    }
    float* frame = frames + kFrameFloats * f;
    Store4(x, frame);
    Store4(y, frame + 4);
    Store4(z, frame + 8);
    Store4(normal, frame + 12);
  }
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

// Sums over influences, of a block of points.
struct WrapSums {
  alignas(64) float anchors[4 * kWrapBlock] = {}, tangents[4 * kWrapBlock] = {},
                                binormals[4 * kWrapBlock] = {}, normals[4 * kWrapBlock] = {};
};

HWY_INLINE void SumInfluences(const WrapRun& run, const float* HWY_RESTRICT driver,
                              const float* HWY_RESTRICT frames, std::size_t begin, std::size_t size,
                              WrapSums* sums) {
  for (std::size_t k = 0; k < size; ++k) {
    const std::size_t point = begin + k;
    F4 anchor = Zero4(), x = anchor, y = anchor, z = anchor, normal = anchor;
    for (Index e = run.offsets[point]; e < run.offsets[point + 1]; ++e) {
      const F4 share = Splat4(run.shares[e]);
      anchor = Fma4(share, Load4(driver + 4 * std::size_t{run.entries[e]}), anchor);
      if (run.frame_of[e] == kNoIndex) continue;
      const float* frame = frames + kFrameFloats * run.frame_of[e];
      x = Fma4(share, Load4(frame), x);
      y = Fma4(share, Load4(frame + 4), y);
      z = Fma4(share, Load4(frame + 8), z);
      normal = Fma4(share, Load4(frame + 12), normal);
    }
    const float* along = run.directions + 8 * point;
    Store4(anchor, sums->anchors + 4 * k);
    Store4(Fma4(x, Splat4(along[0]), Fma4(y, Splat4(along[1]), Mul4(z, Splat4(along[2])))),
           sums->tangents + 4 * k);
    Store4(Fma4(x, Splat4(along[4]), Fma4(y, Splat4(along[5]), Mul4(z, Splat4(along[6])))),
           sums->binormals + 4 * k);
    Store4(normal, sums->normals + 4 * k);
  }
}

// The frame of the sums at `at`: whether it exists, and then its axes.
HWY_INLINE auto FrameOf(const WrapRun& run, const WrapSums& sums, std::size_t at, Lanes3* t, Lanes3* b,
                        Lanes3* n) {
  const DLanes d;
  const VLanes folded = hn::Set(d, kFoldedSquare), one = hn::Set(d, 1.0f);
  VLanes spare;
  hn::LoadInterleaved4(d, sums.tangents + 4 * at, t->x, t->y, t->z, spare);
  hn::LoadInterleaved4(d, sums.binormals + 4 * at, b->x, b->y, b->z, spare);
  hn::LoadInterleaved4(d, sums.normals + 4 * at, n->x, n->y, n->z, spare);
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

void Places(const WrapRun& run, const float* driver, const float* frames, std::size_t begin, std::size_t end,
            float* places) {
  const DLanes d;
  WrapSums sums;
  for (std::size_t i = begin; i < end; i += hn::Lanes(d)) {
    const std::size_t at = (i - begin) % kWrapBlock;
    if (at == 0) SumInfluences(run, driver, frames, i, HWY_MIN(kWrapBlock, end - i), &sums);
    Lanes3 anchor, t, b, n;
    VLanes spare;
    hn::LoadInterleaved4(d, sums.anchors + 4 * at, anchor.x, anchor.y, anchor.z, spare);
    const auto exists = FrameOf(run, sums, at, &t, &b, &n);
    float* to = places + i;
    Store3(anchor, to, run.row);
    Store3(t, to + 3 * run.row, run.row);
    Store3(b, to + 6 * run.row, run.row);
    Store3(n, to + 9 * run.row, run.row);
    hn::Store(hn::IfThenElseZero(exists, hn::Set(d, 1.0f)), d, to + 12 * run.row);
  }
}

// Goals as moves from where the point would be at rest: what rests stays, to the bit.
void Wrap(const WrapRun& run, const float* driver, const float* frames, ConstPointsView in, PointsView out,
          std::size_t begin, std::size_t end) {
  const DLanes d;
  const VLanes zero = hn::Zero(d);
  const std::size_t row = run.row;
  WrapSums sums;
  for (std::size_t i = begin; i < end; i += hn::Lanes(d)) {
    const std::size_t at = (i - begin) % kWrapBlock;
    if (at == 0) SumInfluences(run, driver, frames, i, HWY_MIN(kWrapBlock, end - i), &sums);
    Lanes3 anchor;
    VLanes spare;
    hn::LoadInterleaved4(d, sums.anchors + 4 * at, anchor.x, anchor.y, anchor.z, spare);
    const Lanes3 p{hn::Load(d, in.x + i), hn::Load(d, in.y + i), hn::Load(d, in.z + i)};
    Lanes3 move;
    if (run.snaps) {
      move = Sub3(anchor, p);
    } else {
      Lanes3 t, b, n;
      auto turns = FrameOf(run, sums, at, &t, &b, &n);
      const float* rest = run.rest + i;
      const Lanes3 rest_anchor = Load3(rest, row), rest_t = Load3(rest + 3 * row, row),
                   rest_b = Load3(rest + 6 * row, row), rest_n = Load3(rest + 9 * row, row);
      turns = hn::And(turns, hn::Gt(hn::Load(d, rest + 12 * row), zero));
      const Lanes3 offset = Sub3(p, rest_anchor);
      const VLanes along_t = hn::IfThenElseZero(turns, Dot3(rest_t, offset));
      const VLanes along_b = hn::IfThenElseZero(turns, Dot3(rest_b, offset));
      const VLanes along_n = hn::IfThenElseZero(turns, Dot3(rest_n, offset));
      const auto axis = [&](VLanes now, VLanes then)
                            HWY_ATTR { return hn::IfThenElseZero(turns, hn::Sub(now, then)); };
      move = Sub3(anchor, rest_anchor);
      move.x = Fma(axis(t.x, rest_t.x), along_t,
                   Fma(axis(b.x, rest_b.x), along_b, Fma(axis(n.x, rest_n.x), along_n, move.x)));
      move.y = Fma(axis(t.y, rest_t.y), along_t,
                   Fma(axis(b.y, rest_b.y), along_b, Fma(axis(n.y, rest_n.y), along_n, move.y)));
      move.z = Fma(axis(t.z, rest_t.z), along_t,
                   Fma(axis(b.z, rest_b.z), along_b, Fma(axis(n.z, rest_n.z), along_n, move.z)));
    }
    const VLanes w = hn::Mul(hn::Load(d, run.weights + i), hn::Set(d, run.envelope));
    const auto stays = hn::Eq(w, zero);
    hn::Store(hn::IfThenElse(stays, p.x, Fma(w, move.x, p.x)), d, out.x + i);
    hn::Store(hn::IfThenElse(stays, p.y, Fma(w, move.y, p.y)), d, out.y + i);
    hn::Store(hn::IfThenElse(stays, p.z, Fma(w, move.z, p.z)), d, out.z + i);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace kpsa::engine
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace kpsa::engine {

HWY_EXPORT(NormalsOf);
HWY_EXPORT(FramesOf);
HWY_EXPORT(Places);
HWY_EXPORT(Wrap);

void RunTriangleNormals(const Index* triangles, const float* driver, std::size_t begin, std::size_t end,
                        float* normals) noexcept {
  HWY_DYNAMIC_DISPATCH(NormalsOf)(triangles, driver, begin, end, normals);
}
void RunDriverFrames(const FramesRun& run, const float* driver, const float* normals, std::size_t begin,
                     std::size_t end, float* frames) noexcept {
  HWY_DYNAMIC_DISPATCH(FramesOf)(run, driver, normals, begin, end, frames);
}
void FindWrapPlaces(const WrapRun& run, const float* driver, const float* frames, std::size_t begin,
                    std::size_t end, float* places) noexcept {
  HWY_DYNAMIC_DISPATCH(Places)(run, driver, frames, begin, end, places);
}
void RunWrap(const WrapRun& run, const float* driver, const float* frames, ConstPointsView in, PointsView out,
             std::size_t begin, std::size_t end) noexcept {
  HWY_DYNAMIC_DISPATCH(Wrap)(run, driver, frames, in, out, begin, end);
}

}  // namespace kpsa::engine
#endif  // HWY_ONCE
