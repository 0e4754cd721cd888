// What is expected at other tolerances, and what is said of that.
#include "report/tolerance_text.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "kpsa/kpsa_node.h"

namespace kpsa::engine {
namespace {

using Json = nlohmann::json;

constexpr double kFull = 1, kHit = 0.1;  // ms

// A share of hits that grows with the tolerance, up to `most` at 4 mm.
ToleranceModel Growing(double most) {
  return [most](double tolerance) {
    ToleranceRow row;
    row.tolerance = tolerance;
    row.hits = most * std::min(1.0, tolerance / 4e-3);
    row.speedup = SpeedupWithMisses(kFull, kHit, row.hits);
    return row;
  };
}

const ToleranceWords kWords = {"poses", "more of them help", false};

TEST(ToleranceTable, ToleranceInForceAmongRoundOnes) {
  EXPECT_EQ(TolerancesAround(0.4e-3), (std::vector<double>{1e-4, 2e-4, 4e-4, 6e-4, 8e-4, 1.5e-3, 3e-3}));
  EXPECT_EQ(TolerancesAround(1.13e-3),
            (std::vector<double>{3e-4, 6e-4, 1.13e-3, 1.5e-3, 2.5e-3, 5e-3, 1e-2}));
  EXPECT_EQ(TolerancesAround(1.0), (std::vector<double>{0.25, 0.5, 1, 1.5, 2, 4, 8}));
  EXPECT_TRUE(TolerancesAround(0).empty() && TolerancesAround(kAnyError).empty());
  EXPECT_EQ(ToleranceText(MakeToleranceTable(0, 1, 10, Growing(1)), kWords), "");
}

TEST(ToleranceTable, MissesCostBoth) {
  EXPECT_DOUBLE_EQ(SpeedupWithMisses(1, 0.1, 1), 10);
  EXPECT_DOUBLE_EQ(SpeedupWithMisses(1, 0.1, 0.5), 1 / 0.6);
  EXPECT_DOUBLE_EQ(SpeedupWithMisses(1, 0.1, 0), 1 / 1.1);
  EXPECT_EQ(SpeedupWithMisses(1, 0.1, 0, false), 1) << "nothing is measured";
  EXPECT_TRUE(std::isnan(SpeedupWithMisses(1, 0, 1)) && std::isnan(SpeedupWithMisses(0, 0, 1)));
}

TEST(ToleranceTable, ExpectsTheHitsOfPosesThatAreMadeOfClips) {
  std::vector<CalibrationPair> pairs;
  for (int i = 0; i < 400; ++i) {
    const bool near_clips = i % 2 == 0, bad = i % 40 == 0 || i % 8 == 1;  // 10 of 200, and 50
    pairs.push_back({bad ? 2.0 : 1.0, bad ? 1e-2 : 1e-4, 0, i < 300 ? 0 : 1, {}, 0, near_clips && i < 300});
  }
  const Calibration of_clips = Calibrate(pairs, 1e-3, 0.01, 1);
  EXPECT_EQ(of_clips.near_clips, 150u);
  EXPECT_DOUBLE_EQ(ExpectedHitRate(of_clips), 1 - 8.0 / 150);
  for (CalibrationPair& pair : pairs) pair.near_clips = false;
  const Calibration without = Calibrate(pairs, 1e-3, 0.01, 1);
  EXPECT_EQ(without.threshold.tau, of_clips.threshold.tau) << "the promise is of all";
  EXPECT_NEAR(ExpectedHitRate(without), 1 - (8 + 37.5) / 300, 2e-3) << "of the sampled ones";
}

TEST(ToleranceTable, SaysWhichToleranceGainsALot) {
  const ToleranceTable table = MakeToleranceTable(1e-3, 4e-3, 0, Growing(0.98));
  ASSERT_EQ(table.rows.size(), 7u);
  EXPECT_EQ(table.rows[table.in_force].tolerance, 1e-3);
  EXPECT_EQ(ToleranceAdvice(table, kWords),
            "at 4 mm (accelerate: tolerance) 98 % of poses would hit: 8.3x instead of 1.2x");
  const std::string text = ToleranceText(table, kWords);
  EXPECT_NE(text.find("     1 mm          24.5 %                 1.2x  in force\n"), std::string::npos)
      << text;
  EXPECT_EQ(text.find("--speedup"), std::string::npos) << text;
}

TEST(ToleranceTable, SaysNothingWhereEnoughHitOrNothingGains) {
  EXPECT_EQ(ToleranceAdvice(MakeToleranceTable(4e-3, 4e-3, 0, Growing(1)), kWords), "");
  EXPECT_EQ(ToleranceAdvice(MakeToleranceTable(4e-3, 4e-3, 0, Growing(0.6)), kWords), "");
  // What hits is no faster
  const auto slow = [](double tolerance) {
    ToleranceRow row = Growing(1)(tolerance);
    row.speedup = SpeedupWithMisses(kFull, 2 * kFull, row.hits);
    return row;
  };
  EXPECT_EQ(ToleranceAdvice(MakeToleranceTable(1e-3, 4e-3, 0, slow), kWords), "");
}

TEST(ToleranceTable, SaysWhereNoToleranceHelps) {
  EXPECT_EQ(ToleranceAdvice(MakeToleranceTable(1e-3, 4e-3, 0, Growing(0.4)), kWords),
            "fewer than half of the poses hit at any tolerance here: more of them help");
}

TEST(ToleranceTable, FindsTheSmallestToleranceForASpeedup) {
  const auto reach = [](double wanted, double most) {
    return *MakeToleranceTable(1e-3, 4e-3, wanted, Growing(most)).reached;
  };
  const ReachedSpeedup two = reach(2, 1);  // from 60 % on: 2.4 mm
  EXPECT_TRUE(two.reached);
  EXPECT_DOUBLE_EQ(two.row.tolerance, 2.4e-3);
  EXPECT_DOUBLE_EQ(two.row.hits, 0.6);
  EXPECT_DOUBLE_EQ(reach(2.01, 1).row.tolerance, 2.6e-3);
  EXPECT_DOUBLE_EQ(reach(0.95, 1).row.tolerance, 1.9e-4) << "also below the one in force";
  const ReachedSpeedup eleven = reach(11, 1);
  EXPECT_FALSE(eleven.reached);
  EXPECT_DOUBLE_EQ(eleven.row.tolerance, 4e-3);
  EXPECT_DOUBLE_EQ(eleven.row.speedup, 10);

  const auto text = [](double wanted) {
    return ToleranceText(MakeToleranceTable(1e-3, 4e-3, wanted, Growing(1)), kWords);
  };
  EXPECT_NE(text(2).find("--speedup 2: 2.4 mm, where 60.0 % of poses hit (2.0x); set `tolerance: 2.4 mm`"),
            std::string::npos)
      << text(2);
  EXPECT_NE(text(11).find("--speedup 11: no tolerance reaches it; the most is 10.0x, from 4 mm on"),
            std::string::npos)
      << text(11);
  // Where the small ones allow no hit and are as fast as nothing, those next to them are slower
  const auto from_one = [](double tolerance) {
    ToleranceRow row = Growing(1)(tolerance);
    row.hits = std::max(0.0, row.hits - 0.25);
    row.speedup = SpeedupWithMisses(kFull, kHit, row.hits, tolerance >= 1e-3);
    return row;
  };
  EXPECT_DOUBLE_EQ(MakeToleranceTable(1e-3, 4e-3, 0.95, from_one).reached->row.tolerance, 1e-6);
  EXPECT_DOUBLE_EQ(MakeToleranceTable(1e-3, 4e-3, 1.1, from_one).reached->row.tolerance, 1.8e-3);
  // Nothing was timed
  const auto untimed = [](double tolerance) { return ToleranceRow{tolerance, 1}; };
  const ToleranceTable table = MakeToleranceTable(1e-3, 4e-3, 2, untimed);
  EXPECT_NE(ToleranceText(table, kWords).find("nothing was timed"), std::string::npos);
  EXPECT_TRUE(ToleranceJson<Json>(table, kWords)["wanted_speedup"]["speedup"].is_null());
}

}  // namespace
}  // namespace kpsa::engine
