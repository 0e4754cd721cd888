#include "kpsa/calibration.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "tests/kpsa/synthetic.h"

namespace kpsa {
namespace {

using test::kInfinity;

// Scores and errors that go together, with exceptions: a score may be low although the error is large.
std::vector<CalibrationPair> RandomPairs(std::size_t count, unsigned seed) {
  std::mt19937 random(seed);
  std::lognormal_distribution<double> size(0, 0.6), noise(0, 0.35);
  std::vector<CalibrationPair> pairs;
  for (std::size_t i = 0; i < count; ++i) {
    const double difficulty = size(random);
    pairs.push_back({difficulty * noise(random), 0.001 * difficulty * noise(random)});
  }
  return pairs;
}

std::size_t Violations(std::span<const CalibrationPair> pairs, const SoftCacheThreshold& threshold,
                       double tolerance) {
  std::size_t count = 0;
  for (const CalibrationPair& pair : pairs)
    count += FullWeight(pair.score, threshold) < 1 && EmittedError(pair, threshold) > tolerance * (1 + 1e-9);
  return count;
}

TEST(Calibration, IsTheLargestThresholdThatABruteForceSearchFinds) {
  for (unsigned seed = 1; seed <= 6; ++seed) {
    const std::vector<CalibrationPair> pairs = RandomPairs(150, seed);
    for (const double alpha : {0.02, 0.1, 0.3}) {
      const Calibration c = Calibrate(pairs, 0.0015, alpha, 0.7);
      double best = -1;
      for (int i = 1; i <= 10000; ++i) {
        const double tau = 20.0 * i / 10000;
        const auto violations =
            static_cast<double>(Violations(pairs, {.tau = tau, .blend_start = 0.7}, 0.0015));
        const auto hits = static_cast<double>(std::count_if(
            pairs.begin(), pairs.end(), [&](const CalibrationPair& p) { return p.score <= 0.7 * tau; }));
        if ((violations + 1) / 151 <= alpha && violations <= 2 * alpha * hits) best = tau;
      }
      const double cap = std::max_element(pairs.begin(), pairs.end(),
                                          [](const auto& a, const auto& b) { return a.score < b.score; })
                             ->score /
                         0.7;
      EXPECT_NEAR(c.threshold.tau, std::min(best, cap), 0.0021) << seed << " " << alpha;
      EXPECT_EQ(c.violations, Violations(pairs, c.threshold, 0.0015));
      EXPECT_LE(static_cast<double>(c.violations + 1) / 151, alpha);
    }
  }
}

TEST(Calibration, ViolationsOverAHundredSplitsStayWithinTheRate) {
  const std::vector<CalibrationPair> all = RandomPairs(2000, 7);
  std::mt19937 random(8);
  for (const double alpha : {0.01, 0.05}) {
    double rate = 0, hits = 0;
    for (int split = 0; split < 100; ++split) {
      std::vector<CalibrationPair> pairs = all;
      std::shuffle(pairs.begin(), pairs.end(), random);
      const std::span<const CalibrationPair> calibration(pairs.data(), 300), fresh(pairs.data() + 300, 1700);
      const Calibration c = Calibrate(calibration, 0.002, alpha);
      rate += static_cast<double>(Violations(fresh, c.threshold, 0.002)) / 1700 / 100;
      hits += c.hit_rate / 100;
    }
    EXPECT_LE(rate, alpha * 1.05) << "expected at most alpha, up to the noise of 100 splits";
    EXPECT_GT(rate, alpha * 0.3) << "a threshold that is never used up is too careful";
    EXPECT_GT(hits, 0.3);
  }
}

TEST(Calibration, LooserDemandsGiveLargerThresholds) {
  const std::vector<CalibrationPair> pairs = RandomPairs(400, 9);
  double last = -1;
  for (const double tolerance : {0.0005, 0.001, 0.002, 0.004}) {
    const double tau = Calibrate(pairs, tolerance, 0.05).threshold.tau;
    EXPECT_GT(tau, last);
    last = tau;
  }
  last = -1;
  for (const double alpha : {0.005, 0.02, 0.1, 0.3}) {
    const double tau = Calibrate(pairs, 0.001, alpha).threshold.tau;
    EXPECT_GE(tau, last);
    last = tau;
  }
  EXPECT_GT(last, Calibrate(pairs, 0.001, 0.005).threshold.tau);
}

TEST(Calibration, TooFewPosesSayWhatTheyCanPromise) {
  const std::vector<CalibrationPair> pairs = RandomPairs(19, 10);
  const Calibration c = Calibrate(pairs, 0.0015, 0.01);
  EXPECT_FALSE(c.enough_poses);
  EXPECT_DOUBLE_EQ(c.attainable_alpha, 1.0 / 20);
  EXPECT_EQ(c.violations, 0u);
  EXPECT_GT(c.threshold.tau, 0);
  EXPECT_NE(c.warning.find("19 calibration poses cannot promise a violation rate of 0.01; the threshold "
                           "keeps 0.05 (at least 99 poses"),
            std::string::npos)
      << c.warning;
  EXPECT_TRUE(Calibrate(RandomPairs(99, 10), 0.0015, 0.01).enough_poses);
}

TEST(Calibration, TheEnds) {
  const std::vector<CalibrationPair> pairs = RandomPairs(200, 11);
  EXPECT_LT(Calibrate(pairs, 0, 0.01).threshold.tau, 0);
  EXPECT_LT(Calibrate(pairs, -1, 0.01).threshold.tau, 0);
  EXPECT_LT(Calibrate(pairs, std::nan(""), 0.01).threshold.tau, 0);
  EXPECT_EQ(Calibrate(pairs, kInfinity, 0.01).threshold.tau, kInfinity);
  EXPECT_LT(Calibrate({}, 0.001, 0.01).threshold.tau, 0);
  EXPECT_FALSE(Calibrate({}, 0.001, 0.01).warning.empty());
  // No pose forbids anything: everything that was seen is a hit, and nothing beyond it
  const Calibration loose = Calibrate(pairs, 100, 0.01);
  EXPECT_EQ(loose.hit_rate, 1);
  EXPECT_TRUE(std::isfinite(loose.threshold.tau));
  // Errors at score zero cannot be told from good poses: never a hit
  const std::vector<CalibrationPair> blind(200, CalibrationPair{0, 1});
  const Calibration none = Calibrate(blind, 0.001, 0.01);
  EXPECT_LT(none.threshold.tau, 0);
  EXPECT_FALSE(none.warning.empty());
}

TEST(Calibration, AFewHitsMayNotAllBeViolations) {
  // Eight poses with small scores and large errors: 2 % of all, and all that would hit
  std::vector<CalibrationPair> pairs(400, CalibrationPair{10, 0.01});
  for (int i = 0; i < 8; ++i) pairs[static_cast<std::size_t>(50 * i)] = {1, 0.005};
  EXPECT_EQ(Calibrate(pairs, 0.001, 0.03).hit_rate, 0);
  EXPECT_EQ(Calibrate(pairs, 0.001, 0.03).violations, 0u);
  // Where most poses are good ones, the same eight are within the rate
  for (std::size_t i = 0; i < 400; ++i) {
    if (pairs[i].score > 1) pairs[i] = {2, 0.0005};
  }
  EXPECT_EQ(Calibrate(pairs, 0.001, 0.03).hit_rate, 1);
}

TEST(Calibration, PosesWithoutANumberCountAsViolations) {
  std::vector<CalibrationPair> pairs(100, CalibrationPair{1, 0.0001});
  EXPECT_GT(Calibrate(pairs, 0.001, 0.02).threshold.tau, 0);
  pairs[0].error = pairs[1].error = std::nan("");
  EXPECT_LT(Calibrate(pairs, 0.001, 0.02).threshold.tau, 0);
  pairs[1].error = kInfinity;
  pairs[1].score = 50;  // far above the others: no harm
  EXPECT_GT(Calibrate(pairs, 0.001, 0.02).threshold.tau, 0);
}

}  // namespace
}  // namespace kpsa
