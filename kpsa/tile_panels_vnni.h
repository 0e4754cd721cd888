// The points of a tile on processors with AVX-512 VNNI, which multiplies and sums four bytes at once. The
// integers are exact and the rest is done in the same order, so these are the bits of every other kernel
// (kpsa/tiles.cpp).
#pragma once

#include <cstddef>
#include <cstdint>

#include "base/points.h"
#include "kpsa/rigid_points.h"

namespace kpsa::engine {

// What a frame brings to a tile: x = mean + step * (U q), U's bytes being 128 too large each, bias = 128
// sum(q).
struct TileFrame {
  const std::int16_t* q;  // [4 groups, padded to 32 with zeros], 64-byte aligned
  float step;
  std::int32_t bias;
  PointsView out;            // of the mesh
  const FloatMatrix* space;  // that the points go through; or null
};

bool HasVnni();  // false on other machines; the functions below may only be called where it is true

// u: [panels][groups][32 components][4] bytes; mean: [panels][32 components]; `first`: the first point of the
// first panel. Panels are written up to the padding of the mesh. frames <= kBlockFrames.
void TilePanelsVnni(const std::uint8_t* u, std::size_t panels, std::size_t groups, int components,
                    const float* mean, std::size_t first, const TileFrame* frames, std::size_t frame_count);

}  // namespace kpsa::engine
