// Entries of many matrices at once: relative to others, and against their ranges. Internal to kpsa.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "graph/compute_context.h"

namespace kpsa::engine {

// Entries of one matrix, as it is or after another one: `entries` begin to end, which lie in the columns of the mask.
struct MatrixBlock {
  static constexpr Index kAsItIs = kNoIndex, kAfterSpace = kNoIndex - 1;
  Index matrix = 0;
  Index after = kAsItIs;  // into the matrices it may come after
  std::uint32_t columns = 0;
  std::uint32_t begin = 0, end = 0;
};
struct MatrixEntry {
  std::uint32_t element = 0;  // of a column-major 4x4 matrix
  std::uint32_t row = 0;      // where it goes
};

// raw[row] = element of (after * matrix), with the bits of operator*.
void TakeEntries(std::span<const MatrixBlock> blocks, const MatrixEntry* entries, ArrayView<Matrix4> matrices,
                 const Matrix4* after, const Matrix4& after_space, double* raw);

// The first matrix from `from` on with one of its 12 entries (kpsa/signals.h) beyond [lo, hi], which hold 12 of each;
// matrices.size() if there is none. NaN is beyond.
std::uint32_t FirstBeyond(ArrayView<Matrix4> matrices, std::uint32_t from, const double* lo,
                          const double* hi);

}  // namespace kpsa::engine
