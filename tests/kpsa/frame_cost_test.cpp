// What a frame is expected to cost: misses, and frames that are wrong, on judges of several kinds.
#include "kpsa/frame_cost.h"

#include <gtest/gtest.h>

namespace kpsa {
namespace {

constexpr double kAsked = 1e-3, kFullFrame = 1e5;

Subspace DoubtedAlone() {
  Subspace subspace;
  subspace.violation_rate = 0.03;
  subspace.tolerance = kAsked;
  subspace.score = {0, 1};
  return subspace;
}
// 400 poses of two kinds, of which `beyond` are twice as far off as the tolerance allows, their doubts above
// all others' by `told`.
std::vector<ScoreJudge> MadeUpJudges(std::size_t beyond, double told) {
  std::vector<ScoreJudge> judges;
  for (std::size_t t = 0; t < 400; ++t) {
    const bool wrong = t % (400 / std::max<std::size_t>(beyond, 1)) == 7 && beyond > 0;
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
  const FrameCost wrong = CostOf(MadeUpJudges(2, 0), kAsked);
  EXPECT_EQ(wrong.misses, 0);
  EXPECT_NEAR(wrong.wrong, 2.0 / 400, 1e-12);
  EXPECT_NEAR(wrong.ns - right.ns, kFullFrame * wrong.lost(), 1e-6);
  EXPECT_GT(wrong.lost(), 0);
  // Told by their doubts, many are missed, and none is wrong
  const FrameCost told = CostOf(MadeUpJudges(40, 1), kAsked);
  EXPECT_GT(told.misses, 0.05);
  EXPECT_LT(told.wrong, 0.03);
}

TEST(FrameCost, ASmallerToleranceIsAskedOfTheSamePoses) {
  const std::vector<ScoreJudge> judges = MadeUpJudges(0, 0);
  EXPECT_EQ(CostOf(judges, kAsked).misses, 0);
  EXPECT_EQ(CostOf(judges, 0.4 * kAsked).misses, 1) << "all are half the tolerance off";
}

}  // namespace
}  // namespace kpsa
