// Positions of many frames as few modes with whole numbers, as a report carries them (docs/viewer-data.md), and what
// is left of a second evaluation of the same frames.
//
// Glossary: V vertices, R rows (a frame each), K modes, Q the largest whole number (127 or 32767). Row r is
//   rest + sum over k of rows[r, k] * scale[k] / Q * basis[k]
// in float32. Modes are the principal components of the rows less the rest shape. After a mode is rounded to whole
// numbers, the next ones are those of what it leaves, its rounding included: so a mode that moves points far is
// followed by another that corrects it, and bytes do for most shapes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/status.h"
#include "host/watch.h"

namespace kpsa::engine {

inline constexpr std::size_t kMostPageModes = 256;  // that the page reads

struct PageShape {
  std::size_t modes = 0;            // K; one of zeros where nothing moves
  int largest = 127;                // Q
  std::vector<std::int16_t> basis;  // [K, V, 3] within +-Q
  std::vector<float> scale;         // [K]
  std::vector<float> rows;          // [R, K]
  double precision = 0;  // metres: the largest distance of a position from the true one, over all rows
};

// As few modes as come within `wanted` metres of all rows, or as near as kMostPageModes do. rest, and each of rows:
// [V, 3], metres, finite. The watch counts modes.
Result<PageShape> FitShape(std::span<const float> rest, const std::vector<std::span<const float>>& rows,
                           double wanted, const Watch& watch);
// What the page makes of a row: [V, 3].
std::vector<float> ShapePositions(const PageShape& shape, std::span<const float> rest, std::size_t row);

// Full less accelerated positions of a clip's frames, in whole steps.
struct PageResidual {
  double step = 0;                   // metres
  bool wide = false;                 // values need 16 bits
  std::vector<int> frame_rows;       // [frames] or -1: no difference
  std::vector<std::int16_t> values;  // [rows, V, 3]
};
// Each of full and accelerated: [V, 3], as many frames. Where a difference is beyond 32767 steps, the step is
// larger than asked for.
PageResidual FitResidual(const std::vector<std::span<const float>>& full,
                         const std::vector<std::span<const float>>& accelerated, double step);

}  // namespace kpsa::engine
