#include "nodes/kernels/delta_mush.h"

#include "base/check.h"
#include "nodes/kernels/delta_mush_run.h"
#include "nodes/kernels/weights.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nodes/kernels/delta_mush.cpp"
#include "hwy/foreach_target.h"

#include "nodes/kernels/xyzw-inl.h"

HWY_BEFORE_NAMESPACE();
namespace kpsa::engine {
namespace HWY_NAMESPACE {

// The points minus the pivot, as xyzw by local number.
void PackLocal(ConstPointsView in, const Index* source, const float* pivot, std::size_t begin,
               std::size_t end, float* xyzw) {
  if (source != nullptr) {
    for (std::size_t i = begin; i < end; ++i) {
      const Index p = source[i];
      float* to = xyzw + 4 * i;
      to[0] = in.x[p] - pivot[0], to[1] = in.y[p] - pivot[1], to[2] = in.z[p] - pivot[2], to[3] = 0;
    }
    return;
  }
  const DLanes d;
  const VLanes px = hn::Set(d, pivot[0]), py = hn::Set(d, pivot[1]), pz = hn::Set(d, pivot[2]);
  for (std::size_t i = begin; i < end; i += hn::Lanes(d)) {
    hn::StoreInterleaved4(hn::Sub(hn::Load(d, in.x + i), px), hn::Sub(hn::Load(d, in.y + i), py),
                          hn::Sub(hn::Load(d, in.z + i), pz), hn::Zero(d), d, xyzw + 4 * i);
  }
}

// The sum over neighbours, alike or weighted with a sum of 1.
template <std::size_t n, std::size_t e, bool kWeighted>
HWY_INLINE F4 AddNeighbors(const float* HWY_RESTRICT from, const Index* HWY_RESTRICT neighbors,
                           const float* HWY_RESTRICT weights, F4 sum) {
  const F4 neighbor = Load4(from + EntryOf<e, n + 1>(neighbors));
  if constexpr (kWeighted) {
    sum = e == 0 ? Mul4(SplatOf4<e>(weights), neighbor) : Fma4(SplatOf4<e>(weights), neighbor, sum);
  } else {
    sum = e == 0 ? neighbor : Add4(sum, neighbor);
  }
  if constexpr (e + 1 < n) sum = AddNeighbors<n, e + 1, kWeighted>(from, neighbors, weights, sum);
  return sum;
}

template <std::size_t n, bool kWeighted>  // n = 0: at run time
HWY_INLINE void SmoothGroup(const MushRows& rows, const float* HWY_RESTRICT from, float* HWY_RESTRICT to) {
  const std::size_t neighbor_count = n == 0 ? rows.neighbor_count : n, count = rows.count;
  const Index* HWY_RESTRICT neighbors = rows.rows;
  const float* HWY_RESTRICT weights = rows.weights;
  const F4 step = Splat4(rows.step), less = Splat4(kWeighted ? -1.0f : -static_cast<float>(neighbor_count));
  for (std::size_t i = 0; i < count; ++i, neighbors += neighbor_count + 1) {
    F4 sum;
    Index own;
    if constexpr (n != 0) {
      sum = AddNeighbors<n, 0, kWeighted>(from, neighbors, weights, Zero4());
      own = EntryOf<n, n + 1>(neighbors);
    } else {
      sum = Load4(from + neighbors[0]);
      if constexpr (kWeighted) sum = Mul4(Splat4(weights[0]), sum);
      for (std::size_t j = 1; j < neighbor_count; ++j) {
        const F4 neighbor = Load4(from + neighbors[j]);
        sum = kWeighted ? Fma4(Splat4(weights[j]), neighbor, sum) : Add4(sum, neighbor);
      }
      own = neighbors[neighbor_count];
    }
    if constexpr (kWeighted) weights += neighbor_count;
    const F4 s = Load4(from + own);
    Store4(Fma4(step, Fma4(less, s, sum), s), to + own);
  }
}

template <bool kWeighted>
HWY_INLINE void SmoothRowsOf(const MushRows& rows, const float* from, float* to) {
  switch (rows.neighbor_count) {
    case 3:
      return SmoothGroup<3, kWeighted>(rows, from, to);
    case 4:
      return SmoothGroup<4, kWeighted>(rows, from, to);
    case 5:
      return SmoothGroup<5, kWeighted>(rows, from, to);
    case 6:
      return SmoothGroup<6, kWeighted>(rows, from, to);
    case 7:
      return SmoothGroup<7, kWeighted>(rows, from, to);
    case 8:
      return SmoothGroup<8, kWeighted>(rows, from, to);
    default:
      return SmoothGroup<0, kWeighted>(rows, from, to);
  }
}

// One iteration of a group.
void SmoothRows(const MushRows& rows, const float* from, float* to) {
  if (rows.neighbor_count == 0) {
    for (std::size_t i = 0; i < rows.count; ++i) Store4(Load4(from + rows.rows[i]), to + rows.rows[i]);
    return;
  }
  if (rows.weights != nullptr) return SmoothRowsOf<true>(rows, from, to);
  SmoothRowsOf<false>(rows, from, to);
}

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

HWY_EXPORT(PackLocal);
HWY_EXPORT(SmoothRows);
HWY_EXPORT(FinishPoints);
HWY_EXPORT(FinishDetail);

void ComputeMushDetail(const MushFinish& run, ConstPointsView rest, std::size_t begin,
                       std::size_t end) noexcept {
  HWY_DYNAMIC_DISPATCH(FinishDetail)(run, rest, begin, end);
}

const float* DeltaMushKernel::Smooth(ConstPointsView in, const float* pivot, std::span<float> scratch,
                                     const Parallel* parallel) const noexcept {
  float *from = scratch.data(), *to = from + BufferFloats();
  ForRanges(parallel, local_count_, 8192, [&](std::size_t begin, std::size_t end) {
    HWY_DYNAMIC_DISPATCH(PackLocal)(in, source_.empty() ? nullptr : source_.data(), pivot, begin, end, from);
  });
  for (int j = 1; j <= iterations_; ++j) {
    ForRanges(parallel, block_counts_[static_cast<std::size_t>(j)], 4,
              [&](std::size_t begin, std::size_t end) {
                const auto smooth_rows = HWY_DYNAMIC_DISPATCH(SmoothRows);
                for (Index g = blocks_[begin]; g < blocks_[end]; ++g) {
                  const Group& group = groups_[g];
                  const float* weights =
                      neighbor_weights_.empty() ? nullptr : neighbor_weights_.data() + group.first_weight;
                  smooth_rows({rows_.data() + group.first, weights, group.neighbors, group.count, group.step},
                              from, to);
                }
              });
    std::swap(from, to);
  }
  return from;
}

void DeltaMushKernel::Run(const Inputs& inputs, ConstPointsView in, PointsView out, std::span<float> scratch,
                          const Parallel* parallel) const noexcept {
  KPSA_CHECK_EQ(in.count, in_count_);
  KPSA_CHECK_EQ(out.count, count_);
  KPSA_CHECK_LE(ScratchFloats(), scratch.size());
  const float envelope = static_cast<float>(inputs.envelope);
  if (local_count_ == 0 || envelope == 0) {
    if (out_in_.empty()) return CopyPoints(in, out);
    return GatherPoints(in, out_in_, out);
  }
  const float pivot[3] = {static_cast<float>(inputs.pivot.x), static_cast<float>(inputs.pivot.y),
                          static_cast<float>(inputs.pivot.z)};
  const float* smoothed = Smooth(in, pivot, scratch, parallel);
  const std::size_t row = PaddedCount(count_);
  float* detail = const_cast<float*>(detail_.data());  // read only, unless the kernel is bound
  const MushFinish run{smoothed,
                       lanes_.data(),
                       out_local_.data(),
                       frame_offsets_.data(),
                       frame_neighbors_.data(),
                       frame_weights_.data(),
                       out_in_.empty() ? nullptr : out_in_.data(),
                       masks_.data(),
                       detail,
                       detail + row,
                       detail + 2 * row,
                       envelope,
                       static_cast<float>(inputs.displacement),
                       {pivot[0], pivot[1], pivot[2]}};
  ForRanges(parallel, count_, 1024, [&](std::size_t begin, std::size_t end) {
    HWY_DYNAMIC_DISPATCH(FinishPoints)(run, in, out, begin, end);
  });
}

}  // namespace kpsa::engine
#endif  // HWY_ONCE
