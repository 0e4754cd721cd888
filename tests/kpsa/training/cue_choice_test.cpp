#include "kpsa/training/cue_choice.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "kpsa/training/estimator.h"
#include "kpsa/training/pca.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kPoints = 60, kPoses = 400;
constexpr double kTolerance = 1e-3;

// A row of points that two controls bend; the outputs follow the stage but for the first `folded` ones, which
// jump to the other side where the first control is large.
PoseMatrix FoldedPoses(std::size_t folded, double jump, unsigned seed) {
  PoseMatrix poses({.points = kPoints, .components = 3, .stage_points = kPoints, .scalars = 3});
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (std::size_t t = 0; t < kPoses; ++t) {
    const std::span<float> row = poses.AddPose();
    const double a = uniform(random), b = uniform(random), c = uniform(random);
    for (std::size_t i = 0; i < kPoints; ++i) {
      const double u = static_cast<double>(i) / kPoints;
      const double p[3] = {u, 0.1 * a * u, 0.1 * b * (1 - u)};
      for (std::size_t k = 0; k < 3; ++k) {
        row[3 * i + k] = static_cast<float>(p[k]);
        row[3 * (kPoints + i) + k] = static_cast<float>(p[k]);
      }
      if (i < folded && c > 0.2) row[3 * i + 2] += static_cast<float>(jump);
    }
    row[6 * kPoints] = static_cast<float>(a);
    row[6 * kPoints + 1] = static_cast<float>(b);
    row[6 * kPoints + 2] = static_cast<float>(1e-7 * c);  // noise that happens to say when points jump
  }
  return poses;
}

struct Fold {
  explicit Fold(std::size_t folded, double jump = 0.01)
      : poses(FoldedPoses(folded, jump, 1)), judges(FoldedPoses(folded, jump, 2)) {
    for (std::size_t i = 0; i < 2 * kPoints; ++i)
      positions.push_back({static_cast<double>(i % kPoints) / kPoints, 0, 0});
    const Eigen::VectorXd mean = poses.Mean();
    poses.Subtract(mean);
    judges.Subtract(mean);
    pca = *ComputePca(poses, mean, {.max_modes = 20});
    noise.scalars = {0, 0, 1e-8};
  }
  std::vector<CueRef> Choose(std::vector<bool> measurable = {}) const {
    return ChooseCues(
               pca, positions, noise, poses,
               {.rows = 20, .min_points = 4, .tolerance = kTolerance, .measurable = std::move(measurable)})
        .cues;
  }
  double LargestError(const std::vector<CueRef>& chosen) const {
    const CueSet cues = MakeCueSet(pca, chosen, noise);
    const PointSurvey survey = SurveyPoints(pca, cues, MapEstimator(pca, cues), poses, 1);
    return *std::max_element(survey.largest.begin(), survey.largest.end());
  }

  PoseMatrix poses, judges;
  std::vector<Double3> positions;
  Pca pca;
  CueNoise noise{1.0};
};

std::vector<Index> Outputs(const std::vector<CueRef>& cues) {
  std::vector<Index> outputs;
  for (const CueRef& cue : cues) {
    if (cue.kind == CueKind::kOutput) outputs.push_back(cue.index);
  }
  return outputs;
}

TEST(CueChoice, PointsThatNoEarlierStageTellsOfAreMeasured) {
  const Fold fold(3);
  std::vector<CueRef> chosen = fold.Choose();
  ASSERT_FALSE(Outputs(chosen).empty());
  for (const Index point : Outputs(chosen)) EXPECT_LT(point, 3u);
  EXPECT_LT(fold.LargestError(chosen), kTolerance);
  std::erase_if(chosen, [](const CueRef& cue) { return cue.kind == CueKind::kOutput; });
  EXPECT_GT(fold.LargestError(chosen), 3 * kTolerance);
}

// Rows of points before a last step, which no plug of the graph gives.
TEST(CueChoice, WhatTheGraphCannotGiveIsNotMeasured) {
  const Fold fold(3);
  std::vector<bool> measurable(kPoints, true);
  measurable[1] = false;
  const std::vector<Index> some = Outputs(fold.Choose(measurable));
  EXPECT_FALSE(some.empty());
  EXPECT_EQ(std::ranges::count(some, Index{1}), 0);
  EXPECT_TRUE(Outputs(fold.Choose(std::vector<bool>(kPoints, false))).empty());
}

TEST(CueChoice, NothingIsMeasuredBehindTheStageWhereTheToleranceIsKeptAnyway) {
  EXPECT_TRUE(Outputs(Fold(0).Choose()).empty());
  EXPECT_TRUE(Outputs(Fold(3, 0.5 * kTolerance).Choose()).empty());
}

TEST(CueChoice, ValuesThatMoveLessThanTheyAreTrustedAreNoCues) {
  const std::vector<CueRef> chosen = Fold(3).Choose();
  EXPECT_EQ(std::count(chosen.begin(), chosen.end(), CueRef{CueKind::kScalar, 2}), 0);
}

