#include "kpsa/binomial.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace kpsa::engine {
namespace {

TEST(Binomial, KnownIntervals) {
  // Two-sided 95 %, as in tables of Clopper and Pearson's intervals
  struct Row {
    std::size_t k, n;
    double lower, upper;
  };
  for (const Row& row : {Row{0, 100, 0, 0.036217}, Row{5, 100, 0.016432, 0.112835},
                         Row{1, 10, 0.002529, 0.445016}, Row{5, 10, 0.187086, 0.812914},
                         Row{50, 100, 0.398321, 0.601679}, Row{100, 100, 0.963783, 1}, Row{0, 1, 0, 0.975}}) {
    EXPECT_NEAR(BinomialLowerBound(row.k, row.n, 0.975), row.lower, 1e-6) << row.k << " of " << row.n;
    EXPECT_NEAR(BinomialUpperBound(row.k, row.n, 0.975), row.upper, 1e-6) << row.k << " of " << row.n;
  }
}

TEST(Binomial, EndsHaveClosedForms) {
  for (const std::size_t n : {1, 7, 600, 20'000, 1'000'000}) {
    for (const double confidence : {0.5, 0.95, 0.999}) {
      const auto count = static_cast<double>(n);
      const double none = -std::expm1(std::log(1 - confidence) / count);
      EXPECT_NEAR(BinomialUpperBound(0, n, confidence) / none, 1, 1e-9) << n << " " << confidence;
      EXPECT_NEAR(BinomialLowerBound(n, n, confidence), 1 - none, 1e-14) << n << " " << confidence;
      EXPECT_EQ(BinomialLowerBound(0, n, confidence), 0);
      EXPECT_EQ(BinomialUpperBound(n, n, confidence), 1);
      EXPECT_EQ(BinomialUpperBound(n + 1, n, confidence), 1);
      EXPECT_EQ(BinomialLowerBound(n + 1, n, confidence), BinomialLowerBound(n, n, confidence));
    }
  }
  EXPECT_EQ(BinomialUpperBound(0, 0, 0.95), 1);
  EXPECT_EQ(BinomialLowerBound(0, 0, 0.95), 0);
}

// Many samples: normal approximation with Wilson's centre is near; and the bounds are in order.
TEST(Binomial, ManySamples) {
  const std::size_t n = 1'000'000;
  const double z = 1.959963985;
  for (const std::size_t k : {1'000, 10'000, 400'000, 500'000, 990'000}) {
    const double count = n, share = static_cast<double>(k) / count;
    const double centre = (share + z * z / (2 * count)) / (1 + z * z / count);
    const double half =
        z / (1 + z * z / count) * std::sqrt(share * (1 - share) / count + z * z / (4 * count * count));
    EXPECT_NEAR(BinomialLowerBound(k, n, 0.975), centre - half, 2e-6) << k;
    EXPECT_NEAR(BinomialUpperBound(k, n, 0.975), centre + half, 2e-6) << k;
  }
}

TEST(Binomial, GrowsWithCountAndConfidence) {
  double before = 0;
  for (std::size_t k = 0; k <= 300; ++k) {
    const double bound = BinomialUpperBound(k, 300, 0.95);
    EXPECT_GT(bound, before) << k;
    EXPECT_LT(BinomialLowerBound(k, 300, 0.95), bound) << k;
    EXPECT_LT(bound, k < 300 ? BinomialUpperBound(k, 300, 0.99) : 2) << k;
    before = bound;
  }
}

// Whatever the share, the upper bound misses it in 5 % of all samples at most.
TEST(Binomial, CoversAsPromised) {
  std::mt19937 random(1);
  for (const double share : {0.003, 0.01, 0.2}) {
    std::binomial_distribution<std::size_t> draw(600, share);
    int missed = 0;
    for (int i = 0; i < 4000; ++i) missed += BinomialUpperBound(draw(random), 600, 0.95) < share;
    EXPECT_LE(missed, 4000 * 0.05 + 3 * std::sqrt(4000 * 0.05)) << share;
  }
}

}  // namespace
}  // namespace kpsa::engine
