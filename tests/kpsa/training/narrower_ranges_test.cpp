#include <gtest/gtest.h>

#include "kpsa/training/range_margins.h"

namespace kpsa::engine {
namespace {

using Indices = std::vector<std::size_t>;

using Expected = std::vector<ExpectedOfMargins>;

// The set that is taken of `expected`, and those that were calibrated on the way.
struct Narrowed {
  std::size_t taken = 0;
  Indices calibrated;
};
Narrowed Narrow(std::size_t chosen, const Expected& expected, const std::vector<double>& missed) {
  Narrowed result;
  const Result<std::size_t> taken = NarrowByCalibration(chosen, expected, [&](std::size_t set) {
    result.calibrated.push_back(set);
    return Result<double>(missed[set]);
  });
  EXPECT_TRUE(taken.ok());
  result.taken = taken.ok() ? *taken : ~std::size_t{0};
  return result;
}

TEST(NarrowerRanges, AreNotTriedWhereTheChosenOnesMissAsExpected) {
  const Narrowed as_expected = Narrow(2, {{0.1, 0.2}, {0.05, 0.15}, {0.0, 0.1}}, {0.1, 0.05, 0.008});
  EXPECT_EQ(as_expected.taken, 2u);
  EXPECT_EQ(as_expected.calibrated, Indices({2}));
  EXPECT_EQ(Narrow(0, {{0.0, 0.1}}, {0.9}).calibrated, Indices({0}));  // nothing is narrower
}

TEST(NarrowerRanges, AreTakenWhereAFrameIsClearlyCheaper) {
  const Narrowed next = Narrow(2, {{0.1, 0.2}, {0.0, 0.1}, {0.0, 0.1}}, {0.1, 0.005, 0.2});
  EXPECT_EQ(next.taken, 1u);
  EXPECT_EQ(next.calibrated, Indices({2, 1}));
  // The next ones miss as many: those after them
  const Narrowed narrowest = Narrow(2, {{0.0, 0.1}, {0.0, 0.1}, {0.0, 0.1}}, {0.01, 0.19, 0.2});
  EXPECT_EQ(narrowest.taken, 0u);
  EXPECT_EQ(narrowest.calibrated, Indices({2, 1, 0}));
  // A few percent of misses are much where a hit costs little
  EXPECT_EQ(Narrow(1, {{0.0, 0.07}, {0.0, 0.06}}, {0.0, 0.035}).taken, 0u);
}

TEST(NarrowerRanges, WideOnesStayWhereNarrowerOnesCostHardlyLess) {
  const Narrowed all_miss = Narrow(2, {{0.0, 0.1}, {0.0, 0.1}, {0.0, 0.1}}, {0.19, 0.4, 0.2});
  EXPECT_EQ(all_miss.taken, 2u);
  EXPECT_EQ(all_miss.calibrated, Indices({2, 1, 0}));
  // Ranges that guard more cost more than what misses less
  EXPECT_EQ(Narrow(1, {{0.0, 0.5}, {0.0, 0.1}}, {0.0, 0.3}).taken, 1u);
}

TEST(NarrowerRanges, ErrorsOfACalibrationEndIt) {
  const Expected expected{{0, 0.1}, {0, 0.1}};
  const Result<std::size_t> failed = NarrowByCalibration(1, expected, [](std::size_t set) {
    return set == 1 ? Result<double>(0.5) : Result<double>(Status::Invalid("no pose"));
  });
  ASSERT_FALSE(failed.ok());
  EXPECT_EQ(failed.status().ToString(), "no pose");
}

}  // namespace
}  // namespace kpsa::engine