// A joint that hardly turned in training, and turns a little more in use: nothing noticeable.
TEST(CueChoice, NoiseKeepsSmallSurprisesSmall) {
  const Fold fold(3);
  const std::vector<CueRef> cues = {{CueKind::kScalar, 0}, {CueKind::kScalar, 1}, {CueKind::kScalar, 2}};
  const auto moved = [&](const CueNoise& noise) {
    const CueSet set = MakeCueSet(fold.pca, cues, noise);
    Eigen::VectorXd y = Eigen::VectorXd::Zero(3);
    y[2] = 1e-4 * set.scale[2];  // a thousand times what it did in training
    return (MapEstimator(fold.pca, set).gain * y).cwiseAbs().maxCoeff();
  };
  EXPECT_GT(moved(CueNoise(1.0)), 1);  // the canary: jumps by metres
  EXPECT_LT(moved(fold.noise), kTolerance);
}

// All points among the cues are of the kind.
bool AllOf(std::span<const CueRef> cues, CueKind kind) {
  return std::all_of(cues.begin(), cues.end(),
                     [&](const CueRef& cue) { return cue.kind == kind || cue.kind == CueKind::kScalar; });
}

// Two places: the outputs, which see the folds, and the stage, which does not.
CueChoice ChoiceAmongPlaces(const Fold& fold, double output_cost, double miss_cost, bool may_choose_rows) {
  CueChoiceOptions options{.rows = 20,
                           .min_points = 4,
                           .tolerance = kTolerance,
                           .judges = &fold.judges,
                           .points_cost =
                               [&](std::span<const CueRef> cues) {
                                 return (AllOf(cues, CueKind::kOutput) ? 0 : 10) +
                                        (AllOf(cues, CueKind::kStage) ? 0 : output_cost);
                               },
                           .miss_cost = miss_cost,
                           .violation_rate = 0.05};
  CuePlace stage, outputs;
  for (Index i = 0; i < kPoints; ++i) {
    stage.push_back({CueKind::kStage, i});
    outputs.push_back({CueKind::kOutput, i});
  }
  options.places = {outputs, stage};
  options.may_choose_rows = may_choose_rows;
  return ChooseCues(fold.pca, fold.positions, fold.noise, fold.poses, options);
}

std::vector<CueRef> ChooseAmongPlaces(const Fold& fold, double output_cost, double miss_cost) {
  std::vector<CueRef> chosen = ChoiceAmongPlaces(fold, output_cost, miss_cost, false).cues;
  std::erase_if(chosen, [](const CueRef& cue) { return cue.kind == CueKind::kScalar; });
  return chosen;
}

std::size_t RowsOf(const std::vector<CueRef>& cues) {
  std::size_t rows = 0;
  for (const CueRef& cue : cues) rows += cue.kind == CueKind::kScalar ? 1 : 3;
  return rows;
}

TEST(CueChoice, AnEarlierPlaceIsTakenWhereItSeesEnough) {
  const std::vector<CueRef> chosen = ChooseAmongPlaces(Fold(0), 100, 1000);
  ASSERT_FALSE(chosen.empty());
  EXPECT_TRUE(AllOf(chosen, CueKind::kStage));
}

TEST(CueChoice, ALaterPlaceIsTakenWhereMissesWouldCostMore) {
  const std::vector<CueRef> chosen = ChooseAmongPlaces(Fold(3), 100, 1000);
  ASSERT_FALSE(chosen.empty());
  EXPECT_TRUE(AllOf(chosen, CueKind::kOutput));
  // Four in ten poses fold: misses that cost little are the better bargain
  EXPECT_FALSE(AllOf(ChooseAmongPlaces(Fold(3), 100, 20), CueKind::kOutput));
}

TEST(CueChoice, NoMoreNumbersAreMeasuredThanJudgesNeed) {
  const Fold fold(0);  // two scalars tell all
  const std::size_t all = RowsOf(ChoiceAmongPlaces(fold, 100, 1000, false).cues),
                    chosen = RowsOf(ChoiceAmongPlaces(fold, 100, 1000, true).cues);
  EXPECT_LT(chosen, all);
  EXPECT_GE(chosen, 2u);
}

TEST(CueChoice, WhatWouldCostLessButForItsMissesIsToldOf) {
  const Fold fold(3);
  const CueChoice choice = ChoiceAmongPlaces(fold, 100, 1000, false);
  ASSERT_FALSE(choice.cheaper.empty());
  for (const CueChoice::Other& other : choice.cheaper) {
    EXPECT_TRUE(AllOf(other.cues, CueKind::kStage));
    EXPECT_LT(other.cost_of_hits, choice.cost / 2);
    EXPECT_GE(other.cost, choice.cost);
  }
  EXPECT_TRUE(ChoiceAmongPlaces(fold, 0, 1000, false).cheaper.empty());
}

TEST(CueChoice, PaperModeTakesTwoPointsAMode) {
  const Fold fold(0);
  const std::vector<CueRef> cues = ChoosePaperCues(fold.pca, fold.positions, 1.0);
  EXPECT_LE(cues.size(), static_cast<std::size_t>(2 * fold.pca.mode_count()));
  for (const CueRef& cue : cues) EXPECT_EQ(cue.kind, CueKind::kOutput);
}

}  // namespace
}  // namespace kpsa::engine
