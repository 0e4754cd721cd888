#include "kpsa/calibration.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "kpsa/binomial.h"
#include "kpsa/training/poses.h"
#include "tests/kpsa/synthetic.h"

namespace kpsa::engine {
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

// Pairs of several kinds, some with a guard that asks for a part of the full evaluation.
std::vector<CalibrationPair> MixedPairs(std::size_t count, unsigned seed) {
  std::vector<CalibrationPair> pairs = RandomPairs(count, seed);
  std::mt19937 random(seed + 100);
  std::uniform_real_distribution<double> unit(0, 1);
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    pairs[i].kind = static_cast<int>(i % 3);
    if (pairs[i].kind == 2) pairs[i].error *= 1.5;
    if (pairs[i].kind == 1 && unit(random) < 0.4) pairs[i].guard = unit(random) < 0.3 ? 1 : unit(random);
  }
  return pairs;
}

// The demands of the header, counted pose by pose.
bool IsAllowed(std::span<const CalibrationPair> pairs, const SoftCacheThreshold& threshold, double tolerance,
               double alpha) {
  std::size_t violations = 0, hits = 0, severe = 0;
  const auto attainable = [](double rate, std::size_t n) {
    return std::max(rate, BinomialUpperBound(0, n, 0.9));
  };
  const auto few = [](std::size_t v, std::size_t h, double rate) {
    const double among_hits = std::min(1.0, 2 * rate);
    return static_cast<double>(v + 1) <= among_hits * static_cast<double>(h + 1) &&
           BinomialUpperBound(v, h, 0.9) <= among_hits * (1 + 1e-9);
  };
  std::size_t fewest = pairs.size();
  bool good = true;
  for (int kind = 0; kind < 3; ++kind) {
    std::vector<CalibrationPair> of_kind;
    for (const CalibrationPair& pair : pairs) {
      if (pair.kind == kind) of_kind.push_back(pair);
    }
    if (of_kind.empty()) continue;
    fewest = std::min(fewest, of_kind.size());
    const double rate = attainable(alpha, of_kind.size());
    const std::size_t v = Violations(of_kind, threshold, tolerance);
    const auto h = static_cast<std::size_t>(std::count_if(
        of_kind.begin(), of_kind.end(), [&](const auto& p) { return EmittedWeight(p, threshold) == 0; }));
    const auto accepted = static_cast<std::size_t>(std::count_if(
        of_kind.begin(), of_kind.end(), [&](const auto& p) { return EmittedWeight(p, threshold) < 1; }));
    good = good && BinomialUpperBound(v, of_kind.size(), 0.9) <= rate * (1 + 1e-9) &&
           (v == 0 || few(v, accepted, rate));
    violations += v, hits += h, severe += Violations(of_kind, threshold, 3 * tolerance);
  }
  return good && few(violations, hits, attainable(alpha, fewest)) &&
         BinomialUpperBound(severe, pairs.size(), 0.9) <= attainable(alpha / 10, pairs.size()) * (1 + 1e-9);
}

// The score above which most poses within the ranges are wrong, however few of them are looked at.
double MostlyRight(std::span<const CalibrationPair> pairs, double tolerance) {
  const auto told = [](const CalibrationPair& p) {
    return p.guard == 0 && p.kind != static_cast<int>(PoseKind::kBeyond) && std::isfinite(p.score);
  };
  double largest = kInfinity;
  std::vector<double> scores{0};
  for (const CalibrationPair& p : pairs) {
    if (told(p)) scores.push_back(p.score);
  }
  std::ranges::sort(scores);
  for (std::size_t i = scores.size(); i-- > 0;) {
    bool wrong = true;  // mostly, from here up to any of the others
    for (std::size_t j = i + 1; j < scores.size() && wrong; ++j) {
      std::ptrdiff_t lead = 0;
      for (const CalibrationPair& p : pairs) {
        if (told(p) && p.score > scores[i] && p.score <= scores[j]) lead += p.error <= tolerance ? 1 : -1;
      }
      wrong = lead < 0;
    }
    if (wrong) largest = i + 1 == scores.size() ? kInfinity : scores[i];
  }
  return largest;
}

