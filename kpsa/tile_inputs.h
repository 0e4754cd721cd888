// What U of a tile is multiplied by (kpsa/tiles.h): z = scale (V y_J + W p), p the products of its first
// latents, and the tile's doubt. Internal to TileMap.
//
// Order of the floating-point operations, the same on every SIMD target: a row of V, W or the doubt is four
// sums of fused products, of columns 0, 4, 8 .., of 1, 5, 9 .. and so on; (first + second) + (third +
// fourth), times its scale.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace kpsa::engine {

inline constexpr std::size_t kProductLanes = 16;  // products that are computed at a time
inline constexpr std::size_t kTilesAtOnce = 8;

// What a tile reads, and where its results go.
struct TileTerms {
  std::size_t rank = 0, k16 = 0;           // rows of V and W
  std::size_t count = 0;                   // |J|
  std::size_t products = 0;                // P
  bool direct = false;                     // z = scale y_J entry by entry, k = |J|
  const float* scale = nullptr;            // [k16]
  const std::uint16_t* v = nullptr;        // [count][k16] halfs; nothing for direct tiles
  const std::uint32_t* columns = nullptr;  // [count] J
  // With products:
  const std::uint8_t* lanes = nullptr;      // [P / 16, rounded up][2][16] first latents, then second ones
  const float* whitening = nullptr;         // [32] of the latents, then the scale of the doubt
  const std::uint16_t* w = nullptr;         // [P][k16] halfs
  const std::uint16_t* doubt_of = nullptr;  // [P][16] halfs
  float* z = nullptr;                       // [k16]; direct tiles leave what is beyond their cues
  float* doubt = nullptr;                   // the square of the largest; null where nobody asks
};

// At most kTilesAtOnce of one frame: step by step through all of them, so that what a tile waits for is the
// work of the others.
void ComputeTileInputs(std::span<const TileTerms> tiles, const float* y);

}  // namespace kpsa::engine
