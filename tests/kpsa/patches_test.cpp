// Patches that miss by themselves: their layout, their points and borders, which regions are evaluated, and
// what calibration makes of them.
#include "kpsa/patches.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>
#include <random>

#include "kpsa/tiles.h"
#include "kpsa/training/frame_cost.h"

namespace kpsa::engine {
namespace {

TEST(Patches, EveryLevelHoldsEveryPatchOnce) {
  std::mt19937 random(1);
  for (int round = 0; round < 300; ++round) {
    std::vector<std::size_t> tiles(1 + random() % (round % 3 == 0 ? 20 : 3));
    for (std::size_t& of : tiles) of = random() % (round % 2 == 0 ? 300 : 12);
    std::size_t all = 0;
    for (const std::size_t of : tiles) all += of;
    const PatchLayout layout = MakePatchLayout(tiles);
    SCOPED_TRACE(testing::Message() << round << ": " << all << " tiles of " << tiles.size() << " outputs");
    EXPECT_EQ(layout.tiles > 0, all >= kFewestTiles);
    EXPECT_LE(layout.regions.size(), kMaxRegions);
    std::size_t patches = 0;
    for (std::size_t m = 0; m < tiles.size() && layout.tiles > 0; ++m) {
      const std::size_t count = (tiles[m] + layout.tiles - 1) / layout.tiles;
      for (Index level = 0, levels = 1; level < levels; ++level) {
        Index next = static_cast<Index>(patches);
        for (const PatchRegion& region : layout.regions) {
          if (region.output != m) continue;
          levels = std::max(levels, region.level + 1);
          if (region.level != level) continue;
          EXPECT_EQ(region.first, next);
          next += region.count;
          if (level == 0) continue;
          // Two of the level below, or one
          Index below = region.first;
          for (Index b = region.below; b < region.below + region.belows; ++b) {
            EXPECT_EQ(layout.regions[b].level + 1, level);
            EXPECT_EQ(layout.regions[b].first, below);
            below += layout.regions[b].count;
          }
          EXPECT_EQ(below, next);
        }
        if (count > 0) {
          EXPECT_EQ(next, patches + count) << "level " << level;
        }
      }
      patches += count;
    }
    if (layout.tiles > 0) {
      EXPECT_EQ(layout.patches, patches);
    }
  }
  EXPECT_EQ(MakePatchLayout(std::vector<std::size_t>(kMaxPatches + 1, 5)).tiles, 0u) << "too many outputs";
}

// A square grid of 32 x 32 points, tile after tile four rows of it.
std::vector<Double3> Grid() {
  std::vector<Double3> points;
  for (int i = 0; i < 1024; ++i) points.push_back({0.5 * (i % 32), 0.5 * (i / 32), 0});
  return points;
}

TEST(Patches, GoOverIntoTheRestWithinThreeDistances) {
  std::vector<Double3> grid = Grid();
  const double nan = std::nan("");
  grid[1000] = {nan, 0, 0};
  const std::vector<PatchPoints> patches = MakePatches(std::vector<PlacedOutput>{{grid}}, 2);
  ASSERT_EQ(patches.size(), 4u);
  for (std::size_t p = 0; p < patches.size(); ++p) {
    std::vector<double> weights(1024, 0.0);
    for (std::size_t i = 0; i < patches[p].points.size(); ++i)
      weights[patches[p].points[i]] = static_cast<double>(patches[p].weights[i]);
    for (int i = 0; i < 1024; ++i) {
      const int row = i / 32, first = static_cast<int>(8 * p);
      const int away = row < first ? first - row : row >= first + 8 ? row - first - 7 : 0;
      if (i == 1000) {
        EXPECT_EQ(weights[1000], p == 3 ? 1 : 0) << "lies nowhere, so only where it belongs";
      } else if (i % 32 != 8 || row < 28) {  // the neighbours of that point may be nearer to others
        const double t = away / 3.0;
        EXPECT_NEAR(weights[static_cast<std::size_t>(i)], t >= 1 ? 0 : 1 - t * t * (3 - 2 * t), 1e-6)
            << p << " " << i;
      }
    }
  }
}

// Each point with each other one: what MakePatches finds without looking at all of them.
double NaiveTypicalDistance(std::span<const Double3> tile) {
  std::vector<double> nearest;
  for (const Double3& p : tile) {
    double least = std::numeric_limits<double>::infinity();
    for (const Double3& q : tile) {
      const Double3 d = p - q;
      if (Dot(d, d) > 0) least = std::min(least, Dot(d, d));
    }
    if (std::isfinite(Dot(p, p)) && std::isfinite(least)) nearest.push_back(std::sqrt(least));
  }
  std::ranges::sort(nearest);
  return nearest.empty() ? 0 : nearest[nearest.size() / 2];
}

TEST(Patches, AreThoseOfANaiveTwin) {
  std::mt19937 random(5);
  const auto draw = [&] { return static_cast<double>(random()) / 4294967296.0; };
  std::size_t borders = 0;
  for (int round = 0; round < 60; ++round) {
    SCOPED_TRACE(round);
    std::vector<Double3> points(1 + random() % 900);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double s = static_cast<double>(i) / 40;  // a strip that is wound up, and rough
      points[i] = {std::cos(s) * (1 + 0.02 * s) + 0.01 * draw(), std::sin(s) + 0.01 * draw(), 0.1 * draw()};
      if (round % 3 == 1 && random() % 20 == 0) points[i].y = std::nan("");
      if (round % 3 == 1 && random() % 30 == 0) points[i].x = -std::numeric_limits<double>::infinity();
      if (round % 4 == 2 && i > 0 && random() % 3 == 0) points[i] = points[i - 1];
      if (round == 50) points[i] = {1, 2, 3};
      if (round == 51) points[i].z = std::nan("");
    }
    const std::size_t tiles = 1 + random() % 3;
    const std::span<const Double3> of(points);
    // Of as many points as there are, or of fewer where there have to be inner points
    std::vector<Index> starts;
    for (std::size_t start = 0; start < points.size();) {
      starts.push_back(static_cast<Index>(start));
      start += round % 2 == 0 ? kTilePoints : SteppedPoints::kStartsAt * (1 + random() % 8);
    }
    const std::span<const Index> given = round % 2 == 0 ? std::span<const Index>() : starts;
    const std::vector<PatchPoints> patches = MakePatches(std::vector<PlacedOutput>{{points, given}}, tiles);
    ASSERT_EQ(patches.size(), (starts.size() + tiles - 1) / tiles);
    starts.push_back(static_cast<Index>(points.size()));
    for (std::size_t p = 0; p < patches.size(); ++p) {
      const std::size_t last = std::min(starts.size() - 1, (p + 1) * tiles);
      const std::size_t first = starts[p * tiles], end = starts[last];
      double border = 0;
      for (std::size_t t = p * tiles; t < last; ++t)
        border = std::max(border, 3 * NaiveTypicalDistance(of.subspan(starts[t], starts[t + 1] - starts[t])));
      PatchPoints expected;
      for (std::size_t i = 0; i < points.size(); ++i) {
        double least = border * border;
        for (std::size_t k = first; k < end; ++k) {
          const Double3 d = points[k] - points[i];
          if (Dot(d, d) < least) least = Dot(d, d);
        }
        const bool is_own = i >= first && i < end;
        const double weight = is_own ? 1 : border > 0 ? 1 - Smoothstep(std::sqrt(least) / border) : 0;
        if (!(weight > 0)) continue;
        borders += is_own ? 0 : 1;
        expected.points.push_back(static_cast<Index>(i));
        expected.weights.push_back(static_cast<float>(weight));
      }
      EXPECT_EQ(patches[p].points, expected.points);
      EXPECT_EQ(patches[p].weights, expected.weights);
    }
  }
  EXPECT_GT(borders, 1000u);
}

TEST(Patches, ChosenRegionsCostLeast) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> unit(0, 1);
  PatchLayout layout = MakePatchLayout(std::vector<std::size_t>{6, 3});
  ASSERT_EQ(layout.tiles, 1u);
  ASSERT_LE(layout.regions.size(), 16u);
  int partly = 0, full = 0;
  for (int round = 0; round < 400; ++round) {
    layout.costs.clear();
    for (const PatchRegion& region : layout.regions)
      layout.costs.push_back(0.05 * (0.3 + unit(random)) * region.count);
    if (round % 7 == 0) layout.costs[random() % layout.costs.size()] = 2;
    PatchChoice choice;
    std::vector<std::size_t> doubtful;
    double sum = 0;
    for (std::size_t p = 0; p < layout.patches; ++p) {
      if (unit(random) < 0.3) choice.weights[p] = static_cast<float>(unit(random));
      if (choice.weights[p] > 0) doubtful.push_back(p);
      sum += static_cast<double>(choice.weights[p]);
    }
    ChooseRegions(layout, 0, &choice);
    // Every set of regions that holds them
    double least = 1e9;
    for (std::uint64_t set = 0; set < std::uint64_t{1} << layout.regions.size(); ++set) {
      std::uint64_t held = 0;
      double cost = 0;
      for (std::size_t r = 0; r < layout.regions.size(); ++r) {
        if ((set >> r & 1) == 0) continue;
        cost += layout.costs[r];
        for (Index p = 0; p < layout.regions[r].count; ++p)
          held |= std::uint64_t{1} << (layout.regions[r].first + p);
      }
      bool all = true;
      for (const std::size_t p : doubtful) all = all && (held >> p & 1) != 0;
      if (all) least = std::min(least, cost);
    }
    const double share = sum / static_cast<double>(layout.patches);
    EXPECT_NEAR(choice.mean, share, 1e-6);
    EXPECT_EQ(choice.all > 0, share > kWholeFrom);
    if (choice.full) {
      ++full;
      EXPECT_TRUE(least > kMostOfFull || share > kWholeFrom);
      EXPECT_EQ(choice.regions, 0u);
      EXPECT_EQ(choice.cost, 1);
      continue;
    }
    partly += !doubtful.empty();
    EXPECT_NEAR(choice.cost, least, 1e-9);
    std::uint64_t held = 0;
    for (std::size_t r = 0; r < layout.regions.size(); ++r) {
      if ((choice.regions >> r & 1) == 0) continue;
      for (Index p = 0; p < layout.regions[r].count; ++p) {
        const std::uint64_t bit = std::uint64_t{1} << (layout.regions[r].first + p);
        EXPECT_EQ(held & bit, 0u) << "a patch is evaluated twice";
        held |= bit;
      }
    }
    for (const std::size_t p : doubtful) EXPECT_NE(held >> p & 1, 0u);
  }
  EXPECT_GT(partly, 100);
  EXPECT_GT(full, 20);
}

