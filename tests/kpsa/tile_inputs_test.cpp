#include "kpsa/tile_inputs.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "base/simd.h"
#include "kpsa/tiles.h"
#include "kpsa/training/tile_builder.h"

namespace kpsa::engine {
namespace {

// A tile of random numbers, and its terms.
struct RandomTile {
  std::size_t rank, k16, count, products;
  bool direct;
  std::vector<std::uint32_t> columns;
  std::vector<std::uint16_t> v, w, doubt_of;
  std::vector<float> scale, whitening;
  std::vector<std::uint8_t> lanes;

  RandomTile(std::size_t rank_of, std::size_t cues, std::size_t product_count, std::size_t inputs,
             unsigned seed, bool is_direct = false)
      : rank(rank_of),
        k16((rank + 15) / 16 * 16),
        count(cues),
        products(product_count),
        direct(is_direct),
        scale(k16),
        whitening(32) {
    std::mt19937 random(seed);
    std::normal_distribution<float> normal;
    for (std::size_t j = 0; j < count; ++j)
      columns.push_back(static_cast<std::uint32_t>(random() % static_cast<unsigned>(inputs)));
    const auto halfs = [&](std::size_t columns_of, std::size_t rows, std::size_t padded) {
      std::vector<std::uint16_t> all(columns_of * padded);
      for (std::size_t i = 0; i < all.size(); ++i)
        all[i] = i % padded < rows ? HalfFromFloat(normal(random)) : std::uint16_t{0};
      return all;
    };
    if (!direct) v = halfs(count, rank, k16);
    w = halfs(products, rank, k16);
    doubt_of = halfs(products, 3 * kDoubtPoints, 16);
    for (std::size_t k = 0; k < rank; ++k) scale[k] = 0.1f * normal(random);
    // Latents up to the clip and beyond
    const std::size_t latents = std::min(rank, kLatents);
    for (std::size_t i = 0; i < latents; ++i) whitening[i] = 10 * normal(random);
    for (std::size_t i = 0; i < 3 * kDoubtPoints; ++i) whitening[16 + i] = normal(random);
    lanes.assign((products + kProductLanes - 1) / kProductLanes * 2 * kProductLanes, kUnitLatent);
    for (std::size_t q = 0; q < products; ++q) {
      for (std::size_t side = 0; side < 2; ++side) {
        const std::size_t latent = random() % (latents + 1);
        lanes[(q / kProductLanes * 2 + side) * kProductLanes + q % kProductLanes] =
            latent == latents ? kUnitLatent : static_cast<std::uint8_t>(latent);
      }
    }
  }

  TileTerms Terms(float* z, float* doubt) const {
    TileTerms terms;
    terms.rank = rank, terms.k16 = k16, terms.count = count, terms.products = products;
    terms.scale = scale.data(), terms.columns = columns.data();
    terms.direct = direct, terms.v = v.data();
    terms.lanes = lanes.data(), terms.whitening = whitening.data();
    terms.w = w.data(), terms.doubt_of = doubt_of.data();
    terms.z = z, terms.doubt = doubt;
    return terms;
  }