TEST(Calibration, IsTheLargestThresholdThatABruteForceSearchFinds) {
  int found = 0;
  for (unsigned seed = 1; seed <= 4; ++seed) {
    const std::vector<CalibrationPair> pairs = MixedPairs(450, seed);
    for (const double alpha : {0.02, 0.1, 0.3}) {
      for (const double tolerance : {0.0008, 0.0025}) {
        const Calibration c = Calibrate(pairs, tolerance, alpha, 0.7);
        const double cap = std::max_element(pairs.begin(), pairs.end(),
                                            [](const auto& a, const auto& b) { return a.score < b.score; })
                               ->score /
                           0.7;  // some are wrong, so no farther
        const double right = MostlyRight(pairs, tolerance);
        double best = -1;
        constexpr int kSteps = 4000;
        for (int i = 1; i <= kSteps; ++i) {
          const double tau = cap * i / kSteps;
          if (0.7 * tau <= right && IsAllowed(pairs, {.tau = tau, .blend_start = 0.7}, tolerance, alpha))
            best = tau;
        }
        EXPECT_GE(c.threshold.tau, best) << seed << " " << alpha;
        if (c.threshold.tau > 0) {
          ++found;
          EXPECT_LE(c.threshold.tau, best + 2 * cap / kSteps) << seed << " " << alpha;
          EXPECT_TRUE(IsAllowed(pairs, c.threshold, tolerance, alpha)) << seed << " " << alpha;
          EXPECT_EQ(c.violations, Violations(pairs, c.threshold, tolerance));
        }
      }
    }
  }
  EXPECT_GT(found, 12) << "most of these can be met";
}

// Beyond the largest score that was seen, where all errors that were seen leave a margin: they grow with its square at most.
TEST(Calibration, ReachesBeyondWhatWasSeenWhereAllOfThatIsRight) {
  std::vector<CalibrationPair> pairs(450);
  for (std::size_t i = 0; i < pairs.size(); ++i)
    pairs[i].score = static_cast<double>(i) / 449, pairs[i].error = 0.25 * pairs[i].score;
  const auto tau = [&](double tolerance) { return Calibrate(pairs, tolerance, 0.03, 0.5).threshold.tau; };
  EXPECT_NEAR(tau(0.25), 2, 1e-9) << "the worst is just right: as far as was seen";
  EXPECT_NEAR(tau(0.36), 2 * 1.2, 1e-9);
  EXPECT_NEAR(tau(25), 2 * kMostBeyondSeen, 1e-9);
  pairs[7].error = 0.36;
  EXPECT_NEAR(tau(0.36), 2, 1e-9) << "whichever pose has it";
  pairs[7].guard = 1;
  EXPECT_NEAR(tau(0.36), 2 * 1.2, 1e-9) << "a pose that is evaluated fully says nothing";
  pairs[7].error = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NEAR(tau(0.36), 2 * 1.2, 1e-9);
  pairs[7].guard = 0;
  EXPECT_LE(tau(0.36), 2);
}

