// kpsa train --time: what does not fit is left out, and said; with time enough, nothing changes.
#include <nlohmann/json.hpp>

#include "tests/cli/hello_folder.h"
#include "tests/cli/process.h"
#include "tests/cli/rig_run.h"

namespace kpsa::engine {
namespace {

TrainOptions WithSeconds(double seconds) {
  TrainOptions options = QuickTraining();
  options.seconds = seconds;
  return options;
}

TEST(TimeLimits, ThatAreTooShortLeaveAsFewPosesAsCanBeTrainedOn) {
  const auto all = TrainRig(kHello, QuickTraining(), {"wave"}),
             some = TrainRig(kHello, WithSeconds(1e-6), {"wave"});
  ASSERT_TRUE(all != nullptr && some != nullptr);
  const TrainingRecord full = ParseTraining(all->training), limited = ParseTraining(some->training);
  EXPECT_TRUE(full.limited.empty());
  EXPECT_NE(limited.limited.find("250 of " + std::to_string(full.clip_poses + full.sampled_poses) + " poses"),
            std::string::npos)
      << limited.limited;
  EXPECT_EQ(limited.clip_poses + limited.sampled_poses, 250u);
  EXPECT_GT(limited.clip_poses, 0u);
  EXPECT_GT(limited.sampled_poses, limited.clip_poses) << "both, evenly";
  EXPECT_EQ(limited.calibration_poses, full.calibration_poses) << "what is promised stays promised";
  RigRun exact(kHello), fast(kHello, {.subspace = some});
  std::size_t wrong = 0;
  for (const std::vector<double>& pose : SmoothPoses(exact.rig, 40, 0.9)) {
    exact.Pose(pose), fast.Pose(pose);
    wrong += LargestDistance(fast.Evaluate().points, exact.Evaluate().points) > kQuickTolerance;
  }
  EXPECT_LE(wrong, 4u);
}

// Calibration, too, where nobody asks for a number of poses: as many as can promise the rate, and no margins.
TEST(TimeLimits, ShortenACalibrationThatNobodyAskedFor) {
  TrainOptions options = WithSeconds(1e-6);
  options.calibration_poses = 0;
  const auto some = TrainRig(kHello, options, {"wave"});
  options.seconds = kInfinity;
  const auto all = TrainRig(kHello, options, {"wave"});
  ASSERT_TRUE(all != nullptr && some != nullptr);
  const TrainingRecord full = ParseTraining(all->training), limited = ParseTraining(some->training);
  EXPECT_NE(limited.limited.find(" of 400 poses of a kind to calibrate with, no ranges beyond"),
            std::string::npos)
      << limited.limited;
  EXPECT_LT(limited.calibration_poses, full.calibration_poses / 3);
  const Calibration calibration =
      Calibrate(some->calibration, some->tolerance, some->violation_rate, some->blend_start);
  EXPECT_TRUE(calibration.enough_poses) << calibration.warning;
  EXPECT_GT(calibration.hits, 0u);
}

TEST(TimeLimits, ThatAreLongEnoughChangeNothing) {
  const auto without = TrainRig(kHello, QuickTraining(), {"wave"}),
             with = TrainRig(kHello, WithSeconds(1e6), {"wave"});
  ASSERT_TRUE(without != nullptr && with != nullptr);
  EXPECT_EQ(without->training, with->training);
  const TemporaryFolder folder;
  ASSERT_TRUE(WriteSubspace(*without, folder / "a.kpsa").ok());
  ASSERT_TRUE(WriteSubspace(*with, folder / "b.kpsa").ok());
  const std::string bytes = TemporaryFolder::Read(folder / "a.kpsa");
  EXPECT_GT(bytes.size(), 10'000u);
  EXPECT_EQ(bytes, TemporaryFolder::Read(folder / "b.kpsa"));
}

TEST(TimeLimits, AreSecondsAndWhatTheyLeftOutIsTold) {
  const HelloFolder folder;
  for (const char* time : {"0", "-3s", "soon", "2mm"}) {
    const ProcessResult run = RunKpsa({"train", "hello.yaml", "--time", time}, 60, folder.path());
    EXPECT_EQ(run.exit_code, 2) << time;
    EXPECT_NE(run.err.find("--time \"" + std::string(time) + "\": expected seconds"), std::string::npos)
        << run.err;
  }
  const ProcessResult run =
      RunKpsa({"train", "hello.yaml", "--force", "--time", "0.000001s", "-q"}, 60, folder.path());
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(run.out.find("in the time and memory given: 250 of "), std::string::npos) << run.out;
}

}  // namespace
}  // namespace kpsa::engine
