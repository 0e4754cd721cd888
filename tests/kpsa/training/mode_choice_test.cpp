#include "kpsa/training/mode_choice.h"

#include <gtest/gtest.h>

#include <random>

#include "kpsa/training/estimator.h"
#include "tests/kpsa/synthetic.h"

namespace kpsa::engine {
namespace {

// Five motions of falling size that all points share, and noise of every value by itself.
struct NoisyPoses {
  static constexpr std::size_t kPoints = 80, kMotions = 5;
  explicit NoisyPoses(double noise_size) : noise(noise_size), random(3) {
    for (float& x : motions) x = static_cast<float>(normal(random));
  }
  PoseMatrix Draw(std::size_t count) {
    PoseMatrix poses(PoseLayout{kPoints, 3, 0, 0});
    for (std::size_t t = 0; t < count; ++t) {
      const std::span<float> row = poses.AddPose();
      for (std::size_t k = 0; k < kMotions; ++k) {
        const double size = normal(random) * 3 / (1 + static_cast<double>(k));
        for (std::size_t i = 0; i < row.size(); ++i)
          row[i] += static_cast<float>(size) * motions[k * row.size() + i];
      }
      for (float& x : row) x += static_cast<float>(noise * normal(random));
    }
    return poses;
  }
  double noise;
  std::mt19937 random;
  std::normal_distribution<double> normal;
  std::vector<float> motions = std::vector<float>(kMotions * 3 * kPoints);
};

std::vector<CueRef> SpreadCues(std::size_t count) {
  std::vector<CueRef> cues;
  for (const Index point : GoldenSpread(NoisyPoses::kPoints, count))
    cues.push_back({CueKind::kOutput, point});
  return cues;
}

TEST(ModeChoice, KeepsTheMotionsAndLeavesTheNoise) {
  NoisyPoses source(0.5);
  PoseMatrix training = source.Draw(60), held_out = source.Draw(40);
  const Eigen::VectorXd mean = training.Mean();
  training.Subtract(mean);
  held_out.Subtract(mean);
  const Pca all = std::move(*ComputePca(training, mean, {.max_modes = 50}));
  ASSERT_EQ(all.mode_count(), 50);
  const std::vector<CueRef> cues = SpreadCues(12);
  const CueNoise noise(1e-6);
  const Eigen::Index chosen = ChooseModeCount(all, cues, noise, held_out);
  EXPECT_GE(chosen, 4);
  EXPECT_LE(chosen, 8);
  // With all modes, cues are trusted that carry noise
  const auto error = [&](Eigen::Index modes) {
    const Pca pca = TruncatedPca(all, modes);
    const CueSet set = MakeCueSet(pca, cues, noise);
    return RmsError(EstimateErrors(pca, set, MapEstimator(pca, set), held_out), NoisyPoses::kPoints);
  };
  EXPECT_LT(error(chosen), 0.8 * error(50));
}

TEST(ModeChoice, KeepsAllModesOfCleanPoses) {
  NoisyPoses source(0);
  PoseMatrix training = source.Draw(30), held_out = source.Draw(20);
  const Eigen::VectorXd mean = training.Mean();
  training.Subtract(mean);
  held_out.Subtract(mean);
  const Pca all = std::move(*ComputePca(training, mean, {.max_modes = 20, .min_ratio = 1e-5}));
  EXPECT_EQ(all.mode_count(), 5);
  EXPECT_EQ(ChooseModeCount(all, SpreadCues(12), CueNoise(1e-6), held_out), 5);
}

TEST(ModeChoice, ResidualsOfTrainingAreTooSmall) {
  EXPECT_DOUBLE_EQ(HonestResidual(2, 101, 50), 4);
  EXPECT_DOUBLE_EQ(HonestResidual(2, 101, 0), 2);
  EXPECT_DOUBLE_EQ(HonestResidual(2, 11, 10), 20);  // nothing left to judge by
}

TEST(ModeChoice, SpreadsOverRowsAndColumns) {
  const std::vector<Index> points = GoldenSpread(160000, 200);
  ASSERT_EQ(points.size(), 200u);
  std::vector<int> rows(8), columns(8);
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (i > 0) {
      EXPECT_LT(points[i - 1], points[i]);
    }
    ++rows[points[i] / 400 / 50], ++columns[points[i] % 400 / 50];
  }
  for (int count : rows) EXPECT_NEAR(count, 25, 3);
  for (int count : columns) EXPECT_NEAR(count, 25, 3);
  EXPECT_EQ(GoldenSpread(3, 5), (std::vector<Index>{0, 1, 2}));
}

}  // namespace
}  // namespace kpsa::engine
