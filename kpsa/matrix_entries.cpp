#include "kpsa/matrix_entries.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kpsa/matrix_entries.cpp"
#include "hwy/foreach_target.h"

#include "base/simd-inl.h"

HWY_BEFORE_NAMESPACE();
namespace kpsa::engine {
namespace HWY_NAMESPACE {

// A column of a matrix is one vector where there are four lanes, else as many as it takes.
using ColumnTag = hn::CappedTag<double, 4>;
constexpr std::size_t kColumnLanes = HWY_MIN(HWY_LANES(double), 4), kColumnVectors = 4 / kColumnLanes;

// Sums in the order of operator*, without fused steps: its bits.
HWY_INLINE void Product(const double* HWY_RESTRICT a, const double* HWY_RESTRICT b, std::uint32_t columns,
                        double* HWY_RESTRICT c) {
  const ColumnTag d;
#pragma GCC unroll 4
  for (std::size_t v = 0; v < kColumnVectors; ++v) {
    const double* HWY_RESTRICT of = a + v * kColumnLanes;
    const auto a0 = hn::LoadU(d, of), a1 = hn::LoadU(d, of + 4), a2 = hn::LoadU(d, of + 8),
               a3 = hn::LoadU(d, of + 12);
#pragma GCC unroll 4
    for (std::size_t column = 0; column < 4; ++column) {
      if ((columns >> column & 1) == 0) continue;
      const double* HWY_RESTRICT by = b + 4 * column;
      auto sum = hn::Mul(a0, hn::Set(d, by[0]));
      sum = hn::Add(sum, hn::Mul(a1, hn::Set(d, by[1])));
      sum = hn::Add(sum, hn::Mul(a2, hn::Set(d, by[2])));
      sum = hn::Add(sum, hn::Mul(a3, hn::Set(d, by[3])));
      hn::Store(sum, d, c + 4 * column + v * kColumnLanes);
    }
  }
}

void TakeEntriesOf(std::span<const MatrixBlock> blocks, const MatrixEntry* HWY_RESTRICT entries,
                   ArrayView<Matrix4> matrices, const Matrix4* HWY_RESTRICT after, const Matrix4& after_space,
                   double* HWY_RESTRICT raw) {
  HWY_ALIGN double product[16];
  for (const MatrixBlock& block : blocks) {
    const double* values = matrices[block.matrix].m.data();
    if (block.after != MatrixBlock::kAsItIs) {
      const Matrix4& a = block.after == MatrixBlock::kAfterSpace ? after_space : after[block.after];
      Product(a.m.data(), values, block.columns, product);
      values = product;
    }
    for (std::uint32_t e = block.begin; e < block.end; ++e) raw[entries[e].row] = values[entries[e].element];
  }
}

// All but the last matrix: the last lane of a column is compared with what follows in lo and hi, and does not count.
std::uint32_t FirstBeyondOf(ArrayView<Matrix4> matrices, std::uint32_t from, const double* HWY_RESTRICT lo,
                            const double* HWY_RESTRICT hi) {
  const ColumnTag d;
  const std::uint32_t count = matrices.size();
  const auto all = hn::FirstN(d, kColumnLanes);
  const auto but_one = hn::FirstN(d, kColumnLanes - 1);
  for (std::uint32_t j = from; j + 1 < count; ++j) {
    const double* m = matrices[j].m.data();
    auto beyond = hn::Not(all);
#pragma GCC unroll 4
    for (std::size_t column = 0; column < 4; ++column) {
#pragma GCC unroll 4
      for (std::size_t v = 0; v < kColumnVectors; ++v) {
        const std::size_t row = v * kColumnLanes, at = 12 * j + 3 * column + row;
        const auto value = hn::LoadU(d, m + 4 * column + row);
        const auto inside =
            hn::And(hn::Ge(value, hn::LoadU(d, lo + at)), hn::Le(value, hn::LoadU(d, hi + at)));
        beyond = hn::Or(beyond, hn::AndNot(inside, v + 1 == kColumnVectors ? but_one : all));
      }
    }
    if (!hn::AllFalse(d, beyond)) return j;
  }
  return count - 1;
}

}  // namespace HWY_NAMESPACE
}  // namespace kpsa::engine
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace kpsa::engine {

HWY_EXPORT(TakeEntriesOf);
HWY_EXPORT(FirstBeyondOf);

void TakeEntries(std::span<const MatrixBlock> blocks, const MatrixEntry* entries, ArrayView<Matrix4> matrices,
                 const Matrix4* after, const Matrix4& after_space, double* raw) {
  if (!blocks.empty())
    HWY_DYNAMIC_DISPATCH(TakeEntriesOf)(blocks, entries, matrices, after, after_space, raw);
}

std::uint32_t FirstBeyond(ArrayView<Matrix4> matrices, std::uint32_t from, const double* lo,
                          const double* hi) {
  const std::uint32_t count = matrices.size();
  if (from >= count) return count;
  const std::uint32_t first = HWY_DYNAMIC_DISPATCH(FirstBeyondOf)(matrices, from, lo, hi);
  if (first + 1 < count) return first;
  const Matrix4& last = matrices[first];
  bool inside = true;
  for (std::size_t e = 0; e < 12; ++e) {
    const double value = last.m[4 * (e / 3) + e % 3];
    inside &= value >= lo[12 * first + e] && value <= hi[12 * first + e];
  }
  return inside ? count : first;
}

}  // namespace kpsa::engine
#endif  // HWY_ONCE