TEST(Patches, AllPointsComeInWhereManyPatchesAreDoubtful) {
  PatchLayout layout = MakePatchLayout(std::vector<std::size_t>{10});
  layout.costs.assign(layout.regions.size(), 0.01);
  double before = 0;
  for (int step = 0; step <= 1000; ++step) {
    PatchChoice choice;
    for (std::size_t p = 0; p < 8; ++p) choice.weights[p] = static_cast<float>(step) / 1000;
    ChooseRegions(layout, 0, &choice);
    EXPECT_LT(choice.all - before, 0.01) << "no jump";
    EXPECT_GE(choice.all, before);
    before = choice.all;
    EXPECT_EQ(choice.full, choice.all > 0);
  }
  EXPECT_EQ(before, 1);
  PatchChoice guarded;
  ChooseRegions(layout, 0.3, &guarded);
  EXPECT_EQ(guarded.all, 0.3);
  EXPECT_TRUE(guarded.full);
}

// What patches emit at a threshold, all of them looked at.
struct Emitted {
  double weight = 0, error = 0;  // the least weight, and the largest error
};
Emitted EmittedBy(const JudgedPose& pose, const ScoreMix& mix, const PatchLayout& layout, double guard,
                  const SoftCacheThreshold& threshold) {
  std::size_t exact = 0;
  Emitted emitted{1, 0};
  for (const PatchPair& patch : pose.patches) {
    const double score = mix.doubt * std::min(pose.doubt, patch.score / layout.share);
    const double weight = std::max(guard, FullWeight(score, threshold));
    exact += FullWeight(score, threshold) == 1;
    emitted.weight = std::min(emitted.weight, weight);
    emitted.error = std::max(emitted.error, (1 - weight) * patch.error);
  }
  if (2 * exact >= pose.patches.size() || guard == 1) return {1, 0};
  return emitted;
}