// A promise is about the training at hand: not on the average over trainings, but in nine of ten.
TEST(Calibration, NineOfTenTrainingsKeepTheirRate) {
  const std::vector<CalibrationPair> all = RandomPairs(6000, 7);
  std::mt19937 random(8);
  for (const double alpha : {0.01, 0.03, 0.05}) {
    const std::size_t poses = alpha < 0.02 ? 800 : 400, rest = all.size() - poses;
    int above = 0, above_among_hits = 0, severe_above = 0;
    double hits = 0, rate = 0;
    for (int split = 0; split < 300; ++split) {
      std::vector<CalibrationPair> pairs = all;
      std::shuffle(pairs.begin(), pairs.end(), random);
      const std::span<const CalibrationPair> fresh(pairs.data() + poses, rest);
      const Calibration c = Calibrate({pairs.data(), poses}, 0.002, alpha);
      const auto violations = static_cast<double>(Violations(fresh, c.threshold, 0.002));
      const auto fresh_hits = static_cast<double>(std::count_if(
          fresh.begin(), fresh.end(), [&](const auto& p) { return EmittedWeight(p, c.threshold) == 0; }));
      above += violations > alpha * static_cast<double>(rest);
      above_among_hits += violations > 2 * alpha * fresh_hits;
      severe_above += static_cast<double>(Violations(fresh, c.threshold, 0.006)) >
                      c.attainable_severe * static_cast<double>(rest);
      rate += violations / static_cast<double>(rest) / 300;
      hits += c.hit_rate / 300;
    }
    EXPECT_LE(above, 30) << "of 300 at " << alpha;
    EXPECT_LE(above_among_hits, 30) << "of 300 at " << alpha;
    EXPECT_LE(severe_above, 30) << "of 300 at " << alpha;
    EXPECT_GT(rate, alpha * 0.15) << "a threshold that is never used up is too careful";
    EXPECT_GT(hits, 0.2);
  }
}

TEST(Calibration, ALargerToleranceNeverHitsLess) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    const std::vector<CalibrationPair> pairs = MixedPairs(600, seed);
    for (const double alpha : {0.01, 0.05}) {
      std::size_t last = 0;
      double last_tau = -1;
      for (int i = 0; i <= 60; ++i) {
        const Calibration c = Calibrate(pairs, 1e-4 * std::exp(0.1 * i), alpha);
        EXPECT_GE(c.hits, last) << "seed " << seed << ", tolerance " << i;
        EXPECT_GE(c.threshold.tau, last_tau);
        last = c.hits, last_tau = c.threshold.tau;
      }
      EXPECT_GT(last, 200u);
    }
  }
}

TEST(Calibration, EveryKindKeepsTheRateByItself) {
  std::vector<CalibrationPair> pairs(500, CalibrationPair{1, 1e-4, 0, 0});
  for (int i = 0; i < 500; ++i) pairs.push_back({1.1, i % 8 == 0 ? 0.0015 : 1e-4, 0, 1});
  // 6 % of all, but 12 % of the second kind
  EXPECT_EQ(Calibrate(pairs, 0.001, 0.08).hit_rate, 0.5);
  for (CalibrationPair& pair : pairs) pair.kind = 0;
  EXPECT_EQ(Calibrate(pairs, 0.001, 0.08).hit_rate, 1);
}

TEST(Calibration, WhatAGuardHandsToTheFullEvaluationDoesNoHarm) {
  std::vector<CalibrationPair> pairs(400, CalibrationPair{1, 1e-4});
  for (std::size_t i = 0; i < 400; i += 4) pairs[i] = {0.9, 0.0018, 0, 0};
  EXPECT_EQ(Calibrate(pairs, 0.001, 0.05).hit_rate, 0);
  for (std::size_t i = 0; i < 400; i += 4) pairs[i].guard = 0.5;
  const Calibration half = Calibrate(pairs, 0.001, 0.05);
  EXPECT_EQ(half.hit_rate, 0.75);
  EXPECT_EQ(half.accepted_rate, 1);
  EXPECT_NEAR(half.worst_error, 0.0009, 1e-12);
  for (std::size_t i = 0; i < 400; i += 4) pairs[i].guard = 1;
  EXPECT_EQ(Calibrate(pairs, 0.001, 0.05).accepted_rate, 0.75);
}

