// Which poses training goes on with, where there are too many.
#include "kpsa/training/time_limit.h"

#include <gtest/gtest.h>

#include <limits>
#include <set>

#include "kpsa/training/calibrate_subspace.h"
#include "kpsa/training/training_poses.h"

namespace kpsa::engine {
namespace {

// Poses whose only point says their number.
PoseMatrix Numbered(std::size_t count) {
  PoseLayout layout;
  layout.points = 1;
  PoseMatrix poses(layout);
  for (std::size_t t = 0; t < count; ++t) poses.AddPose()[0] = static_cast<float>(t);
  return poses;
}
std::vector<float> Numbers(const PoseMatrix& poses) {
  std::vector<float> numbers;
  for (std::size_t t = 0; t < poses.poses(); ++t) numbers.push_back(poses.row(t)[0]);
  return numbers;
}

TEST(KeepSpread, LeavesPosesOfClipsAndSamplesInTheirShares) {
  PoseMatrix poses = Numbered(100);
  std::size_t of_clips = 40;
  KeepSpread(10, &poses, &of_clips);
  const std::vector<float> kept = Numbers(poses);
  ASSERT_EQ(kept.size(), 10u);
  EXPECT_TRUE(std::is_sorted(kept.begin(), kept.end()));
  EXPECT_EQ(std::count_if(kept.begin(), kept.end(), [](float t) { return t < 40; }),
            static_cast<std::ptrdiff_t>(of_clips));
  EXPECT_NEAR(static_cast<double>(of_clips), 4, 1);
}

// What has to come at the end is nobody else's: a quarter of the rest is what samples may take.
TEST(TimeLimits, SetAsideWhatCalibrationTakesAtLeast) {
  TrainOptions options;
  options.violation_rate = 0.05, options.calibration_poses = 0;
  const double fewest = LeastCalibrationSeconds(0.01, options);
  EXPECT_GT(fewest, 0.01 * 2 * 45) << "of each kind as many as promise one in twenty, twice";
  options.violation_rate = 0.01;
  EXPECT_GT(LeastCalibrationSeconds(0.01, options), 2 * fewest);
  options.calibration_poses = 1000;
  EXPECT_GT(LeastCalibrationSeconds(0.01, options), 0.01 * 2 * 1000);
  TrainingPoses poses(Numbered(1).layout());
  poses.pose_seconds = 0.01;
  TimeLimit limit(1000);
  EXPECT_EQ(poses.SampledWithin(limit, 100), 100u);
  EXPECT_NEAR(static_cast<double>(poses.SampledWithin(limit, 1'000'000)), 25'000, 2500);
  limit.Reserve(800);
  EXPECT_NEAR(static_cast<double>(poses.SampledWithin(limit, 1'000'000)), 5000, 2500);
  limit.Reserve(2000);
  EXPECT_EQ(poses.SampledWithin(limit, 100), 0u);
  EXPECT_EQ(poses.SampledWithin(TimeLimit(std::numeric_limits<double>::infinity()), 100), 100u);
}

TEST(SpareForModes, TakesAQuarterWhereThereIsTooMuchWork) {
  PoseMatrix poses = Numbered(101);
  std::size_t of_clips = 41;
  EXPECT_FALSE(SpareForModes(&poses, &of_clips).has_value());
  EXPECT_EQ(poses.poses(), 101u);
  EXPECT_EQ(of_clips, 41u);
  const std::optional<PoseMatrix> spare = SpareForModes(&poses, &of_clips, 1000);
  ASSERT_TRUE(spare.has_value());
  const std::vector<float> kept = Numbers(poses), taken = Numbers(*spare);
  EXPECT_EQ(taken.size(), 25u);
  EXPECT_EQ(std::count_if(kept.begin(), kept.end(), [](float t) { return t < 41; }),
            static_cast<std::ptrdiff_t>(of_clips))
      << "which come first";
  std::set<float> all(kept.begin(), kept.end());
  all.insert(taken.begin(), taken.end());
  EXPECT_EQ(all.size(), 101u) << "no pose is lost";
}

}  // namespace
}  // namespace kpsa::engine