std::vector<ScoreJudge> RandomJudges(std::size_t count, std::size_t patches, unsigned seed) {
  std::mt19937 random(seed);
  std::lognormal_distribution<double> size(0, 0.7), noise(0, 0.4);
  std::vector<ScoreJudge> judges(count);
  for (std::size_t t = 0; t < count; ++t) {
    ScoreJudge& judge = judges[t];
    judge.kind = static_cast<int>(t % 3);
    if (t % 11 == 0) judge.guard = t % 2 == 0 ? 1 : 0.4;
    const double strange = size(random);
    for (std::size_t p = 0; p < patches; ++p) {
      const double difficulty = 0.3 * strange * size(random);
      judge.pose.patches.push_back({difficulty * noise(random), 1e-3 * difficulty * noise(random)});
      judge.pose.doubt = std::max(judge.pose.doubt, judge.pose.patches.back().score);
      judge.pose.error = std::max(judge.pose.error, judge.pose.patches.back().error);
    }
  }
  return judges;
}

TEST(Patches, CalibrationCountsWhatTheyEmit) {
  const ScoreMix mix{0, 2};
  PatchLayout layout;
  layout.share = 0.4;
  const std::vector<ScoreJudge> judges = RandomJudges(1500, 9, 3);
  std::vector<CalibrationPair> pairs;
  std::size_t kept = 0;
  for (const ScoreJudge& judge : judges) {
    pairs.push_back(PairOf(judge.pose, mix, layout, judge.guard, judge.kind));
    kept += pairs.back().patches.size();
  }
  EXPECT_LT(kept, 9 * judges.size() / 2) << "most are outdone by others";
  for (const double tolerance : {3e-4, 6e-4, 1e-3, 3e-3}) {
    const Calibration found = Calibrate(pairs, tolerance, 0.05);
    SCOPED_TRACE(tolerance);
    ASSERT_GT(found.threshold.tau, 0);
    std::size_t violations = 0, accepted = 0, hits = 0;
    for (std::size_t t = 0; t < judges.size(); ++t) {
      const Emitted emitted = EmittedBy(judges[t].pose, mix, layout, judges[t].guard, found.threshold);
      EXPECT_NEAR(EmittedError(pairs[t], found.threshold), emitted.error, 1e-15) << t;
      violations += emitted.weight < 1 && emitted.error > tolerance * (1 + 1e-9);
      accepted += EmittedWeight(pairs[t], found.threshold) < 1;
      hits += FullWeight(2 * judges[t].pose.doubt, found.threshold) == 0 && judges[t].guard == 0;
    }
    EXPECT_EQ(found.violations, violations);
    EXPECT_EQ(found.accepted, accepted);
    EXPECT_EQ(found.hits, hits);
    EXPECT_GT(accepted, hits + 20) << "some poses miss in part";
    for (const Calibration::Kind& kind : found.kinds) EXPECT_LE(kind.upper_bound, 0.05 + 1e-9);
  }
}

