// How much of a rig is out of rest at once.
#include "kpsa/activity.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

namespace kpsa::engine {
namespace {

TrainedRange Reaching(double rest, double reach) {
  TrainedRange range = MakeTrainedRange("a", rest - 2 * reach - 1, rest + 2 * reach + 1, 0, 1);
  range.rest = rest;
  range.reach = reach;
  return range;
}

TEST(Activity, CountsEachSignalOnceByTheEntryThatIsFarthestOut) {
  // A matrix of three entries, a scalar, and one that hardly moves points
  const std::vector<TrainedRange> ranges = {Reaching(1, 0.5), Reaching(0, 2), Reaching(3, 0), Reaching(5, 4),
                                            Reaching(0, 0)};
  const std::vector<std::size_t> entries_of = {3, 1, 1};
  const auto of = [&](std::vector<float> entries) { return Activity(ranges, entries_of, entries); };
  EXPECT_EQ(of({1, 0, 3, 5, 0}), 0);
  EXPECT_EQ(of({1.5f, 1, 9, 5, 7}),
            1);  // its first entry at its reach; the second half way; the others have none
  EXPECT_EQ(of({1, -1, 3, 5, 0}), 0.25);          // either way
  EXPECT_EQ(of({1, 4, 3, 3, 0}), 4 + 0.25);       // beyond its reach, and a scalar
  EXPECT_EQ(of({1, std::nanf(""), 3, 5, 0}), 0);  // which its range asks for
}

TEST(Activity, AsksForTheFullEvaluationBeyondItsLimit) {
  EXPECT_EQ(ActivityWeight(8, 0), 0);
  EXPECT_EQ(ActivityWeight(8, 8), 0);
  EXPECT_GT(ActivityWeight(8, 8.2), 0);
  EXPECT_LT(ActivityWeight(8, 8.2), ActivityWeight(8, 8.6));
  EXPECT_EQ(ActivityWeight(8, 8 * (1 + kActivityRamp)), 1);
  EXPECT_EQ(ActivityWeight(8, std::nan("")), 1);
  EXPECT_EQ(ActivityWeight(std::numeric_limits<double>::infinity(), 1e300), 0);
}

}  // namespace
}  // namespace kpsa::engine
