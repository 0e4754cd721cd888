#include "kpsa/matrix_entries.h"

#include <gtest/gtest.h>

#include <cstring>
#include <limits>
#include <random>
#include <vector>

#include "base/matrix.h"
#include "base/simd.h"

namespace kpsa::engine {
namespace {

// Matrices that lie scattered, as the values of a plan do.
class Scattered {
 public:
  Scattered(std::uint32_t count, unsigned seed) : table_{count} {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    values_.resize(2 * count);
    for (std::uint32_t i = 0; i < count; ++i) {
      const std::uint32_t place = 2 * (count - 1 - i);
      for (double& entry : values_[place].m) entry = normal(random);
      table_.push_back(place * static_cast<std::uint32_t>(sizeof(Matrix4)));
    }
  }
  ArrayView<Matrix4> view() const {
    return {reinterpret_cast<const std::byte*>(values_.data()), table_.data()};
  }
  Matrix4& operator[](std::uint32_t i) { return values_[table_[1 + i] / sizeof(Matrix4)]; }

 private:
  std::vector<Matrix4> values_;
  std::vector<std::uint32_t> table_;
};

template <typename F>
void OnEverySimdTarget(F&& body) {
  for (const char* target : {"avx512", "avx2", "neon", "scalar"}) {
    if (!SelectSimdTarget(target)) continue;
    body(target);
  }
  SelectSimdTarget("");
}

TEST(MatrixEntries, AreThoseOfTheProductBitForBit) {
  Scattered matrices(9, 1);
  const Scattered after_of(3, 2);
  const std::vector<Matrix4> after = {after_of.view()[0], after_of.view()[1], after_of.view()[2]};
  Matrix4 space = after[0];
  matrices[4](1, 2) = std::numeric_limits<double>::quiet_NaN();
  std::mt19937 random(3);
  std::vector<MatrixBlock> blocks;
  std::vector<MatrixEntry> entries;
  std::vector<double> expected;
  for (Index m = 0; m < 9; ++m) {
    for (const Index of : {Index{0}, Index{2}, MatrixBlock::kAfterSpace, MatrixBlock::kAsItIs}) {
      MatrixBlock block{m, of, 0, static_cast<std::uint32_t>(entries.size()), 0};
      const Matrix4& matrix = matrices.view()[m];
      const Matrix4 product = of == MatrixBlock::kAsItIs       ? matrix
                              : of == MatrixBlock::kAfterSpace ? space * matrix
                                                               : after[of] * matrix;
      const int count = 1 + static_cast<int>(random() % 12);
      for (int e = 0; e < count; ++e) {
        const std::uint32_t element = 4 * static_cast<std::uint32_t>(random() % 4) + random() % 3;
        block.columns |= 1u << element / 4;
        entries.push_back({element, static_cast<std::uint32_t>(entries.size())});
        expected.push_back(product.m[element]);
      }
      block.end = static_cast<std::uint32_t>(entries.size());
      blocks.push_back(block);
    }
  }
  OnEverySimdTarget([&](const char* target) {
    std::vector<double> raw(entries.size(), 7);
    TakeEntries(blocks, entries.data(), matrices.view(), after.data(), space, raw.data());
    for (std::size_t i = 0; i < raw.size(); ++i) {
      if (expected[i] != expected[i]) {
        EXPECT_NE(raw[i], raw[i]) << target;
      } else {
        EXPECT_EQ(std::memcmp(&raw[i], &expected[i], sizeof(double)), 0) << target << ", entry " << i;
      }
    }
  });
}

TEST(MatrixEntries, BeyondTheirRangesAreFoundOneAfterTheOther) {
  constexpr std::uint32_t kCount = 7;
  // Exactly at the ends of its ranges, and of its last row nothing is asked
  const Scattered inside(kCount, 5);
  std::vector<double> lo, hi;
  for (std::uint32_t j = 0; j < kCount; ++j) {
    for (std::size_t e = 0; e < 12; ++e) {
      const double value = inside.view()[j].m[4 * (e / 3) + e % 3];
      lo.push_back(value), hi.push_back(value);
    }
  }
  // What is read beside a range, that of the next entry, says nothing
  const auto found = [&](const Scattered& matrices) {
    std::vector<std::uint32_t> all;
    for (std::uint32_t j = FirstBeyond(matrices.view(), 0, lo.data(), hi.data()); j < kCount;
         j = FirstBeyond(matrices.view(), j + 1, lo.data(), hi.data()))
      all.push_back(j);
    return all;
  };
  OnEverySimdTarget([&](const char* target) {
    EXPECT_TRUE(found(inside).empty()) << target;
    for (std::uint32_t j = 0; j < kCount; ++j) {
      for (std::size_t e = 0; e < 16; ++e) {
        for (const double to : {-100.0, 100.0, std::numeric_limits<double>::quiet_NaN()}) {
          Scattered moved = inside;
          moved[j].m[e] = to;
          moved[3](0, 0) = 100;
          std::vector<std::uint32_t> expected{3};
          if (e % 4 != 3 && j != 3) expected.insert(j < 3 ? expected.begin() : expected.end(), j);
          EXPECT_EQ(found(moved), expected) << target << ", matrix " << j << ", element " << e << ", " << to;
        }
      }
    }
  });
  EXPECT_EQ(FirstBeyond(inside.view(), kCount, lo.data(), hi.data()), kCount);
}

}  // namespace
}  // namespace kpsa::engine
