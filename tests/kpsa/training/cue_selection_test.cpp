#include "kpsa/training/cue_selection.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <set>

#include "kpsa/training/estimator.h"
#include "kpsa/training/selection_kernel.h"
#include "tests/kpsa/synthetic.h"

namespace kpsa::engine {
namespace {

using test::Sheet;

Pca Train(const Sheet& sheet, const PoseLayout& layout, const PcaOptions& options, std::size_t count = 120) {
  PoseMatrix poses = sheet.RandomPoses(count, 2, layout);
  const Eigen::VectorXd mean = poses.Mean();
  poses.Subtract(mean);
  Result<Pca> pca = ComputePca(poses, mean, options);
  EXPECT_TRUE(pca.ok());
  return std::move(*pca);
}

std::vector<Double3> Positions(const Sheet& sheet, const PoseLayout& layout) {
  std::vector<Double3> positions = sheet.rest();
  if (layout.stage_points > 0) positions.insert(positions.end(), sheet.rest().begin(), sheet.rest().end());
  return positions;
}

// Posterior covariance of the modes given cues, by the textbook formula.
Eigen::MatrixXd Posterior(const Pca& pca, const CueSet& cues) {
  const Eigen::MatrixXd l = pca.mode_variance().asDiagonal(), c = cues.loadings;
  if (cues.rows() == 0) return l;
  Eigen::MatrixXd g = c * l * c.transpose();
  g.diagonal() += cues.noise;
  return l - l * c.transpose() * g.llt().solve(c * l);
}
double Gain(const Eigen::MatrixXd& sigma, const Eigen::MatrixXd& w, const CueSet& cue) {
  const Eigen::MatrixXd t = cue.loadings * sigma;
  Eigen::MatrixXd g = t * cue.loadings.transpose();
  g.diagonal() += cue.noise;
  return g.llt().solve(t * w * t.transpose()).trace();
}
Eigen::MatrixXd Weight(const Pca& pca) { return pca.output_modes().transpose() * pca.output_modes(); }

double ExpectedRms(const Pca& pca, std::span<const CueRef> cues, double diagonal) {
  const Eigen::MatrixXd sigma = Posterior(pca, MakeCueSet(pca, cues, diagonal));
  return std::sqrt(sigma.cwiseProduct(Weight(pca)).sum() / static_cast<double>(pca.layout.points));
}

TEST(CueSelection, GreedyAgreesWithTheNaiveTwin) {
  const Sheet sheet(100, 12, 1);
  for (const bool joint : {false, true}) {
    const PoseLayout layout = sheet.Layout(true, true);
    PcaOptions options{.max_modes = 20};
    if (joint) options.stage_weight = 0.5, options.scalar_weight = 1e-4;
    const Pca pca = Train(sheet, layout, options);
    const std::vector<CueRef> candidates = AllCandidates(pca, 1e-4, true, true, true);
    const std::vector<Double3> positions = Positions(sheet, layout);
    CueSelectionOptions selection_options{.count = 8, .swap_passes = 0};
    const auto cost = [](CueRef cue, std::span<const CueRef>) {
      return cue.kind == CueKind::kOutput ? 3.0 : cue.kind == CueKind::kStage ? 1.0 : 0.5;
    };
    selection_options.marginal_cost = cost;
    const CueSelection selection =
        SelectCues(pca, candidates, positions, sheet.diagonal(), selection_options);

    const Eigen::MatrixXd w = Weight(pca);
    std::vector<CueRef> naive;
    for (std::size_t step = 0; step < 8; ++step) {
      const Eigen::MatrixXd sigma = Posterior(pca, MakeCueSet(pca, naive, sheet.diagonal()));
      double best = 0;
      CueRef best_cue;
      for (const CueRef candidate : candidates) {
        if (std::find(naive.begin(), naive.end(), candidate) != naive.end()) continue;
        const double value =
            Gain(sigma, w, MakeCueSet(pca, {&candidate, 1}, sheet.diagonal())) / cost(candidate, {});
        if (value > best) best = value, best_cue = candidate;
      }
      naive.push_back(best_cue);
    }
    EXPECT_EQ(selection.cues, naive) << joint;
    EXPECT_NEAR(selection.final_rms / ExpectedRms(pca, naive, sheet.diagonal()), 1, 1e-5);
    double total = 0;
    for (const CueRef cue : selection.cues) total += cost(cue, {});
    EXPECT_DOUBLE_EQ(selection.cost, total);
  }
}

TEST(CueSelection, ManyCuesKeepTheGainsExact) {
  const Sheet sheet(120, 20, 3);
  const PoseLayout layout = sheet.Layout();
  const Pca pca = Train(sheet, layout, {.max_modes = 50}, 200);
  const CueSelection selection = SelectCues(pca, AllCandidates(pca, 1e-4, true, false, false), sheet.rest(),
                                            sheet.diagonal(), {.count = 40});
  ASSERT_EQ(selection.cues.size(), 40u);
  EXPECT_NEAR(selection.final_rms / ExpectedRms(pca, selection.cues, sheet.diagonal()), 1, 1e-3);
  for (std::size_t i = 1; i < selection.expected_rms.size(); ++i)
    EXPECT_LE(selection.expected_rms[i], selection.expected_rms[i - 1]);
  EXPECT_LE(selection.final_rms, selection.expected_rms.back() * (1 + 1e-9));  // swaps never make it worse
  EXPECT_GT(selection.swaps, 0);
  const std::set<Index> distinct = [&] {
    std::set<Index> set;
    for (const CueRef cue : selection.cues) set.insert(cue.index);
    return set;
  }();
  EXPECT_EQ(distinct.size(), 40u);
}

TEST(CueSelection, BetterThanRandomPoints) {
  const Sheet sheet(150, 20, 4);
  const Pca pca = Train(sheet, sheet.Layout(), {.max_modes = 30});
  const std::vector<CueRef> candidates = AllCandidates(pca, 1e-4, true, false, false);
  const double chosen = SelectCues(pca, candidates, sheet.rest(), sheet.diagonal(), {.count = 10}).final_rms;
  std::mt19937 random(5);
  for (int i = 0; i < 10; ++i) {
    std::vector<CueRef> some;
    for (int k = 0; k < 10; ++k) some.push_back(candidates[random() % candidates.size()]);
    EXPECT_LT(1.2 * chosen, ExpectedRms(pca, some, sheet.diagonal()));
  }
}

TEST(CueSelection, BudgetFixedCuesAndDistances) {
  const Sheet sheet(150, 20, 6);
  const PoseLayout layout = sheet.Layout(false, true);
  const Pca pca = Train(sheet, layout, {.max_modes = 30});
  const std::vector<CueRef> candidates = AllCandidates(pca, 1e-4, true, false, true);
  CueSelectionOptions options{.count = 30, .max_cost = 10, .min_distance = 0.06};
  const std::vector<CueRef> fixed = {{CueKind::kOutput, candidates[77].index}, {CueKind::kScalar, 3}};
  options.fixed = fixed;
  options.marginal_cost = [](CueRef cue, std::span<const CueRef> chosen) {
    return cue.kind == CueKind::kScalar ? 0.1 : chosen.size() < 3 ? 1.0 : 2.0;
  };
  const CueSelection selection = SelectCues(pca, candidates, sheet.rest(), sheet.diagonal(), options);
  ASSERT_GE(selection.cues.size(), 4u);
  EXPECT_EQ(selection.cues[0], fixed[0]);
  EXPECT_EQ(selection.cues[1], fixed[1]);
  EXPECT_LE(selection.cost, 10 + 1e-9);
  for (std::size_t i = 0; i < selection.cues.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      if (selection.cues[i].kind == CueKind::kScalar || selection.cues[j].kind == CueKind::kScalar) continue;
      EXPECT_GT(Length(sheet.rest()[selection.cues[i].index] - sheet.rest()[selection.cues[j].index]), 0.06);
    }
  }
  // Fixed cues need not be candidates
  const CueSelection points =
      SelectCues(pca, AllCandidates(pca, 1e-4, true, false, false), sheet.rest(), sheet.diagonal(),
                 {.count = 5, .fixed = std::span<const CueRef>(fixed).subspan(1)});
  EXPECT_EQ(points.cues[0], fixed[1]);
  EXPECT_EQ(points.cues.size(), 5u);
  // A large minimum distance leaves few points; without scalars the selection ends early
  const CueSelection few = SelectCues(pca, AllCandidates(pca, 1e-4, true, false, false), sheet.rest(),
                                      sheet.diagonal(), {.count = 30, .min_distance = 0.4});
  EXPECT_LT(few.cues.size(), 6u);
  EXPECT_GE(few.cues.size(), 2u);
}

TEST(CueSelection, CoincidentPointsAreOneChoice) {
  const Sheet sheet(60, 8, 7);
  PoseMatrix poses({.points = 120});  // every point twice
  std::vector<Double3> positions;
  for (int copy = 0; copy < 2; ++copy)
    positions.insert(positions.end(), sheet.rest().begin(), sheet.rest().end());
  std::mt19937 random(8);
  for (int t = 0; t < 60; ++t) {
    const std::vector<double> values = sheet.RandomControls(&random);
    const std::span<float> row = poses.AddPose();
    for (std::size_t i = 0; i < 120; ++i) {
      for (int c = 0; c < 3; ++c)
        row[3 * i + static_cast<std::size_t>(c)] = static_cast<float>(sheet.Point(i % 60, values)[c]);
    }
  }
  const Eigen::VectorXd mean = poses.Mean();
  poses.Subtract(mean);
  const Result<Pca> pca = ComputePca(poses, mean, {.max_modes = 12});
  ASSERT_TRUE(pca.ok());
  const CueSelection selection = SelectCues(*pca, AllCandidates(*pca, 1e-4, true, false, false), positions,
                                            sheet.diagonal(), {.count = 12});
  std::set<Index> places;
  for (const CueRef cue : selection.cues) places.insert(cue.index % 60);
  EXPECT_EQ(places.size(), selection.cues.size());
}

TEST(CueSelection, CandidatesThatDoNotMoveAreLeftOut) {
  PoseMatrix poses({.points = 4, .components = 3, .stage_points = 0, .scalars = 2});
  for (int t = 0; t < 10; ++t) {
    const std::span<float> row = poses.AddPose();
    row[0] = static_cast<float>(t);              // point 0 moves
    row[6] = 1e-6f * static_cast<float>(t % 3);  // point 2 hardly does
    row[12] = 0.3f;                              // scalar 0 stands still
    row[13] = static_cast<float>(t % 4);
  }
  const Eigen::VectorXd mean = poses.Mean();
  poses.Subtract(mean);
  const Result<Pca> pca = ComputePca(poses, mean, {});
  ASSERT_TRUE(pca.ok());
  const std::vector<CueRef> expected = {{CueKind::kOutput, 0}, {CueKind::kScalar, 1}};
  EXPECT_EQ(AllCandidates(*pca, 1e-4, true, true, true), expected);
}

TEST(CueSet, ScalarsAreNormalisedAndCarryTheirOwnNoise) {
  const Sheet sheet(80, 6, 9);
  const Pca pca = Train(sheet, sheet.Layout(false, true), {.max_modes = 3});
  const std::vector<CueRef> cues = {{CueKind::kOutput, 5}, {CueKind::kScalar, 2}};
  const CueSet set = MakeCueSet(pca, cues, sheet.diagonal());
  ASSERT_EQ(set.rows(), 4);
  EXPECT_EQ(set.offsets, (std::vector<Index>{0, 3, 4}));
  const auto column = static_cast<Eigen::Index>(CueColumn(pca.layout, cues[1]));
  EXPECT_DOUBLE_EQ(set.scale[3] * std::sqrt(pca.row_variance[column]), 1);
  // Its variance splits into what the modes explain and noise
  EXPECT_NEAR(
      (set.loadings.row(3).array().square() * pca.mode_variance().transpose().array()).sum() + set.noise[3],
      1, 1e-6);
  EXPECT_GE(set.noise.head(3).minCoeff(), pca.output_noise());
}

}  // namespace
}  // namespace kpsa::engine