TEST(Patches, InBlendsGoFromTheirOwnScoresToThatOfAllPoints) {
  SoftCacheThreshold threshold;
  threshold.tau = 2;
  const double lo = threshold.tau_lo();
  for (const double own : {0.0, 0.2, 0.7, 1.0}) {
    EXPECT_NEAR(PatchScoreInBlend(own * lo, lo, threshold), std::max(own, kLeastOwn) * lo, 1e-12);
    EXPECT_EQ(PatchScoreInBlend(own * 2, 2, threshold), 2);
    EXPECT_EQ(PatchScoreInBlend(own * 3, 3, threshold), 3);
    double before = 0, weight = 0;
    for (double score = lo; score < 2.1; score += 1e-4) {
      const double of_patch = PatchScoreInBlend(own * score, score, threshold);
      EXPECT_GE(of_patch, before);
      EXPECT_LE(of_patch, score);
      EXPECT_LE(FullWeight(of_patch, threshold) - weight, 0.05) << "no jump at " << score;
      before = of_patch, weight = FullWeight(of_patch, threshold);
    }
    EXPECT_EQ(weight, 1);
  }
  // A lower tau never takes less of the full evaluation
  for (double tau = 0.9; tau < 1.3; tau += 1e-3) {
    SoftCacheThreshold one, lower;
    one.tau = tau, lower.tau = tau - 1e-3;
    EXPECT_GE(FullWeight(PatchScoreInBlend(0.6, 1, lower), lower),
              FullWeight(PatchScoreInBlend(0.6, 1, one), one));
  }
  EXPECT_EQ(FullWeight(PatchScoreInBlend(1, 1, {kInfinity}), {kInfinity}), 0);
  EXPECT_EQ(FullWeight(PatchScoreInBlend(0, 1, {-1}), {-1}), 1);
}

