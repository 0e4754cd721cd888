// What a frame is expected to cost: misses, and frames that are wrong, on judges of several kinds.
#include "kpsa/training/frame_cost.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "kpsa/training/tile_trust.h"

namespace kpsa::engine {
namespace {

constexpr double kAsked = 1e-3, kFullFrame = 1e5;

Subspace DoubtedAlone() {
  Subspace subspace;
  subspace.violation_rate = 0.03;
  subspace.tolerance = kAsked;
  subspace.score = {0, 1};
  return subspace;
}
// Poses of two kinds, of which `beyond` are twice as far off as the tolerance allows, their doubts above all
// others' by `told`.
std::vector<ScoreJudge> MadeUpJudges(std::size_t beyond, double told, std::size_t poses = 400) {
  std::vector<ScoreJudge> judges;
  for (std::size_t t = 0; t < poses; ++t) {
    const bool wrong = beyond > 0 && t % (poses / beyond) == 7 && t / (poses / beyond) < beyond;
    ScoreJudge judge;
    judge.pose.doubt = 0.1 + 1e-4 * static_cast<double>(t % 50) + (wrong ? told : 0);
    judge.pose.error = (wrong ? 2 : 0.5) * kAsked;
    judge.kind = static_cast<int>(t % 2);
    judges.push_back(judge);
  }
  return judges;
}
FrameCost CostOf(const std::vector<ScoreJudge>& judges, double tolerance) {
  return ExpectedCost(DoubtedAlone(), judges, 0, kFullFrame, tolerance, 0.9);
}

TEST(FrameCost, FramesThatAreWrongCountBesideMisses) {
  const FrameCost right = CostOf(MadeUpJudges(0, 0), kAsked);
  EXPECT_EQ(right.misses, 0);
  EXPECT_EQ(right.wrong, 0);
  // Few enough to be accepted where nothing tells them apart
  const FrameCost wrong = CostOf(MadeUpJudges(10, 0, 4000), kAsked);
  EXPECT_EQ(wrong.misses, 0);
  EXPECT_NEAR(wrong.wrong, 10.0 / 4000, 1e-12);
  EXPECT_NEAR(wrong.ns - right.ns, kFullFrame * wrong.lost(), 1e-6);
  EXPECT_GT(wrong.lost(), 0);
  // Told by their doubts, many are missed, and none is wrong
  const FrameCost told = CostOf(MadeUpJudges(40, 1), kAsked);
  EXPECT_GT(told.misses, 0.05);
  EXPECT_LT(told.wrong, 0.03);
}

// A calibration with as many wrong poses as a threshold may accept hits all, and one with another such pose
// misses all; other poses than these judges may have that one.
TEST(FrameCost, WhereOnePoseDecidesNeitherSideOfItIsTheCost) {
  std::size_t admitted = 0;
  const auto all_hit = [](std::size_t beyond) {
    std::vector<CalibrationPair> pairs;
    for (const ScoreJudge& judge : MadeUpJudges(beyond, 0))
      pairs.push_back({judge.pose.doubt, judge.pose.error, 0, judge.kind});
    return Calibrate(pairs, kAsked, 0.03, DoubtedAlone().blend_start, 0.9).hit_rate == 1;
  };
  while (all_hit(admitted + 1)) ++admitted;
  ASSERT_GT(admitted, 0u);
  const FrameCost cost = CostOf(MadeUpJudges(admitted, 0), kAsked);
  EXPECT_GT(cost.misses, 0.2);
  EXPECT_LT(cost.misses, 0.8);
}

TEST(FrameCost, ASmallerToleranceIsAskedOfTheSamePoses) {
  const std::vector<ScoreJudge> judges = MadeUpJudges(0, 0);
  EXPECT_EQ(CostOf(judges, kAsked).misses, 0);
  EXPECT_EQ(CostOf(judges, 0.4 * kAsked).misses, 1) << "all are half the tolerance off";
}

// Far poses that are told by their scores miss; those made of the clips hit but for one in ten.
TEST(FrameCost, OfClipsCountsWhatPosesMadeOfThemMiss) {
  Subspace subspace = DoubtedAlone();
  std::vector<ScoreJudge> judges;
  for (std::size_t t = 0; t < 800; ++t) {
    const bool near = t % 2 == 0, misses = near ? t % 20 == 0 : t % 4 == 1;
    ScoreJudge& judge = judges.emplace_back();
    judge.pose.doubt = misses ? 10 : 0.1, judge.pose.error = (misses ? 2 : 0.5) * kAsked;
    subspace.calibration.push_back({judge.pose.doubt, judge.pose.error, 0, 0});
    subspace.calibration.back().near_clips = near;
  }
  const SoftCacheThreshold threshold =
      Calibrate(subspace.calibration, subspace.tolerance, subspace.violation_rate).threshold;
  const auto lost = [&] { return LostOfClips(subspace, judges, threshold); };
  EXPECT_NEAR(*lost(), 0.1, 1e-6);
  // Of five patches, each a fifth of a full frame, one misses
  subspace.patches.tiles = 1, subspace.patches.patches = 5, subspace.patches.costs.assign(5, 0.2);
  for (Index p = 0; p < 5; ++p) subspace.patches.regions.push_back({0, p, 1, 0, kNoIndex, 0, true});
  for (ScoreJudge& judge : judges)
    judge.pose.patches = {{judge.pose.doubt, judge.pose.error}, {0.1, 0}, {0.1, 0}, {0.1, 0}, {0.1, 0}};
  EXPECT_NEAR(*lost(), 0.1 * 0.2, 1e-6);
  // Without clips
  for (CalibrationPair& pair : subspace.calibration) pair.near_clips = false;
  EXPECT_FALSE(lost().has_value());
}

// Frames a little beyond the ranges: what guards keep from hitting costs as a miss, what they let pass
// nothing if it is right, and half a miss if it is wrong.
TEST(FrameCost, FramesOutsideCostWhatGuardsAskOfThem) {
  const std::vector<ScoreJudge> judges = MadeUpJudges(0, 0);
  const auto outside = [&](double guard, double error) {
    std::vector<ScoreJudge> poses = MadeUpJudges(0, 0, 40);
    for (ScoreJudge& pose : poses) pose.guard = guard, pose.pose.error = error * kAsked;
    return CostOutside(DoubtedAlone(), judges, poses, kFullFrame, kAsked, 0.9);
  };
  EXPECT_EQ(CostOutside(DoubtedAlone(), judges, {}, kFullFrame, kAsked, 0.9), 0);
  EXPECT_EQ(outside(0, 0.5), 0);
  const double missed = outside(1, 0.5);
  EXPECT_GT(missed, 0.005 * kFullFrame);
  EXPECT_LT(missed, 0.1 * kFullFrame) << "clips have few such frames";
  EXPECT_EQ(outside(1, 5), missed);
  EXPECT_NEAR(outside(0, 5), FrameCost::kWrongCost * missed, 1e-9);
}

// Two tiles: the first doubts much and is right, the second doubts little, and is wrong where it does.
std::vector<ScoreJudge> TilesThatDiffer(bool second_is_wrong) {
  std::vector<ScoreJudge> judges;
  for (std::size_t t = 0; t < 600; ++t) {
    const float far = static_cast<float>(t % 50) / 50, strange = t % 12 == 5 ? 0.3f : 0.02f;
    ScoreJudge judge;
    judge.kind = static_cast<int>(t % 2);
    judge.pose.tile_doubts = {far, strange};
    judge.pose.tile_errors = {0.1f * static_cast<float>(kAsked) * far,
                              (second_is_wrong ? 5.0f : 0.3f) * static_cast<float>(kAsked) * strange};
    judge.pose.doubt = static_cast<double>(std::max(far, strange));
    judge.pose.error = static_cast<double>(std::ranges::max(judge.pose.tile_errors));
    judges.push_back(judge);
  }
  return judges;
}

TEST(FrameCost, TilesAreBelievedAsFarAsTheyAreRight) {
  const std::vector<ScoreJudge> judges = TilesThatDiffer(true);
  Subspace subspace = DoubtedAlone();
  const double as_they_are = ExpectedCost(subspace, judges, 0, kFullFrame, kAsked, 0.9).misses;
  EXPECT_GT(as_they_are, 0.5) << "the doubt of the first tile hides that of the second";
  const ChosenMisses chosen = ChooseMisses(&subspace, judges, 0, kFullFrame, kAsked, 0.9);
  ASSERT_EQ(chosen.trust.size(), 2u);
  EXPECT_EQ(chosen.trust[1], 1);
  EXPECT_EQ(chosen.trust[0], kLeastTrust) << "a fiftieth, but a clip may go elsewhere";
  EXPECT_LT(chosen.cost.misses, 0.1);
  EXPECT_EQ(chosen.cost.wrong, 0);
  // With these doubts the score that was chosen does what the cost says
  std::vector<ScoreJudge> weighed = judges;
  WeighDoubts(chosen.trust, subspace, weighed);
  EXPECT_EQ(weighed[7].pose.tile_doubts[1], judges[7].pose.tile_doubts[1]);
  EXPECT_FLOAT_EQ(weighed[7].pose.tile_doubts[0], 0.1f * judges[7].pose.tile_doubts[0]);
  EXPECT_EQ(ExpectedCost(subspace, weighed, 0, kFullFrame, kAsked, 0.9).misses, chosen.cost.misses);
}

TEST(FrameCost, DoubtsStayWhereNothingIsWrong) {
  Subspace subspace = DoubtedAlone();
  const ChosenMisses chosen = ChooseMisses(&subspace, TilesThatDiffer(false), 0, kFullFrame, kAsked, 0.9);
  EXPECT_TRUE(chosen.trust.empty());
  EXPECT_EQ(chosen.cost.misses, 0);
  // What guards keep from hitting says nothing of tiles
  std::vector<ScoreJudge> kept = TilesThatDiffer(true);
  const std::vector<double> trust = TrustInTiles(kept);
  for (std::size_t t = 0; t < 100; ++t) {
    kept.push_back(kept[t]);
    kept.back().guard = 1;
    kept.back().pose.tile_errors[0] = 1;
  }
  EXPECT_EQ(TrustInTiles(kept), trust);
  EXPECT_TRUE(TrustInTiles({}).empty());
}

}  // namespace
}  // namespace kpsa::engine