  // The definition, value by value: z [rank], then the doubt.
  std::vector<float> Twin(const std::vector<float>& y) const {
    const auto row = [](const std::vector<std::uint16_t>& m, std::size_t padded, std::size_t k,
                        const std::vector<float>& x, float times) {
      float sums[4] = {0, 0, 0, 0};
      for (std::size_t j = 0; j < x.size(); ++j)
        sums[j % 4] = std::fma(FloatFromHalf(m[j * padded + k]), x[j], sums[j % 4]);
      return ((sums[0] + sums[1]) + (sums[2] + sums[3])) * times;
    };
    std::vector<float> cues, z, p;
    for (const std::uint32_t column : columns) cues.push_back(y[column]);
    for (std::size_t k = 0; k < rank; ++k)
      z.push_back(direct ? cues[k] * scale[k] : row(v, k16, k, cues, scale[k]));
    const auto latent = [&](std::uint8_t i) {
      const float value = i == kUnitLatent ? 1 : z[i] * whitening[i];
      return value < -kLatentClip ? -kLatentClip : value < kLatentClip ? value : kLatentClip;
    };
    for (std::size_t q = 0; q < products; ++q) {
      const std::uint8_t* of = lanes.data() + q / kProductLanes * 2 * kProductLanes + q % kProductLanes;
      p.push_back(latent(of[0]) * latent(of[kProductLanes]));
    }
    for (std::size_t k = 0; k < rank && products > 0; ++k) z[k] = z[k] + row(w, k16, k, p, scale[k]);
    float largest = 0;
    for (std::size_t i = 0; i < kDoubtPoints && products > 0; ++i) {
      float squared = 0;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const std::size_t at = axis * kDoubtPoints + i;
        const float value = row(doubt_of, 16, at, p, whitening[16 + at]);
        squared = squared + value * value;
      }
      largest = std::max(largest, squared);
    }
    z.push_back(largest);
    return z;
  }
};

std::vector<float> RandomCues(std::size_t count, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<float> normal;
  std::vector<float> y(count);
  for (float& value : y) value = normal(random);
  return y;
}

// z [rank] and the doubt of some tiles, computed together.
std::vector<std::vector<float>> Computed(const std::vector<RandomTile>& tiles, const std::vector<float>& y) {
  std::vector<std::vector<float>> z;
  std::vector<float> doubts(tiles.size(), -1);
  std::vector<TileTerms> terms;
  for (const RandomTile& tile : tiles) z.emplace_back(tile.k16 + 1, -1.0f);
  for (std::size_t t = 0; t < tiles.size(); ++t)
    terms.push_back(tiles[t].Terms(z[t].data() + 1, &doubts[t]));  // not aligned
  ComputeTileInputs(terms, y.data());
  for (std::size_t t = 0; t < tiles.size(); ++t) {
    z[t].erase(z[t].begin());
    z[t].resize(tiles[t].rank);
    z[t].push_back(doubts[t]);
  }
  return z;
}

TEST(TileInputs, EveryTargetGivesTheBitsOfTheNaiveTwin) {
  constexpr std::size_t kInputs = 50;
  const std::vector<float> y = RandomCues(kInputs, 1);
  unsigned seed = 2;
  for (const std::size_t rank : {1, 8, 9, 16, 17, 24, 25, 32, 40, 47, 48, 49, 57, 64, 70, 256}) {
    std::vector<RandomTile> tiles;
    for (const auto& [cues, products] :
         {std::pair{1, 0}, {2, 1}, {3, 2}, {4, 15}, {5, 16}, {7, 17}, {30, 79}, {0, 3}})
      tiles.emplace_back(rank, static_cast<std::size_t>(cues), static_cast<std::size_t>(products), kInputs,
                         seed++);
    ASSERT_EQ(tiles.size(), kTilesAtOnce);
    for (const char* target : {"avx512", "avx2", "scalar"}) {
      if (!SelectSimdTarget(target)) continue;
      const std::vector<std::vector<float>> z = Computed(tiles, y);
      for (std::size_t t = 0; t < tiles.size(); ++t)
        EXPECT_EQ(z[t], tiles[t].Twin(y)) << target << ", rank " << rank << ", tile " << t;
      // Alone as together
      EXPECT_EQ(Computed({tiles[6]}, y)[0], z[6]) << target;
    }
    SelectSimdTarget("");
  }
}

TEST(TileInputs, DirectTilesAndTilesThatDoNotMoveStandAmongOthers) {
  const std::vector<float> y = RandomCues(9, 3);
  const std::vector<RandomTile> tiles = {RandomTile(12, 7, 20, 9, 4), RandomTile(5, 5, 0, 9, 5, true),
                                         RandomTile(0, 0, 0, 9, 6), RandomTile(3, 9, 6, 9, 7)};
  const std::vector<std::vector<float>> z = Computed(tiles, y);
  for (std::size_t t = 0; t < tiles.size(); ++t) EXPECT_EQ(z[t], tiles[t].Twin(y)) << t;
}

TEST(TileInputs, TheDoubtIsANumberWhateverTheCuesAre) {
  const std::vector<RandomTile> tiles = {RandomTile(14, 20, 30, 20, 8)};
  for (const float bad : {std::nanf(""), INFINITY, -INFINITY}) {
    std::vector<float> y = RandomCues(20, 9);
    y[tiles[0].columns[3]] = bad;
    const float twin = tiles[0].Twin(y).back();
    EXPECT_TRUE(std::isfinite(twin));
    for (const char* target : {"avx512", "avx2", "scalar"}) {
      if (!SelectSimdTarget(target)) continue;
      EXPECT_EQ(Computed(tiles, y)[0].back(), twin) << target;
    }
    SelectSimdTarget("");
  }
}

}  // namespace
}  // namespace kpsa::engine