// Pose by pose at the threshold found; and that is where one pose more would go beyond the tolerance.
TEST(Patches, CalibrationCountsWhatTheyEmitInBlends) {
  const ScoreMix mix{0, 2};
  PatchLayout layout;
  layout.blends_only = true;
  const std::vector<ScoreJudge> judges = RandomJudges(1500, 9, 3);
  std::vector<CalibrationPair> pairs;
  for (const ScoreJudge& judge : judges)
    pairs.push_back(PairOf(judge.pose, mix, layout, judge.guard, judge.kind));
  std::size_t helped = 0;
  for (const double tolerance : {1e-3, 2e-3, 3e-3}) {
    const Calibration found = Calibrate(pairs, tolerance, 0.05);
    SCOPED_TRACE(tolerance);
    ASSERT_GT(found.threshold.tau, 0);
    const auto violations = [&](const SoftCacheThreshold& threshold, bool check) {
      std::size_t count = 0;
      for (std::size_t t = 0; t < judges.size(); ++t) {
        const JudgedPose& pose = judges[t].pose;
        double error = 0, whole = 0, least = 1;
        for (const PatchPair& patch : pose.patches) {
          const double score = PatchScoreInBlend(2 * patch.score, 2 * pose.doubt, threshold),
                       weight = std::max(judges[t].guard, FullWeight(score, threshold));
          error = std::max(error, (1 - weight) * patch.error);
          least = std::min(least, weight);
          whole = std::max(
              whole, (1 - std::max(judges[t].guard, FullWeight(2 * pose.doubt, threshold))) * patch.error);
        }
        if (check) {
          EXPECT_NEAR(EmittedError(pairs[t], threshold), error, 1e-15) << t;
          EXPECT_GE(error, whole);
          EXPECT_EQ(EmittedWeight(pairs[t], threshold) < 1, least < 1) << t;
          helped += error > whole;
        }
        count += least < 1 && error > tolerance * (1 + 1e-9);
      }
      return count;
    };
    EXPECT_EQ(violations(found.threshold, true), found.violations);
    for (const Calibration::Kind& kind : found.kinds) EXPECT_LE(kind.upper_bound, 0.05 + 1e-9);
    SoftCacheThreshold above = found.threshold;
    above.tau *= 1 + 1e-6;
    EXPECT_GT(violations(above, false), found.violations);
    // Never more than the blend's width below that of misses of all points
    std::vector<CalibrationPair> of_all;
    for (const ScoreJudge& judge : judges)
      of_all.push_back(PairOf(WithoutPatches(judge).pose, mix, {}, judge.guard, judge.kind));
    const double whole = Calibrate(of_all, tolerance, 0.05).threshold.tau;
    EXPECT_LE(found.threshold.tau, whole * (1 + 1e-12));
    EXPECT_GE(found.threshold.tau, kBlendStart * whole);
  }
  EXPECT_GT(helped, 50u) << "some patches of blends are left alone";
}

