#include "kpsa/training/separation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

namespace kpsa::engine {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

TEST(Separation, IsTheShareOfPairsInOrder) {
  EXPECT_EQ(AreaUnderRoc({{{1, false}, {2, false}, {3, true}}}), 1);
  EXPECT_EQ(AreaUnderRoc({{{3, false}, {2, false}, {1, true}}}), 0);
  EXPECT_EQ(AreaUnderRoc({{{1, false}, {1, true}}}), 0.5) << "equal scores tell nothing";
  EXPECT_EQ(AreaUnderRoc({{{1, false}, {3, false}, {2, true}, {kNan, true}}}), 0.75)
      << "not a number is never accepted";
  EXPECT_TRUE(std::isnan(AreaUnderRoc({{{1, false}, {2, false}}})));
  EXPECT_TRUE(std::isnan(AreaUnderRoc({})));
}

TEST(Separation, EqualsCountingPairs) {
  std::mt19937 random(7);
  std::vector<ScoredPose> poses;
  for (int i = 0; i < 200; ++i) {
    const bool beyond = random() % 5 == 0;
    poses.push_back({static_cast<double>(random() % 40 + (beyond ? 10 : 0)), beyond});
  }
  double pairs = 0, ordered = 0;
  for (const ScoredPose& a : poses) {
    for (const ScoredPose& b : poses) {
      if (!a.beyond || b.beyond) continue;
      ++pairs;
      ordered += a.score > b.score ? 1 : a.score == b.score ? 0.5 : 0;
    }
  }
  EXPECT_NEAR(AreaUnderRoc(poses), ordered / pairs, 1e-12);
}

TEST(Separation, OfBothPartsOfTheScore) {
  std::vector<ScoreJudge> judges(4);
  const double errors[] = {0.1, 0.9, 1.1, kNan};
  for (std::size_t i = 0; i < judges.size(); ++i) {
    judges[i].pose.error = errors[i];
    judges[i].pose.doubt = static_cast<double>(i);
    judges[i].pose.measured = -static_cast<double>(i);
  }
  const TrainingRecord::Separation told = SeparationOf(judges, 1);
  EXPECT_EQ(told.poses, 4u);
  EXPECT_EQ(told.beyond, 2u) << "an error that is no number is beyond";
  EXPECT_EQ(told.likeness, 0);
  EXPECT_EQ(told.doubts, 1);
}

}  // namespace
}  // namespace kpsa::engine
