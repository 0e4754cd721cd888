#include "kpsa/training/estimator.h"

#include <gtest/gtest.h>

#include "kpsa/training/eigen_solvers.h"
#include "kpsa/training/error_split.h"
#include "kpsa/training/varimax.h"
#include "tests/kpsa/synthetic.h"

namespace kpsa::engine {
namespace {

using test::Sheet;

// A sheet with training and test poses, both centred with the training mean.
struct Fixture {
  Fixture(std::size_t points, std::size_t controls, std::size_t count, const PcaOptions& options,
          bool stages = false, bool scalars = false)
      : sheet(points, controls, 1),
        training(sheet.RandomPoses(count, 2, sheet.Layout(stages, scalars))),
        test(sheet.RandomPoses(60, 3, sheet.Layout(stages, scalars))) {
    const Eigen::VectorXd mean = training.Mean();
    training.Subtract(mean);
    test.Subtract(mean);
    Result<Pca> result = ComputePca(training, mean, options);
    EXPECT_TRUE(result.ok());
    pca = std::move(*result);
  }
  std::vector<CueRef> KeyPoints(Eigen::Index modes, int per_mode) const {
    Eigen::MatrixXd rotated = TruncatedPca(pca, modes).output_modes();
    Varimax({}, 3, &rotated);
    return SelectKeyPoints(rotated, 3, sheet.rest(), per_mode, 0.05);
  }
  std::vector<CueRef> Optimal(std::size_t count, bool outputs = true, bool stages = false,
                              bool scalars = false) const {
    std::vector<Double3> positions = sheet.rest();
    if (pca.layout.stage_points > 0)
      positions.insert(positions.end(), sheet.rest().begin(), sheet.rest().end());
    return SelectCues(pca, AllCandidates(pca, 1e-4, outputs, stages, scalars), positions, sheet.diagonal(),
                      {.count = count})
        .cues;
  }
  double MapRms(const std::vector<CueRef>& cues) const {
    const CueSet set = MakeCueSet(pca, cues, sheet.diagonal());
    return RmsError(EstimateErrors(pca, set, MapEstimator(pca, set), test), sheet.points());
  }

