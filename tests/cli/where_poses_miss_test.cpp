// What training tries where many poses would miss: tiles stored finely, cues as for half the tolerance.
#include <algorithm>
#include <set>
#include <string>

#include "kpsa/training_record.h"
#include "tests/cli/hello_folder.h"
#include "tests/cli/process.h"
#include "tests/cli/rig_run.h"

namespace kpsa::engine {
namespace {

// Storing costs errors: where poses miss, tiles are stored finely if that pays, and that is told.
class FinerTiles : public ::testing::Test {
 protected:
  // What training compared; tiles stored finely are in it only where they were tried.
  static std::vector<TrainingRecord::Tried> Tried(TrainOptions options) {
    options.may_have_cues_by_tile = false;  // whose tiles are stored finely anyway
    options.inner = TrainOptions::Inner::kNever;
    const auto trained = TrainRig(kHello, options);
    EXPECT_NE(trained, nullptr);
    if (trained == nullptr) return {};
    const TrainingRecord record = ParseTraining(trained->training);
    // Of the worst pose each control once, however often there was calibrated
    std::set<std::string> controls;
    for (const auto& [plug, value] : record.worst.controls) EXPECT_TRUE(controls.insert(plug).second) << plug;
    return record.tried;
  }
  static void ExpectTheCheaperIsTaken(const TrainOptions& options) {
    const std::vector<TrainingRecord::Tried> tried = Tried(options);
    ASSERT_GE(tried.size(), 2u);
    const auto coarse = std::ranges::find(tried, kForAllPoints, &TrainingRecord::Tried::what);
    ASSERT_NE(coarse, tried.end());
    EXPECT_GT(coarse->misses, 0.2);
    EXPECT_TRUE(std::ranges::any_of(tried, [](const TrainingRecord::Tried& one) {
      return one.what == kFinelyStored || one.what == kFewerCues;  // which are stored finely, too
    }));
    const auto least = std::ranges::min_element(tried, {}, &TrainingRecord::Tried::cost);
    for (const TrainingRecord::Tried& one : tried) EXPECT_EQ(one.taken, &one == &*least) << one.what;
  }
};

TEST_F(FinerTiles, AreTriedWherePosesMissAndTakenWhereTheyCostLess) {
  TrainOptions options = QuickTraining();
  options.max_modes = 3;  // too few: hardly a pose is within the tolerance
  ExpectTheCheaperIsTaken(options);
  options = QuickTraining();
  options.samples = 100;  // of which a tolerance of microns is too much to ask
  for (const double tolerance : {1.5e-5, 2e-5, 2.5e-5}) {
    options.tolerance = tolerance;
    ExpectTheCheaperIsTaken(options);
  }
}

TEST_F(FinerTiles, AreNotTriedWhereHardlyAnyPoseMisses) {
  TrainOptions options = QuickTraining();
  options.tolerance = 1e-3;
  const std::vector<TrainingRecord::Tried> tried = Tried(options);
  EXPECT_EQ(std::ranges::find(tried, kFinelyStored, &TrainingRecord::Tried::what), tried.end());
}

// Trained for a larger tolerance, a character hits as often: where cues for it miss, those for half of it are
// taken, which measure the points that are farthest off.
TEST(WherePosesMiss, ALargerToleranceHitsAsOften) {
  for (const double tolerance : {2e-3, 8e-3}) {
    SCOPED_TRACE(tolerance);
    TrainOptions options;
    options.tolerance = tolerance;
    const auto trained = TrainRig(kHello, options, {"wave"});
    ASSERT_NE(trained, nullptr);
    EXPECT_GE(HitsOf(kHello, trained, "wave", 24), 22u);
  }
}

}  // namespace
}  // namespace kpsa::engine
