// Numbers that bring a point to a line.
#include "view/drag_solver.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace kpsa::engine {
namespace {

constexpr double kTurn = 1.2;  // radians

// A point at a distance of 1 from the origin, turned about x, then about y, then moved along x.
std::optional<Double3> Place(const std::vector<double>& numbers) {
  const double x = numbers[0], y = numbers.size() > 1 ? numbers[1] : 0,
               along = numbers.size() > 2 ? numbers[2] : 0;
  const Double3 up{0, -std::sin(x), std::cos(x)};
  return Double3{up.z * std::sin(y) + along, up.y, up.z * std::cos(y)};
}

double OffLine(Double3 point, const Line& line) {
  const Double3 along = UnitOrZero(line.along), to = point - line.from;
  return Length(to - Dot(to, along) * along);
}

std::vector<Range> Ranges(std::size_t count) {
  std::vector<Range> ranges{{-kTurn, kTurn}, {-kTurn, kTurn}, {-0.5, 0.5}};
  ranges.resize(count);
  return ranges;
}

// Any start, any target that can be reached, from any side from which it is seen to move.
TEST(DragSolver, ReachesWhatCanBeReached) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> share(-1, 1);
  for (int trial = 0; trial < 300; ++trial) {
    const std::size_t count = 1 + trial % 3;
    const std::vector<Range> ranges = Ranges(count);
    std::vector<double> start, target;
    for (const Range& range : ranges) {
      start.push_back(0.4 * share(random) * range.max);
      target.push_back(0.6 * share(random) * range.max);
    }
    const Double3 eye{share(random), share(random), 5}, there = *Place(target);
    const Line line{eye, (there - eye) * (2 + share(random))};
    const std::vector<double> found = BringToLine(Place, ranges, start, line);
    for (std::size_t k = 0; k < count; ++k) {
      EXPECT_GE(found[k], ranges[k].min);
      EXPECT_LE(found[k], ranges[k].max);
    }
    EXPECT_LT(OffLine(*Place(found), line), 1e-5) << trial;
  }
}

TEST(DragSolver, IsNeverFartherThanItBegan) {
  std::mt19937 random(8);
  std::uniform_real_distribution<double> share(-1, 1);
  for (int trial = 0; trial < 300; ++trial) {
    const std::vector<Range> ranges = Ranges(1 + trial % 3);
    std::vector<double> start;
    for (const Range& range : ranges) start.push_back(share(random) * range.max);
    const Line line{{4 * share(random), 4 * share(random), 4 * share(random)},
                    {share(random), share(random), share(random)}};
    const std::vector<double> found = BringToLine(Place, ranges, start, line);
    EXPECT_LE(OffLine(*Place(found), line), OffLine(*Place(start), line) + 1e-12) << trial;
  }
}

TEST(DragSolver, StopsAtTheEndsOfRanges) {
  const Line far_above{{0, 30, 5}, {0, 0, -1}};  // about x, less is higher
  EXPECT_EQ(BringToLine(Place, Ranges(1), {0.3}, far_above), std::vector<double>{-kTurn});
  const std::vector<double> two = BringToLine(Place, Ranges(2), {0.3, 0.2}, far_above);
  EXPECT_EQ(two[0], -kTurn);
  // A range of nothing, and one that the start is at the end of
  EXPECT_EQ(BringToLine(Place, {{0.3, 0.3}}, {0.3}, far_above), std::vector<double>{0.3});
  EXPECT_EQ(BringToLine(Place, Ranges(1), {-kTurn}, far_above), std::vector<double>{-kTurn});
}

// Of two numbers that do the same the solver moves both; a third one that moves nothing stays.
TEST(DragSolver, LeavesWhatMovesNothing) {
  const auto place = [](const std::vector<double>& n) -> std::optional<Double3> {
    return Double3{n[0] + n[1], 0, 0};
  };
  const std::vector<double> found =
      BringToLine(place, {{-9, 9}, {-9, 9}, {-9, 9}}, {0, 0, 2}, {{1, 0, 5}, {0, 0, -1}});
  EXPECT_NEAR(found[0], 0.5, 1e-4);
  EXPECT_NEAR(found[1], 0.5, 1e-4);
  EXPECT_EQ(found[2], 2);
}

TEST(DragSolver, StaysWhereTheRestIsUnknown) {
  const auto here = [](const std::vector<double>& n) -> std::optional<Double3> {
    if (n[0] > 0.5) return std::nullopt;
    return Double3{n[0], 0, 0};
  };
  const Line line{{1, 0, 5}, {0, 0, -1}};
  const std::vector<double> found = BringToLine(here, {{0, 2}}, {0}, line);
  EXPECT_GT(found[0], 0.3);
  EXPECT_LE(found[0], 0.5);
  const auto nowhere = [](const std::vector<double>&) { return std::optional<Double3>(); };
  EXPECT_EQ(BringToLine(nowhere, {{0, 2}}, {1}, line), std::vector<double>{1});
}

}  // namespace
}  // namespace kpsa::engine
