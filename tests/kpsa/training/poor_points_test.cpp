// Which points a last step should give (kpsa/training/poor_points.h).
#include "kpsa/training/poor_points.h"

#include <gtest/gtest.h>

#include "kpsa/tiles.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kPoorPoses = 200;

// Three tiles, the last one of ten points: point 4 of the first is beyond in many poses, two of the last in some.
PointsBeyond SomeBeyond() {
  PointsBeyond beyond(kPoorPoses, 3, {78}, {1, 1.9});
  for (const std::size_t tile : {2u, 0u, 1u}) {
    Eigen::MatrixXd errors =
        Eigen::MatrixXd::Constant(tile == 2 ? 10 : static_cast<Eigen::Index>(kTilePoints), kPoorPoses, 1.0);
    if (tile == 0) errors.row(4).head(80).setConstant(2);
    if (tile == 2) errors.row(0).segment(78, 6).setConstant(1.5), errors.row(9).tail(1).setConstant(1.5);
    beyond.Set(tile, errors);
  }
  return beyond;
}

TEST(PoorPoints, AreTheFewestWithoutWhichFewPosesAreBeyond) {
  const PointsBeyond beyond = SomeBeyond();
  EXPECT_EQ(beyond.points(), 2 * kTilePoints + 10);
  const std::size_t many = 4, some = 2 * kTilePoints, one = 2 * kTilePoints + 9;
  EXPECT_EQ(beyond.Worst(0), (std::vector<std::size_t>{many, some, one}));
  EXPECT_EQ(beyond.Worst(0.005), (std::vector<std::size_t>{many, some})) << "one pose of 200 hardly matters";
  EXPECT_EQ(beyond.Worst(0.034), (std::vector<std::size_t>{many, some}));
  EXPECT_EQ(beyond.Worst(0.035), (std::vector<std::size_t>{many}));
  EXPECT_EQ(beyond.Worst(0.42), (std::vector<std::size_t>{many}));
  EXPECT_EQ(beyond.Worst(0.425), std::vector<std::size_t>()) << "poses count once";
}

TEST(PoorPoints, OfClipsHaveABoundOfTheirOwn) {
  PointsBeyond beyond(4, 1, {2}, {2, 1});
  Eigen::MatrixXd errors = Eigen::MatrixXd::Zero(3, 4);
  errors(0, 1) = errors(1, 2) = 1.5;
  beyond.Set(0, errors);
  EXPECT_EQ(beyond.Worst(0), std::vector<std::size_t>{0}) << "the first two poses are of clips";
}

TEST(PoorPoints, AreNoneWhereTheirStepsAreDear) {
  const PointsBeyond beyond = SomeBeyond();
  const std::vector<std::size_t> none, poor = beyond.Worst(0);
  ASSERT_EQ(poor.size(), 3u);
  TileSteps steps{std::vector<double>(3, kTilePoints * 2.0)};
  EXPECT_EQ(PoorPoints(beyond, steps).points, poor);
  steps.most = 6;
  EXPECT_EQ(PoorPoints(beyond, steps).points, poor) << "of so many points, not of all their tiles";
  steps.most = 5.9;
  EXPECT_EQ(PoorPoints(beyond, steps).points, none);
  steps = {std::vector<double>(6, kTilePoints * 2.0), 17};
  EXPECT_EQ(PoorPoints(beyond, steps, 2).points, none) << "tiles stand for two: among the others are more";
  steps.most = 18;
  EXPECT_EQ(PoorPoints(beyond, steps, 2).points, poor);
  steps = {std::vector<double>(3, 1.0)};
  steps.ns[2] = 0;
  EXPECT_EQ(PoorPoints(beyond, steps).points, none) << "no step would help there";
  EXPECT_EQ(PoorPoints(beyond, {}).points, none);
}

TEST(PoorPoints, OfFoldedPosesHaveBoundsOfTheirOwn) {
  PointsBeyond beyond(5, 1, {1, 2, 4}, {1, 0.5, 2, 4});
  Eigen::MatrixXd errors = Eigen::MatrixXd::Zero(6, 5);
  errors(0, 2) = 1.5;                 // folded, within its bound
  errors(1, 3) = 3;                   // beyond
  errors(2, 2) = 5;                   // and turned over
  errors(3, 1) = errors(4, 4) = 1.5;  // drawn
  errors(5, 4) = 5;                   // drawn poses turn nothing over
  beyond.Set(0, errors);
  EXPECT_EQ(beyond.Worst(0), (std::vector<std::size_t>{1, 2, 3, 4, 5}));
  EXPECT_EQ(beyond.Turned(), std::vector<std::size_t>{2});
  EXPECT_EQ(beyond.WithoutFolded().Worst(0), (std::vector<std::size_t>{3, 4, 5}));
  EXPECT_TRUE(beyond.WithoutFolded().Turned().empty());

  // Where those of folded poses are too many, the others
  TileSteps steps{.ns = {1}, .most_points = 5.0 / 6};
  EXPECT_EQ(PoorPoints(PointsOff{beyond, beyond}, steps).points.size(), 5u);
  EXPECT_EQ(PoorPoints(PointsOff{beyond, beyond}, steps).turned.size(), 1u);
  steps.most_points = 0.6;
  EXPECT_EQ(PoorPoints(PointsOff{beyond, beyond}, steps).points.size(), 3u);
  EXPECT_TRUE(PoorPoints(PointsOff{beyond, beyond}, steps).turned.empty());
}

TEST(PoorPoints, AreNoneWhereTheyAreMany) {
  const auto beyond = [](Eigen::Index points) {
    PointsBeyond found(1, 1, {}, {1, 1});
    Eigen::MatrixXd errors = Eigen::MatrixXd::Zero(9, 1);
    errors.topRows(points).setConstant(2);
    found.Set(0, errors);
    return found;
  };
  TileSteps steps{{1.0}};
  steps.most_points = 1.0 / 3;
  EXPECT_EQ(PoorPoints(beyond(3), steps).points.size(), 3u);
  EXPECT_EQ(PoorPoints(beyond(4), steps).points.size(), 0u);
}

TEST(PoorPoints, AreThoseOfTheStrictBoundWhereTheyAreFewEnough) {
  const auto beyond = [](std::size_t points) {
    PointsBeyond found(1, 1, {}, {1, 1});
    Eigen::MatrixXd errors = Eigen::MatrixXd::Zero(100, 1);
    errors.topRows(static_cast<Eigen::Index>(points)).setConstant(2);
    found.Set(0, errors);
    return found;
  };
  const TileSteps steps{.ns = {1}, .most_points = 0.1};
  EXPECT_EQ(PoorPoints(PointsOff{beyond(10), beyond(3)}, steps).points.size(), 10u);
  EXPECT_EQ(PoorPoints(PointsOff{beyond(11), beyond(3)}, steps).points.size(), 3u);
  EXPECT_EQ(PoorPoints(PointsOff{beyond(11), beyond(12)}, steps).points.size(), 0u);
  EXPECT_EQ(PoorPoints(PointsOff{beyond(0), beyond(0)}, steps).points.size(), 0u);
}

}  // namespace
}  // namespace kpsa::engine