TEST(Calibration, FewViolationsMayBeSevere) {
  std::vector<CalibrationPair> pairs(1000, CalibrationPair{1, 1e-4});
  for (std::size_t i = 0; i < 20; ++i) pairs[50 * i] = {1, 0.002};
  EXPECT_EQ(Calibrate(pairs, 0.001, 0.05).hit_rate, 1) << "2 % are a little beyond";
  for (std::size_t i = 0; i < 20; ++i) pairs[50 * i] = {1, 0.0031};
  EXPECT_EQ(Calibrate(pairs, 0.001, 0.05).hit_rate, 0) << "2 % are beyond three tolerances";
  for (std::size_t i = 1; i < 20; ++i) pairs[50 * i] = {1, 0.002};
  const Calibration few = Calibrate(pairs, 0.001, 0.05);
  EXPECT_EQ(few.hit_rate, 1) << "0.1 % are";
  EXPECT_EQ(few.severe, 1u);
  EXPECT_EQ(few.worst, 0u);
}

TEST(Calibration, LooserDemandsGiveLargerThresholds) {
  const std::vector<CalibrationPair> pairs = RandomPairs(1000, 9);
  double last = -1;
  for (const double tolerance : {0.0015, 0.002, 0.004}) {
    const double tau = Calibrate(pairs, tolerance, 0.05).threshold.tau;
    EXPECT_GT(tau, last);
    last = tau;
  }
  last = -1;
  for (const double alpha : {0.005, 0.02, 0.1, 0.3}) {
    const double tau = Calibrate(pairs, 0.0015, alpha).threshold.tau;
    EXPECT_GE(tau, last);
    last = tau;
  }
  EXPECT_GT(last, Calibrate(pairs, 0.0015, 0.005).threshold.tau);
}

TEST(Calibration, TooFewPosesSayWhatTheyCanPromise) {
  const std::vector<CalibrationPair> pairs = RandomPairs(19, 10);
  const Calibration c = Calibrate(pairs, 0.0015, 0.01);
  EXPECT_FALSE(c.enough_poses);
  EXPECT_NEAR(c.attainable_alpha, 1 - std::pow(0.1, 1.0 / 19), 1e-9);
  EXPECT_EQ(c.violations, 0u);
  EXPECT_GT(c.threshold.tau, 0);
  EXPECT_NE(c.warning.find("19 calibration poses cannot promise a violation rate of 0.01; the threshold "
                           "keeps 0.114 (at least 230 poses"),
            std::string::npos)
      << c.warning;
  EXPECT_TRUE(Calibrate(RandomPairs(230, 10), 0.0015, 0.01).enough_poses);
  EXPECT_FALSE(Calibrate(RandomPairs(229, 10), 0.0015, 0.01).enough_poses);
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
  // Six poses with small scores and large errors: 1.5 % of all, and all that would hit
  std::vector<CalibrationPair> pairs(400, CalibrationPair{10, 0.01});
  for (int i = 0; i < 6; ++i) pairs[static_cast<std::size_t>(50 * i)] = {1, 0.002};
  EXPECT_EQ(Calibrate(pairs, 0.001, 0.03).hit_rate, 0);
  EXPECT_EQ(Calibrate(pairs, 0.001, 0.03).violations, 0u);
  // Where most poses are good ones, the same six are within the rate
  for (std::size_t i = 0; i < 400; ++i) {
    if (pairs[i].score > 1) pairs[i] = {2, 0.0005};
  }
  EXPECT_EQ(Calibrate(pairs, 0.001, 0.03).hit_rate, 1);
}

TEST(Calibration, PosesWithoutANumberCountAsViolations) {
  std::vector<CalibrationPair> pairs(2000, CalibrationPair{1, 0.0001});
  EXPECT_GT(Calibrate(pairs, 0.001, 0.02).threshold.tau, 0);
  pairs[0].error = pairs[1].error = std::nan("");
  EXPECT_LT(Calibrate(pairs, 0.001, 0.02).threshold.tau, 0);
  pairs[1].error = kInfinity;
  pairs[1].score = 50;  // far above the others: no harm
  EXPECT_GT(Calibrate(pairs, 0.001, 0.02).threshold.tau, 0);
}

}  // namespace
}  // namespace kpsa::engine