// Guards of patches are no hits, and no worse than it is counted.
TEST(Patches, CalibrationCountsGuardsOfPatches) {
  const ScoreMix mix{0, 2};
  PatchLayout layout = MakePatchLayout(std::vector<std::size_t>{9});
  ASSERT_EQ(layout.patches, 9u);
  for (const PatchRegion& region : layout.regions)
    layout.costs.push_back(static_cast<double>(region.count) / 9);
  layout.share = 0.4;
  std::vector<ScoreJudge> judges = RandomJudges(3000, 9, 5);
  std::mt19937 random(6);
  for (std::size_t t = 0; t < judges.size(); t += 3) {
    judges[t].guards_of_patches.assign(9, 0);
    for (std::size_t k = 0; k < 1 + t % 6; ++k)
      judges[t].guards_of_patches[random() % 9] = random() % 2 == 0 ? 1 : 0.5f;
  }
  std::vector<CalibrationPair> pairs;
  for (const ScoreJudge& judge : judges)
    pairs.push_back(PairOf(judge.pose, mix, layout, judge.guard, judge.kind, judge.guards_of_patches));
  const double tolerance = 6e-4;
  const Calibration found = Calibrate(pairs, tolerance, 0.05);
  ASSERT_GT(found.threshold.tau, 0);
  std::size_t hits = 0, exact = 0, helped = 0, whole = 0, partly = 0;
  for (std::size_t t = 0; t < judges.size(); ++t) {
    const ScoreJudge& judge = judges[t];
    Emitted emitted = EmittedBy(judge.pose, mix, layout, judge.guard, found.threshold);
    const bool guarded = !judge.guards_of_patches.empty();
    hits += !guarded && judge.guard == 0 && FullWeight(2 * judge.pose.doubt, found.threshold) == 0;
    EXPECT_TRUE(!guarded || EmittedWeight(pairs[t], found.threshold) > 0);
    EXPECT_TRUE(!guarded || ShareOfFull(judge, mix, found.threshold, layout) > 0);
    if (!guarded) continue;
    const double without = emitted.error;
    double mean = 0;
    emitted = {1, 0};
    for (std::size_t p = 0; p < 9; ++p) {
      const double score = mix.doubt * std::min(judge.pose.doubt, judge.pose.patches[p].score / layout.share);
      const double weight = std::max(
          {judge.guard, FullWeight(score, found.threshold), static_cast<double>(judge.guards_of_patches[p])});
      mean += weight / 9;
      emitted.error = std::max(emitted.error, (1 - weight) * judge.pose.patches[p].error);
    }
    if (mean >= kWholeAt) emitted.error = 0, ++whole;
    if (mean < kWholeFrom) {
      EXPECT_NEAR(EmittedError(pairs[t], found.threshold), emitted.error, 1e-15) << t;
      ++partly;
    }
    EXPECT_GE(EmittedError(pairs[t], found.threshold), (1 - WholeWeight(mean)) * emitted.error - 1e-15) << t;
    EXPECT_LE(EmittedError(pairs[t], found.threshold), without + 1e-15) << t;
    exact += emitted.error == 0;
    helped += emitted.error < without;
  }
  EXPECT_EQ(found.hits, hits);
  EXPECT_GT(hits, 100u);
  EXPECT_GT(helped, 100u);
  EXPECT_GT(exact, 30u);
  EXPECT_GT(whole, 30u);
  EXPECT_GT(partly, 30u);
  for (const Calibration::Kind& kind : found.kinds) EXPECT_LE(kind.upper_bound, 0.05 + 1e-9);
}

// Files hold what is finite: where guards ask for half of the patches, they ask for all points.
TEST(Patches, GuardsOfHalfOfThemLeaveNoInfinity) {
  PatchLayout layout = MakePatchLayout(std::vector<std::size_t>{8});
  ScoreJudge judge = RandomJudges(1, 8, 5)[0];
  for (std::size_t asked = 0; asked <= 8; ++asked) {
    std::vector<float> guards(8, 0);
    std::fill_n(guards.begin(), asked, 1.0f);
    const CalibrationPair pair = PairOf(judge.pose, {0, 2}, layout, 0, 0, guards);
    SCOPED_TRACE(asked);
    EXPECT_TRUE(std::isfinite(pair.middle));
    EXPECT_EQ(pair.guard >= 1, asked >= 4);
    EXPECT_LE(pair.patches.size(), 8 - asked);
    for (const PatchPair& patch : pair.patches) EXPECT_TRUE(std::isfinite(patch.score));
  }
}

// Where nothing is wrong, thresholds reach as far as judges do, those of which guards ask for patches among
// them.
TEST(Patches, GuardsOfPatchesLeaveWhatWasSeen) {
  const ScoreMix mix{0, 2};
  PatchLayout layout;
  layout.share = 0.4;
  std::vector<CalibrationPair> pairs;
  double largest = 0;
  for (ScoreJudge judge : RandomJudges(1500, 9, 5)) {
    if (judge.guard > 0) continue;
    std::vector<float> guards(9, 0);
    if (judge.pose.doubt > 0.05) guards[2] = 1;  // all that are strange
    judge.pose.error = 0;
    for (PatchPair& patch : judge.pose.patches) patch.error = 0;
    pairs.push_back(PairOf(judge.pose, mix, layout, 0, judge.kind, guards));
    largest = std::max(largest, mix.doubt * judge.pose.doubt);
    EXPECT_EQ(pairs.back().guard > 0, guards[2] > 0);
  }
  ASSERT_GT(largest, 0.2);
  EXPECT_NEAR(Calibrate(pairs, 1e-3, 0.05).threshold.tau_lo(), largest, 1e-9);
}

