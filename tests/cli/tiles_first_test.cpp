// With many tiles, cues of these are made first (SubspaceCandidates::OfTilesAlone).
#include <algorithm>

#include "kpsa/training_record.h"
#include "tests/cli/hello_folder.h"
#include "tests/cli/rig_run.h"

namespace kpsa::engine {
namespace {

class TilesFirst : public ::testing::Test {
 protected:
  static TrainOptions Options(double tolerance) {
    TrainOptions options = QuickTraining();
    options.many_tiles = 1;
    options.samples = 300;
    options.violation_rate = 0.1;
    options.tolerance = tolerance;
    options.inner = TrainOptions::Inner::kNever;
    options.without.mends = true;
    return options;
  }
  static bool IsTried(const Subspace& trained, const char* what) {
    const std::vector<TrainingRecord::Tried> tried = ParseTraining(trained.training).tried;
    return std::ranges::find(tried, what, &TrainingRecord::Tried::what) != tried.end();
  }
};

TEST_F(TilesFirst, NothingElseIsLookedForWhereTheyServe) {
  const auto trained = TrainRig(kHello, Options(4e-3));
  ASSERT_NE(trained, nullptr);
  EXPECT_TRUE(trained->by_tile());
  EXPECT_TRUE(IsTried(*trained, kByTile));
  for (const char* what : {kForAllPoints, kFinelyStored, kFewerCues}) EXPECT_FALSE(IsTried(*trained, what));
  EXPECT_GE(HitsOf(kHello, trained, "wave", 24), 22u);
}

// What was recorded for tiles alone is set aside: modes and cues for all points are those that would have been found anyway.
TEST_F(TilesFirst, WhereTheyMissAllIsAsIfNothingHadBeen) {
  TrainOptions options = Options(1.5e-5);
  options.samples = options.calibration_poses = 100;
  const auto after = TrainRig(kHello, options);
  options.keep_modes = true;  // then they are not first
  const auto before = TrainRig(kHello, options);
  ASSERT_NE(after, nullptr);
  ASSERT_NE(before, nullptr);
  EXPECT_TRUE(IsTried(*after, kByTile));
  EXPECT_TRUE(IsTried(*after, kFinelyStored) || IsTried(*after, kForAllPoints));
  EXPECT_EQ(after->cues, before->cues);
  ASSERT_EQ(after->tiles.size(), before->tiles.size());
  for (std::size_t m = 0; m < after->tiles.size(); ++m) {
    const TileData &a = after->tiles[m].data(), &b = before->tiles[m].data();
    EXPECT_EQ(a.columns, b.columns);
    EXPECT_TRUE(std::ranges::equal(a.u.span(), b.u.span()));
    EXPECT_TRUE(std::ranges::equal(a.v.span(), b.v.span()));
    EXPECT_TRUE(std::ranges::equal(a.mean.span(), b.mean.span()));
  }
  EXPECT_TRUE(std::ranges::equal(after->calibration, before->calibration, {}, &CalibrationPair::error,
                                 &CalibrationPair::error));
}

}  // namespace
}  // namespace kpsa::engine
