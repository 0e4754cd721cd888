#include "kpsa/tile_inputs.h"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kpsa/tile_inputs.cpp"
#include "kpsa/tiles.h"

#include "hwy/foreach_target.h"

#include "base/simd-inl.h"

#ifndef KPSA_TILE_INPUTS_STEP
#define KPSA_TILE_INPUTS_STEP
namespace kpsa::engine {
namespace {

constexpr std::size_t kProductsPadded = (kMaxProducts + kProductLanes - 1) / kProductLanes * kProductLanes;

}  // namespace
}  // namespace kpsa::engine
#endif

HWY_BEFORE_NAMESPACE();
namespace kpsa::engine {
namespace HWY_NAMESPACE {

// Halfs are converted eight at a time, though there may be wider vectors: Zen 4 takes half as long again for
// sixteen as for two times eight, and fewer rows are computed that only pad a tile to sixteen.
constexpr std::size_t kRowLanes = HWY_MIN(HWY_LANES(float), 8);
constexpr std::size_t kEightsAtOnce = HWY_TARGET == HWY_AVX3 ? 6 : 2;  // of rows: four sums each in registers

// x_j of a column of V, by its cue, or of a column of W or of the doubt.
struct CueAt {
  const std::uint32_t* columns;
  const float* y;
  HWY_INLINE float operator()(std::size_t j) const { return y[columns[j]]; }
};
struct ProductAt {
  const float* p;
  HWY_INLINE float operator()(std::size_t j) const { return p[j]; }
};

// 8 kEights rows: z = scale M x, or z + that, with M of `count` columns of k16 halfs.
template <std::size_t kEights, bool kAdd, class At>
HWY_INLINE void SumRows(const hwy::float16_t* HWY_RESTRICT m, std::size_t k16,
                        const float* HWY_RESTRICT scale, std::size_t count, At x, float* HWY_RESTRICT z) {
  const hn::CappedTag<float, 8> d;
  const hn::Rebind<hwy::float16_t, decltype(d)> dh;
  constexpr std::size_t kVectors = kEights * (8 / kRowLanes);
  using V = hn::Vec<decltype(d)>;
  V sum[4][kVectors];
  const auto add = [&](V(&to)[kVectors], const hwy::float16_t* column, std::size_t j) HWY_ATTR {
    const V factor = hn::Set(d, x(j));
#pragma GCC unroll 32
    for (std::size_t i = 0; i < kVectors; ++i)
      to[i] = Fma(hn::PromoteTo(d, hn::LoadU(dh, column + i * kRowLanes)), factor, to[i]);
  };
#pragma GCC unroll 4
  for (int q = 0; q < 4; ++q) {
#pragma GCC unroll 32
    for (std::size_t i = 0; i < kVectors; ++i) sum[q][i] = hn::Zero(d);
  }
  std::size_t j = 0;
  for (; j + 4 <= count; j += 4, m += 4 * k16) {
    add(sum[0], m, j);
    add(sum[1], m + k16, j + 1);
    add(sum[2], m + 2 * k16, j + 2);
    add(sum[3], m + 3 * k16, j + 3);
  }
  if (j < count) add(sum[0], m, j);
  if (j + 1 < count) add(sum[1], m + k16, j + 1);
  if (j + 2 < count) add(sum[2], m + 2 * k16, j + 2);
#pragma GCC unroll 32
  for (std::size_t i = 0; i < kVectors; ++i) {
    const V all = hn::Mul(hn::Add(hn::Add(sum[0][i], sum[1][i]), hn::Add(sum[2][i], sum[3][i])),
                          hn::LoadU(d, scale + i * kRowLanes));
    hn::StoreU(kAdd ? hn::Add(hn::LoadU(d, z + i * kRowLanes), all) : all, d, z + i * kRowLanes);
  }
}

template <std::size_t kMost, bool kAdd, class At>
HWY_INLINE void SumLastRows(std::size_t eights, const hwy::float16_t* m, std::size_t k16, const float* scale,
                            std::size_t count, At x, float* z) {
  if (eights == kMost) return SumRows<kMost, kAdd>(m, k16, scale, count, x, z);
  if constexpr (kMost > 1) SumLastRows<kMost - 1, kAdd>(eights, m, k16, scale, count, x, z);
}

// All rows, to the next multiple of eight.
template <bool kAdd, class At>
HWY_INLINE void SumAllRows(const std::uint16_t* halfs, std::size_t rank, std::size_t k16, const float* scale,
                           std::size_t count, At x, float* z) {
  const auto* m = reinterpret_cast<const hwy::float16_t*>(halfs);
  std::size_t eights = (rank + 7) / 8;
  for (; eights > kEightsAtOnce; eights -= kEightsAtOnce) {
    SumRows<kEightsAtOnce, kAdd>(m, k16, scale, count, x, z);
    m += 8 * kEightsAtOnce, scale += 8 * kEightsAtOnce, z += 8 * kEightsAtOnce;
  }
  SumLastRows<kEightsAtOnce, kAdd>(eights, m, k16, scale, count, x, z);
}

HWY_INLINE void LinearTerm(const TileTerms& tile, const float* HWY_RESTRICT y) {
  if (tile.direct) {
    for (std::size_t k = 0; k < tile.count; ++k) tile.z[k] = y[tile.columns[k]] * tile.scale[k];
    return;
  }
  SumAllRows<false>(tile.v, tile.rank, tile.k16, tile.scale, tile.count, CueAt{tile.columns, y}, tile.z);
  // Whoever takes the latents takes sixteen
  for (std::size_t k = (tile.rank + 7) / 8 * 8; k < tile.k16; ++k) tile.z[k] = 0;
}

// The latents of a tile, whitened and clipped, and one: a latent that is not a number is clipped, too.
// p [kProductsPadded], 64-byte aligned.
HWY_INLINE void LatentProducts(const TileTerms& tile, float* HWY_RESTRICT p) {
#if HWY_TARGET == HWY_AVX3
  const hn::CappedTag<float, 16> d;
  const hn::Rebind<std::uint8_t, decltype(d)> db;
  const hn::Rebind<std::int32_t, decltype(d)> di;
  const auto latents = hn::Mul(hn::LoadU(d, tile.z), hn::LoadU(d, tile.whitening));
  const auto least = hn::Set(d, -kLatentClip), most = hn::Set(d, kLatentClip);
  const auto below = hn::IfThenElse(hn::Lt(latents, most), latents, most);
  const auto clipped = hn::IfThenElse(hn::Lt(least, below), below, least);
  const auto table = hn::IfThenElse(hn::FirstN(d, kUnitLatent), clipped, hn::Set(d, 1.0f));
  const auto of = [&](const std::uint8_t* lanes) HWY_ATTR {
    return hn::TableLookupLanes(table, hn::IndicesFromVec(d, hn::PromoteTo(di, hn::LoadU(db, lanes))));
  };
  for (std::size_t q = 0; q < tile.products; q += kProductLanes)
    hn::Store(hn::Mul(of(tile.lanes + 2 * q), of(tile.lanes + 2 * q + kProductLanes)), d, p + q);
#else
  float z[16];
  for (std::size_t i = 0; i < kUnitLatent; ++i)
    z[i] = std::max(-kLatentClip, std::min(kLatentClip, tile.z[i] * tile.whitening[i]));
  z[kUnitLatent] = 1;
  for (std::size_t q = 0; q < tile.products; q += kProductLanes) {
    const std::uint8_t* lanes = tile.lanes + 2 * q;
    for (std::size_t i = 0; i < kProductLanes; ++i) p[q + i] = z[lanes[i]] * z[lanes[kProductLanes + i]];
  }
#endif
}

HWY_INLINE void ProductTerm(const TileTerms& tile, const float* HWY_RESTRICT p) {
  SumAllRows<true>(tile.w, tile.rank, tile.k16, tile.scale, tile.products, ProductAt{p}, tile.z);
  if (tile.doubt == nullptr) return;
  HWY_ALIGN float d[16];
  SumAllRows<false>(tile.doubt_of, 3 * kDoubtPoints, 16, tile.whitening + 16, tile.products, ProductAt{p}, d);
  float largest = 0;  // NaNs do not count
  for (std::size_t i = 0; i < kDoubtPoints; ++i) {
    const float x = d[i], y = d[kDoubtPoints + i], z = d[2 * kDoubtPoints + i];
    largest = std::max(largest, x * x + y * y + z * z);
  }
  *tile.doubt = largest;
}

void TermsOfTiles(const TileTerms* HWY_RESTRICT tiles, std::size_t count, const float* HWY_RESTRICT y) {
  alignas(64) float p[kTilesAtOnce][kProductsPadded];
  for (std::size_t t = 0; t < count; ++t) LinearTerm(tiles[t], y);
  for (std::size_t t = 0; t < count; ++t) {
    if (tiles[t].products > 0) LatentProducts(tiles[t], p[t]);
  }
  for (std::size_t t = 0; t < count; ++t) {
    if (tiles[t].products > 0) {
      ProductTerm(tiles[t], p[t]);
    } else if (tiles[t].doubt != nullptr) {
      *tiles[t].doubt = 0;
    }
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace kpsa::engine
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include "base/check.h"

namespace kpsa::engine {

HWY_EXPORT(TermsOfTiles);

void ComputeTileInputs(std::span<const TileTerms> tiles, const float* y) {
  KPSA_DCHECK(tiles.size() <= kTilesAtOnce);
  HWY_DYNAMIC_DISPATCH(TermsOfTiles)(tiles.data(), tiles.size(), y);
}

}  // namespace kpsa::engine
#endif  // HWY_ONCE