// The largest doubt of a pose is `strange`; one patch is wrong, and its own doubt is `told` of that.
std::vector<ScoreJudge> OneWrongPatch(std::size_t wrong_every, double told) {
  std::vector<ScoreJudge> judges(1200);
  for (std::size_t t = 0; t < judges.size(); ++t) {
    ScoreJudge& judge = judges[t];
    judge.kind = static_cast<int>(t % 2);
    judge.pose.patches.assign(12, {0.01, 1e-4});
    const bool wrong = t % wrong_every == 3;
    judge.pose.doubt = wrong ? 1 + 0.001 * static_cast<double>(t % 90) : 0.1;
    judge.pose.patches[t % 12].score = judge.pose.doubt;
    if (wrong) judge.pose.patches[(t + 5) % 12] = {told * judge.pose.doubt, 3e-3};
    judge.pose.error = wrong ? 3e-3 : 1e-4;
  }
  return judges;
}

// Frames beyond the ranges, where guards ask for one patch, cost what that costs.
TEST(Patches, CostAPartOfFramesBeyondTheRanges) {
  const std::vector<ScoreJudge> judges = OneWrongPatch(5, 0.3);
  std::vector<ScoreJudge> outside = OneWrongPatch(100000, 1);
  for (ScoreJudge& judge : outside) judge.guards_of_patches.assign(12, 0), judge.guards_of_patches[2] = 1;
  const auto choose = [&](double cost, std::span<const ScoreJudge> beyond) {
    Subspace subspace;
    subspace.violation_rate = 0.03;
    subspace.tolerance = 1e-3;
    subspace.patches = MakePatchLayout(std::vector<std::size_t>{12});
    subspace.patches.costs.assign(subspace.patches.regions.size(), cost);
    const ChosenMisses chosen = ChooseMisses(&subspace, judges, 0, 1e5, 1e-3, 0.9, beyond);
    EXPECT_EQ(chosen.cost.outside > 0, !beyond.empty());
    return std::pair(subspace.patches.tiles > 0 && !subspace.patches.blends_only, chosen.cost.outside);
  };
  const auto [parts, of_parts] = choose(0.1, outside);
  const auto [whole, of_whole] = choose(0.95, outside);
  EXPECT_TRUE(parts);
  EXPECT_FALSE(whole);
  EXPECT_NEAR(of_parts, 0.1 * of_whole, 0.001 * of_whole);
  EXPECT_EQ(choose(0.1, {}).second, 0);
}

TEST(Patches, AreTakenWhereTheySpareTime) {
  const auto choose = [](const std::vector<ScoreJudge>& judges, double cost) {
    Subspace subspace;
    subspace.violation_rate = 0.03;
    subspace.tolerance = 1e-3;
    subspace.patches = MakePatchLayout(std::vector<std::size_t>{12});
    subspace.patches.costs.assign(subspace.patches.regions.size(), cost);
    const FrameCost found = ChooseMisses(&subspace, judges, 0, 1e5, 1e-3, 0.9).cost;
    return std::pair(subspace.patches, found);
  };
  // Wrong where the largest doubt tells, and the patch's own at .3 of that
  const auto [told, told_cost] = choose(OneWrongPatch(5, 0.3), 0.1);
  ASSERT_GT(told.tiles, 0u);
  EXPECT_LE(told.share, 0.3);
  EXPECT_LT(told_cost.misses, 0.05);
  EXPECT_LT(told_cost.wrong, 0.01);
  // Patches that cost as much as all points, or that do not tell, are no gain
  EXPECT_EQ(choose(OneWrongPatch(5, 0.3), 0.9).first.tiles, 0u);
  EXPECT_TRUE(choose(OneWrongPatch(5, 0.001), 0.1).first.blends_only) << "all points miss";
  // Where no judge misses, clips may: as cautious as can be
  const auto [none, none_cost] = choose(OneWrongPatch(100000, 1), 0.1);
  EXPECT_GT(none.tiles, 0u);
  EXPECT_EQ(none.share, 0.15);
  EXPECT_FALSE(told.blends_only);
  EXPECT_LT(none_cost.misses, 1e-3) << "of the sets that are drawn of them some have the wrong one often";
}

}  // namespace
}  // namespace kpsa::engine