  Sheet sheet;
  PoseMatrix training, test;
  Pca pca;
};

// The split of errors that bench reports, from points alone.
TEST(ErrorSplit, IsThatOfTheEstimatorWhereTheMapIsDense) {
  const Fixture s(200, 20, 150, {.max_modes = 30});
  const CueSet cues = MakeCueSet(s.pca, s.Optimal(8), s.sheet.diagonal());
  const Estimator estimator = MapEstimator(s.pca, cues);
  const std::vector<PoseErrors> expected = EstimateErrors(s.pca, cues, estimator, s.test);
  const auto frames = static_cast<Eigen::Index>(s.test.poses()), rows = s.pca.output_modes().rows();
  Eigen::MatrixXd poses(rows, frames), estimates(rows, frames);
  for (Eigen::Index t = 0; t < frames; ++t) {
    const std::span<const float> row = s.test.row(static_cast<std::size_t>(t));
    poses.col(t) = Eigen::Map<const Eigen::VectorXf>(row.data(), rows).cast<double>();
    estimates.col(t) = estimator.gain * MeasuredCues(s.pca.layout, cues, row);
  }
  const std::vector<SplitError> split = SplitErrors(s.pca.output_modes(), poses, estimates);
  for (std::size_t t = 0; t < split.size(); ++t) {
    EXPECT_NEAR(split[t].projection, expected[t].projection, 1e-10);
    EXPECT_NEAR(split[t].cueing, expected[t].cue, 1e-10);
    EXPECT_NEAR(split[t].total, expected[t].total, 1e-10);
    EXPECT_LT(split[t].storage, 1e-12);
    EXPECT_GT(split[t].cueing, 1e-6);
    EXPECT_NEAR(std::hypot(split[t].projection, split[t].cueing), split[t].total, 1e-9 * split[t].total);
  }
  // An estimate that leaves the subspace: the rest of the pose can make up for it, or add to it
  const Eigen::VectorXd off =
      poses.col(0) - s.pca.output_modes() * (s.pca.output_modes().transpose() * poses.col(0));
  for (double sign : {-1.0, 1.0}) {
    const Eigen::MatrixXd outside = estimates + sign * 0.01 * off * Eigen::RowVectorXd::Ones(frames);
    const SplitError e = SplitErrors(s.pca.output_modes(), poses, outside)[0];
    EXPECT_NEAR(e.storage, 0.01 * e.projection, 1e-12);
    EXPECT_NEAR(e.cueing, expected[0].cue, 1e-10);
    EXPECT_NEAR(e.total * e.total,
                e.cueing * e.cueing + (e.projection - sign * e.storage) * (e.projection - sign * e.storage),
                1e-15);
  }
}

TEST(Estimator, TotalErrorIsProjectionAndCueErrorByPythagoras) {
  const Fixture s(200, 20, 150, {.max_modes = 30});
  const CueSet cues = MakeCueSet(s.pca, s.Optimal(8), s.sheet.diagonal());
  const Pca paper = TruncatedPca(s.pca, 12);
  const CueSet keys = MakeCueSet(paper, s.KeyPoints(12, 2), s.sheet.diagonal());
  const Estimator map = MapEstimator(s.pca, cues), least_squares = LeastSquaresEstimator(paper, keys);
  ASSERT_EQ(least_squares.mode, EstimatorMode::kPaper) << least_squares.warning;
  for (const auto& errors :
       {EstimateErrors(s.pca, cues, map, s.test), EstimateErrors(paper, keys, least_squares, s.test)}) {
    for (const PoseErrors& e : errors) {
      EXPECT_NEAR(std::hypot(e.projection, e.cue), e.total, 1e-9 * e.total);
      EXPECT_LE(e.largest, e.total * (1 + 1e-12));
      EXPECT_GE(e.largest, e.total / std::sqrt(200.0) * (1 - 1e-12));
    }
  }
  // Paper mode: |total| <= |projection| / sigma_min(A_key)
  const double smallest = TallSvd(keys.loadings).values[11];
  for (const PoseErrors& e : EstimateErrors(paper, keys, least_squares, s.test))
    EXPECT_LE(e.total, e.projection / smallest * (1 + 1e-9));
}

TEST(Estimator, PaperModeResidualIsOrthogonalToTheKeyPoints) {
  const Fixture s(200, 20, 150, {.max_modes = 12});
  const CueSet keys = MakeCueSet(s.pca, s.KeyPoints(12, 2), s.sheet.diagonal());
  const Estimator estimator = LeastSquaresEstimator(s.pca, keys);
  ASSERT_EQ(estimator.mode, EstimatorMode::kPaper);
  for (std::size_t t = 0; t < 20; ++t) {
    const Eigen::VectorXd y = MeasuredCues(s.pca.layout, keys, s.test.row(t));
    const Eigen::VectorXd residual = estimator.judge * y;
    EXPECT_LT((keys.loadings.transpose() * residual).norm(), 1e-12 * y.norm());
    EXPECT_LT((residual - (y - keys.loadings * (estimator.coordinates * y))).norm(), 1e-12 * y.norm());
  }
}

TEST(Estimator, AllPointsAsKeyPointsLeaveNoCueError) {
  const Fixture s(60, 10, 80, {.max_modes = 10});
  std::vector<CueRef> all;
  for (Index i = 0; i < 60; ++i) all.push_back({CueKind::kOutput, i});
  const CueSet keys = MakeCueSet(s.pca, all, s.sheet.diagonal());
  for (const PoseErrors& e : EstimateErrors(s.pca, keys, LeastSquaresEstimator(s.pca, keys), s.test)) {
    EXPECT_LT(e.cue, 1e-13);
    EXPECT_GT(e.projection, 1e-6);
  }
}

TEST(Estimator, BothModesAreTheSameBeforeAndAfterRotation) {
  const Fixture s(150, 15, 120, {.max_modes = 10});
  const std::vector<CueRef> points = s.KeyPoints(10, 2);
  const CueSet cues = MakeCueSet(s.pca, points, s.sheet.diagonal());
  Pca rotated = s.pca;
  Eigen::MatrixXd modes = s.pca.output_modes();
  const VarimaxResult varimax = Varimax({}, 3, &modes);
  rotated.modes = modes;
  const Estimator before = LeastSquaresEstimator(s.pca, cues);
  const Estimator after = LeastSquaresEstimator(rotated, MakeCueSet(rotated, points, s.sheet.diagonal()));
  ASSERT_EQ(before.mode, EstimatorMode::kPaper);
  EXPECT_LT((before.gain - after.gain).norm(), 1e-10 * before.gain.norm());
  const Estimator map = MapEstimator(s.pca, cues),
                  map_rotated = RotatedMapEstimator(s.pca, cues, varimax.rotation);
  EXPECT_LT((map.gain - map_rotated.gain).norm(), 1e-8 * map.gain.norm());
}

TEST(Estimator, BadConditionAndTooFewPointsFallBackWithAWarning) {
  const Fixture s(150, 15, 120, {.max_modes = 12});
  const std::vector<CueRef> few = {{CueKind::kOutput, 40}, {CueKind::kOutput, 80}};
  const CueSet too_few = MakeCueSet(s.pca, few, s.sheet.diagonal());
  const Estimator first = LeastSquaresEstimator(s.pca, too_few);
  EXPECT_EQ(first.mode, EstimatorMode::kMap);
  EXPECT_NE(first.warning.find("6 measured values cannot determine 12 modes"), std::string::npos);
  // Neighbours say the same
  const CueSet close = MakeCueSet(
      s.pca,
      std::vector<CueRef>{
          {CueKind::kOutput, 40}, {CueKind::kOutput, 41}, {CueKind::kOutput, 42}, {CueKind::kOutput, 43}},
      s.sheet.diagonal());
  const Estimator second = LeastSquaresEstimator(s.pca, close);
  EXPECT_EQ(second.mode, EstimatorMode::kMap);
  EXPECT_NE(second.warning.find("condition number"), std::string::npos);
  EXPECT_LT((second.gain - MapEstimator(s.pca, close).gain).norm(), 1e-12);
}

TEST(Estimator, WhiteningGivesUnitCovariance) {
  const Fixture s(150, 15, 120, {.max_modes = 12});
  const Estimator e = MapEstimator(s.pca, MakeCueSet(s.pca, s.Optimal(6), s.sheet.diagonal()));
  const Eigen::Index r = e.covariance.rows();
  EXPECT_LT((e.whitening * e.covariance * e.whitening.transpose() - Eigen::MatrixXd::Identity(r, r))
                .cwiseAbs()
                .maxCoeff(),
            1e-9);
  EXPECT_LT((e.judge * e.covariance - Eigen::MatrixXd::Identity(r, r)).cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_TRUE(e.whitening.isLowerTriangular(0.0));
}

// the choice and the estimator of this project against the rule of the paper, same number of
// points.
TEST(Estimator, MapOfAnOptimalChoiceBeatsVarimaxAndLeastSquares) {
  const Fixture s(600, 40, 400, {.max_modes = 120});
  for (const auto& [count, factor] : {std::pair<std::size_t, double>{10, 1.5}, {20, 2.0}, {40, 3.0}}) {
    const Pca paper = TruncatedPca(s.pca, static_cast<Eigen::Index>(count / 2));
    const CueSet keys = MakeCueSet(paper, s.KeyPoints(paper.mode_count(), 2), s.sheet.diagonal());
    ASSERT_EQ(keys.cues.size(), count);
    const double paper_rms =
        RmsError(EstimateErrors(paper, keys, LeastSquaresEstimator(paper, keys), s.test), s.sheet.points());
    const double map_rms = s.MapRms(s.Optimal(count));
    RecordProperty("points_" + std::to_string(count),
                   std::to_string(paper_rms) + " against " + std::to_string(map_rms));
    EXPECT_LT(factor * map_rms, paper_rms) << count;
    EXPECT_LE(map_rms, s.MapRms(keys.cues)) << "the choice alone, at " << count;
  }
}

// The stage before bend and twist sees the bumps; those two show in their scalars only, and nonlinearly.
TEST(Estimator, CuesBeforeADeformerAndScalarsServeAsWell) {
  const Fixture s(300, 30, 300, {.max_modes = 80}, true, true);
  const double motion = std::sqrt(s.pca.total_energy / (299.0 * 300.0));
  const double points = s.MapRms(s.Optimal(16)), stage_only = s.MapRms(s.Optimal(16, false, true, false));
  const double stage_and_scalars = s.MapRms(s.Optimal(18, false, true, true));
  const double points_and_scalars = s.MapRms(s.Optimal(16, true, false, true));
  const auto text = [](double value) { return std::to_string(1e3 * value) + " mm"; };
  RecordProperty("motion", text(motion));
  EXPECT_LT(points, 0.01 * motion);
  EXPECT_GT(stage_only, 0.3 * motion);
  EXPECT_LT(stage_and_scalars, 0.05 * motion) << text(motion);
  EXPECT_LT(points_and_scalars, 2 * points);
}

}  // namespace
}  // namespace kpsa::engine
