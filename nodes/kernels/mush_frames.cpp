#include "nodes/kernels/mush_frames.h"

#include "base/check.h"
#include "nodes/kernels/delta_mush_run.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nodes/kernels/mush_frames.cpp"
#include "hwy/foreach_target.h"

#include "nodes/kernels/xyzw-inl.h"

HWY_BEFORE_NAMESPACE();
namespace kpsa::engine {
namespace HWY_NAMESPACE {

// Tangent and bitangent at a point: in one vector where it holds both, sums over the edges to n neighbours.
#if HWY_MAX_BYTES >= 32
using DTangents = hn::FixedTag<float, 8>;
template <std::size_t n, std::size_t e>
HWY_INLINE void AddTangents(const float* HWY_RESTRICT from, const Index* HWY_RESTRICT neighbors,
                            const float* HWY_RESTRICT weights, hn::Vec<DTangents> s,
                            hn::Vec<DTangents>* HWY_RESTRICT sums) {
  const DTangents d;
  HWY_ALIGN static constexpr std::int32_t kPairs[16] = {0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3};
  const auto edge = hn::Sub(hn::LoadDup128(d, from + EntryOf<e, n>(neighbors)), s);
  const auto w = hn::TableLookupLanes(hn::LoadDup128(d, weights + e / 2 * 4),
                                      hn::SetTableIndices(d, kPairs + e % 2 * 8));
  *sums = e == 0 ? hn::Mul(w, edge) : Fma(w, edge, *sums);
  if constexpr (e + 1 < n) AddTangents<n, e + 1>(from, neighbors, weights, s, sums);
}
template <std::size_t n>
HWY_INLINE void SumTangents(const float* from, const Index* neighbors, const float* weights,
                            const float* point, float* tangent, float* bitangent) {
  hn::Vec<DTangents> sums;
  AddTangents<n, 0>(from, neighbors, weights, hn::LoadDup128(DTangents(), point), &sums);
  Store4(hn::LowerHalf(D4(), sums), tangent);
  Store4(hn::UpperHalf(D4(), sums), bitangent);
}
#else
template <std::size_t n>
HWY_INLINE void SumTangents(const float* from, const Index* neighbors, const float* weights,
                            const float* point, float* tangent, float* bitangent) {
  const F4 s = Load4(point);
  F4 t, b;
  for (std::size_t e = 0; e < n; ++e) {
    const F4 edge = Sub4(Load4(from + neighbors[e]), s);
    t = e == 0 ? Mul4(Splat4(weights[0]), edge) : Fma4(Splat4(weights[2 * e]), edge, t);
    b = e == 0 ? Mul4(Splat4(weights[1]), edge) : Fma4(Splat4(weights[2 * e + 1]), edge, b);
  }
  Store4(t, tangent);
  Store4(b, bitangent);
}
#endif

// Of `count` frames of n neighbours each (0: `size`), by their place in the block.
template <std::size_t n>
HWY_INLINE void TangentGroup(const MushFinish& run, std::size_t first, std::size_t size, std::size_t count,
                             float* HWY_RESTRICT smoothed, float* HWY_RESTRICT tangents,
                             float* HWY_RESTRICT bitangents) {
  if constexpr (n != 0) size = n;
  const float* HWY_RESTRICT from = run.smoothed;
  const Index* HWY_RESTRICT neighbors = run.frame_neighbors + run.frame_offsets[first];
  const float* HWY_RESTRICT weights = run.frame_weights + 2 * std::size_t{run.frame_offsets[first]};
  for (std::size_t i = first; i < first + count; ++i, neighbors += size, weights += 2 * size) {
    const std::size_t lane = 4u * run.lanes[i];
    const float* point = from + run.out_local[i];
    const F4 s = Load4(point);
    Store4(s, smoothed + lane);
    if constexpr (n != 0) {
      SumTangents<n>(from, neighbors, weights, point, tangents + lane, bitangents + lane);
    } else {
      F4 t = Zero4(), b = t;
      for (std::size_t e = 0; e < size; ++e) {
        const F4 edge = Sub4(Load4(from + neighbors[e]), s);
        t = e == 0 ? Mul4(Splat4(weights[0]), edge) : Fma4(Splat4(weights[2 * e]), edge, t);
        b = e == 0 ? Mul4(Splat4(weights[1]), edge) : Fma4(Splat4(weights[2 * e + 1]), edge, b);
      }
      Store4(t, tangents + lane);
      Store4(b, bitangents + lane);
    }
  }
}

HWY_INLINE void GatherTangents(const MushFinish& run, std::size_t begin, std::size_t end, float* smoothed,
                               float* tangents, float* bitangents) {
  for (std::size_t i = begin; i < end;) {
    const std::size_t size = run.frame_offsets[i + 1] - run.frame_offsets[i];
    std::size_t last = i + 1;
    while (last < end && run.frame_offsets[last + 1] - run.frame_offsets[last] == size) ++last;
    switch (size) {
      case 4:
        TangentGroup<4>(run, i, size, last - i, smoothed, tangents, bitangents);
        break;
      case 5:
        TangentGroup<5>(run, i, size, last - i, smoothed, tangents, bitangents);
        break;
      case 6:
        TangentGroup<6>(run, i, size, last - i, smoothed, tangents, bitangents);
        break;
      case 7:
        TangentGroup<7>(run, i, size, last - i, smoothed, tangents, bitangents);
        break;
      default:
        TangentGroup<0>(run, i, size, last - i, smoothed, tangents, bitangents);
        break;
    }
    i = last;
  }
}

constexpr float kFoldBegins = 0.1f;  // of 2s / (e + g), below

// The frames of the outputs [begin, end), and with them either the detail (kBind) or the points.
// The frame is the rotation of the polar decomposition of the tangents (t b): with C = (t b)^T (t b) = (E F;
// F G) and s = sqrt(det C) = |t x b|, the root of C is (C + s I) / sqrt(tr C + 2 s).
template <bool kBind>
HWY_INLINE void Finish(const MushFinish& run, ConstPointsView in, PointsView out, std::size_t begin,
                       std::size_t end) {
  const DLanes d;
  const VLanes zero = hn::Zero(d), one = hn::Set(d, 1.0f);
  // Blocks of points: what is gathered has left the store buffer before the wider loads read it
  alignas(64) float smoothed[4 * kFinishBlock] = {}, tangents[4 * kFinishBlock] = {},
                                 bitangents[4 * kFinishBlock] = {};
  alignas(64) float incoming[3 * kFinishBlock] = {};
  for (std::size_t i = begin; i < end; i += hn::Lanes(d)) {
    const std::size_t at = (i - begin) % kFinishBlock;
    if (at == 0) {
      const std::size_t size = HWY_MIN(kFinishBlock, end - i);
      GatherTangents(run, i, i + size, smoothed, tangents, bitangents);
      for (std::size_t k = 0; k < (run.out_in == nullptr ? 0 : size); ++k) {
        const Index p = run.out_in[i + k];
        incoming[k] = in.x[p], incoming[kFinishBlock + k] = in.y[p], incoming[2 * kFinishBlock + k] = in.z[p];
      }
    }
    VLanes sx, sy, sz, tx, ty, tz, bx, by, bz, spare;
    hn::LoadInterleaved4(d, smoothed + 4 * at, sx, sy, sz, spare);
    hn::LoadInterleaved4(d, tangents + 4 * at, tx, ty, tz, spare);
    hn::LoadInterleaved4(d, bitangents + 4 * at, bx, by, bz, spare);

    // Frame; the axes of space where the tangents are (nearly) parallel or have no length
    const VLanes cx = Fma(ty, bz, hn::Neg(hn::Mul(tz, by)));
    const VLanes cy = Fma(tz, bx, hn::Neg(hn::Mul(tx, bz)));
    const VLanes cz = Fma(tx, by, hn::Neg(hn::Mul(ty, bx)));
    const VLanes e = Fma(tx, tx, Fma(ty, ty, hn::Mul(tz, tz)));
    const VLanes f = Fma(tx, bx, Fma(ty, by, hn::Mul(tz, bz)));
    const VLanes g = Fma(bx, bx, Fma(by, by, hn::Mul(bz, bz)));
    const VLanes s2 = Fma(cx, cx, Fma(cy, cy, hn::Mul(cz, cz)));
    // Not "s2 > ...": what is not a number must come out as such
    const auto regular = hn::Not(
        hn::Or(hn::Le(s2, hn::Mul(hn::Set(d, 1e-10f), hn::Mul(e, g))), hn::Le(s2, hn::Set(d, 1e-30f))));
    const VLanes s = hn::Sqrt(s2);
    const VLanes root = hn::Sqrt(hn::Add(hn::Add(e, g), hn::Add(s, s)));
    const VLanes scale = hn::Div(one, hn::Mul(root, s)), inverse_s = hn::Mul(scale, root);
    const VLanes gs = hn::Mul(hn::Add(g, s), scale), es = hn::Mul(hn::Add(e, s), scale);
    const VLanes fs = hn::Neg(hn::Mul(f, scale));
    const VLanes ux = hn::IfThenElse(regular, Fma(gs, tx, hn::Mul(fs, bx)), one);
    const VLanes uy = hn::IfThenElseZero(regular, Fma(gs, ty, hn::Mul(fs, by)));
    const VLanes uz = hn::IfThenElseZero(regular, Fma(gs, tz, hn::Mul(fs, bz)));
    const VLanes vx = hn::IfThenElseZero(regular, Fma(es, bx, hn::Mul(fs, tx)));
    const VLanes vy = hn::IfThenElse(regular, Fma(es, by, hn::Mul(fs, ty)), one);
    const VLanes vz = hn::IfThenElseZero(regular, Fma(es, bz, hn::Mul(fs, tz)));
    const VLanes nx = hn::IfThenElseZero(regular, hn::Mul(cx, inverse_s));
    const VLanes ny = hn::IfThenElseZero(regular, hn::Mul(cy, inverse_s));
    const VLanes nz = hn::IfThenElse(regular, hn::Mul(cz, inverse_s), one);

    VLanes x, y, z;
    if (run.out_in == nullptr) {
      x = hn::Load(d, in.x + i), y = hn::Load(d, in.y + i), z = hn::Load(d, in.z + i);
    } else {
      const float* row = incoming + at;
      x = hn::Load(d, row), y = hn::Load(d, row + kFinishBlock), z = hn::Load(d, row + 2 * kFinishBlock);
    }
    if constexpr (kBind) {
      x = hn::Sub(hn::Sub(x, hn::Set(d, run.pivot[0])), sx);
      y = hn::Sub(hn::Sub(y, hn::Set(d, run.pivot[1])), sy);
      z = hn::Sub(hn::Sub(z, hn::Set(d, run.pivot[2])), sz);
      hn::Store(Fma(ux, x, Fma(uy, y, hn::Mul(uz, z))), d, run.detail_x + i);
      hn::Store(Fma(vx, x, Fma(vy, y, hn::Mul(vz, z))), d, run.detail_y + i);
      hn::Store(Fma(nx, x, Fma(ny, y, hn::Mul(nz, z))), d, run.detail_z + i);
      continue;
    }
    // Tangents are orthonormal at rest. Where the surface folds they become parallel, and the frame turns
    // over from one moment to the next: the detail fades before. 2s / (e + g) is 1 for a frame that was
    // turned or scaled. Rings that are lines have no tangents, ever
    const VLanes trace = hn::Add(e, g);
    const VLanes open = hn::IfThenElse(
        hn::Gt(trace, zero), hn::Min(one, hn::Div(hn::Mul(hn::Set(d, 2 / kFoldBegins), s), trace)), one);
    const VLanes scale_detail =
        hn::Mul(hn::Set(d, run.displacement), hn::Mul(open, hn::Sub(hn::Set(d, 2.0f), open)));
    const VLanes du = hn::Load(d, run.detail_x + i), dv = hn::Load(d, run.detail_y + i);
    const VLanes dn = hn::Load(d, run.detail_z + i);
    const VLanes mx = Fma(scale_detail, Fma(du, ux, Fma(dv, vx, hn::Mul(dn, nx))), sx);
    const VLanes my = Fma(scale_detail, Fma(du, uy, Fma(dv, vy, hn::Mul(dn, ny))), sy);
    const VLanes mz = Fma(scale_detail, Fma(du, uz, Fma(dv, vz, hn::Mul(dn, nz))), sz);
    VLanes w = hn::Set(d, run.envelope);
    if (run.masks != nullptr) w = hn::Mul(w, hn::Load(d, run.masks + i));
    const auto all = hn::Eq(w, one), none = hn::Eq(w, zero);
    const auto mix = [&](const VLanes relative, const float pivot, const VLanes unmoved) HWY_ATTR {
      const VLanes mush = hn::Add(relative, hn::Set(d, pivot));
      const VLanes part = hn::IfThenElse(all, mush, Fma(w, hn::Sub(mush, unmoved), unmoved));
      return hn::IfThenElse(none, unmoved, part);
    };
    hn::Store(mix(mx, run.pivot[0], x), d, out.x + i);
    hn::Store(mix(my, run.pivot[1], y), d, out.y + i);
    hn::Store(mix(mz, run.pivot[2], z), d, out.z + i);
  }
}

void FinishPoints(const MushFinish& run, ConstPointsView in, PointsView out, std::size_t begin,
                  std::size_t end) {
  Finish<false>(run, in, out, begin, end);
}
void FinishDetail(const MushFinish& run, ConstPointsView rest, std::size_t begin, std::size_t end) {
  Finish<true>(run, rest, {}, begin, end);
}

}  // namespace HWY_NAMESPACE
}  // namespace kpsa::engine
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace kpsa::engine {

HWY_EXPORT(FinishPoints);
HWY_EXPORT(FinishDetail);

void ComputeMushDetail(const MushFinish& run, ConstPointsView rest, std::size_t begin,
                       std::size_t end) noexcept {
  HWY_DYNAMIC_DISPATCH(FinishDetail)(run, rest, begin, end);
}

void MushFrames::Run(const Inputs& inputs, const float* smoothed, ConstPointsView in, PointsView out,
                     const Parallel* parallel) const noexcept {
  KPSA_CHECK_EQ(out.count, count_);
  if (!changes() || inputs.envelope == 0) return Pass(in, out);
  float* detail = const_cast<float*>(detail_.data());  // read only, unless the frames are bound
  const MushFinish run = FinishOf(inputs, smoothed, detail);
  ForRanges(parallel, count_, 1024, [&](std::size_t begin, std::size_t end) {
    HWY_DYNAMIC_DISPATCH(FinishPoints)(run, in, out, begin, end);
  });
}

}  // namespace kpsa::engine
#endif  // HWY_ONCE
