#include "kpsa/soft_cache.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/QR>
#include <cmath>

#include "base/simd.h"
#include "kpsa/training/eigen_solvers.h"
#include "kpsa/training/make_subspace.h"
#include "tests/kpsa/synthetic.h"

namespace kpsa::engine {
namespace {

using test::kInfinity;
using test::Sheet;

class SoftCacheTest : public testing::Test {
 protected:
  SoftCacheTest()
      : sheet_(200, 15, 1),
        training_(sheet_.RandomPoses(200, 2, sheet_.Layout(false, true))),
        test_(sheet_.RandomPoses(100, 3, sheet_.Layout(false, true))) {
    const Eigen::VectorXd mean = training_.Mean();
    training_.Subtract(mean);
    test_.Subtract(mean);
    pca_ = std::move(*ComputePca(training_, mean, {.max_modes = 30}));
    const std::vector<CueRef> cues = {
        {CueKind::kOutput, 20}, {CueKind::kOutput, 70},  {CueKind::kScalar, 15}, {CueKind::kOutput, 130},
        {CueKind::kScalar, 3},  {CueKind::kOutput, 190}, {CueKind::kOutput, 100}};
    cues_ = MakeCueSet(pca_, cues, sheet_.diagonal());
    estimator_ = MapEstimator(pca_, cues_);
    model_ = MakeSoftCacheModel(estimator_, cues_, MeasuredPoses(training_.layout(), cues_, training_));
  }
  static std::vector<float> Padded(const SoftCacheModel& model, const Eigen::VectorXd& y) {
    std::vector<float> padded(model.padded_rows());
    for (std::size_t j = 0; j < model.rows(); ++j)
      padded[j] = static_cast<float>(y[static_cast<Eigen::Index>(j)]);
    return padded;
  }
  RawScores Raw(const SoftCacheModel& model, const Eigen::VectorXd& y) const {
    std::vector<float> g(model.padded_rows());
    return ComputeRawScores(model, Padded(model, y), g);
  }
  Verdict Verdicts(const Eigen::VectorXd& y, double tau) const {
    std::vector<float> g(model_.padded_rows());
    return Judge(model_, {.tau = tau}, Padded(model_, y), g);
  }

  Sheet sheet_;
  PoseMatrix training_, test_;
  Pca pca_;
  CueSet cues_;
  Estimator estimator_;
  SoftCacheModel model_;
};

TEST_F(SoftCacheTest, ScoresAgreeWithLeavingEachCueOut) {
  const Eigen::MatrixXd& g = estimator_.covariance;
  for (std::size_t t = 0; t < 10; ++t) {
    const Eigen::VectorXd y = MeasuredCues(pca_.layout, cues_, test_.row(t));
    const RawScores raw = Raw(model_, y);
    EXPECT_NEAR(raw.score1 / y.dot(g.llt().solve(y)), 1, 1e-4);

    // The naive twin predicts every cue from the others
    double largest = 0;
    Index worst = 0;
    for (std::size_t k = 0; k < cues_.cues.size(); ++k) {
      std::vector<Eigen::Index> in, out;
      for (Eigen::Index j = 0; j < cues_.rows(); ++j)
        (j >= cues_.offsets[k] && j < cues_.offsets[k + 1] ? in : out).push_back(j);
      const Eigen::MatrixXd others = g(out, out), cross = g(in, out);
      const Eigen::VectorXd error = y(in) - cross * others.llt().solve(Eigen::VectorXd(y(out)));
      // A scalar counts by the displacement of its column of the gain
      const double weight =
          cues_.cues[k].kind == CueKind::kScalar ? estimator_.gain.col(in[0]).cwiseAbs().maxCoeff() : 1;
      if (weight * error.norm() > largest) largest = weight * error.norm(), worst = static_cast<Index>(k);
    }
    EXPECT_NEAR(raw.score2 / largest, 1, 1e-3);
    EXPECT_EQ(raw.worst_cue, worst);
  }
}

TEST_F(SoftCacheTest, OneInAHundredTrainingPosesExceedsEachQuantile) {
  int above1 = 0, above2 = 0;
  for (std::size_t t = 0; t < training_.poses(); ++t) {
    const RawScores raw = Raw(model_, MeasuredCues(pca_.layout, cues_, training_.row(t)));
    above1 += raw.score1 > model_.quantile1;
    above2 += raw.score2 > model_.quantile2;
  }
  EXPECT_EQ(above1, 2);
  EXPECT_EQ(above2, 2);
}

TEST_F(SoftCacheTest, PaperModeScoresTheResidual) {
  const Pca pca = TruncatedPca(pca_, 6);
  const CueSet cues = MakeCueSet(
      pca,
      std::vector<CueRef>{
          {CueKind::kOutput, 20}, {CueKind::kOutput, 70}, {CueKind::kOutput, 130}, {CueKind::kOutput, 190}},
      sheet_.diagonal());
  const Estimator estimator = LeastSquaresEstimator(pca, cues);
  ASSERT_EQ(estimator.mode, EstimatorMode::kPaper) << estimator.warning;
  const SoftCacheModel model =
      MakeSoftCacheModel(estimator, cues, MeasuredPoses(training_.layout(), cues, training_));
  for (std::size_t t = 0; t < 10; ++t) {
    const Eigen::VectorXd y = MeasuredCues(pca.layout, cues, test_.row(t));
    const Eigen::VectorXd p = cues.loadings.householderQr().solve(y);
    const RawScores raw = Raw(model, y);
    EXPECT_NEAR(raw.score1, (y - cues.loadings * p).norm(), 1e-9);
    EXPECT_EQ(raw.score2, 0);
  }
}

TEST_F(SoftCacheTest, AnUntrainedDeformationScoresHigher) {
  double trained = 0;
  for (std::size_t t = 0; t < test_.poses(); ++t)
    trained = std::max(trained, Verdicts(MeasuredCues(pca_.layout, cues_, test_.row(t)), 1).score);
  // One point is pulled out by a centimetre
  Eigen::VectorXd y = MeasuredCues(pca_.layout, cues_, test_.row(0));
  y[cues_.offsets[3] + 1] += 0.01;
  const Verdict verdict = Verdicts(y, trained);
  EXPECT_GT(verdict.score, 1.5 * trained);
  EXPECT_FALSE(verdict.hit);
  EXPECT_EQ(verdict.full_weight, 1);
  EXPECT_EQ(verdict.reason, MissReason::kScore);
  EXPECT_LT(verdict.offender, model_.cues());
}

TEST_F(SoftCacheTest, NotFiniteMeasurementsAreMissesThatNameTheirCue) {
  for (const double bad : {std::nan(""), kInfinity, -kInfinity}) {
    for (const double tau : {1.0, kInfinity, -1.0}) {
      Eigen::VectorXd y = MeasuredCues(pca_.layout, cues_, test_.row(0));
      y[cues_.offsets[2]] = bad;
      const Verdict verdict = Verdicts(y, tau);
      EXPECT_FALSE(verdict.hit);
      EXPECT_EQ(verdict.full_weight, 1);
      EXPECT_EQ(verdict.reason, MissReason::kNotFinite);
      EXPECT_EQ(verdict.offender, 2u);
    }
  }
  // Finite, but so large that the score overflows
  const Verdict huge = Verdicts(Eigen::VectorXd::Constant(cues_.rows(), 1e200), kInfinity);
  EXPECT_FALSE(huge.hit);
  EXPECT_EQ(huge.reason, MissReason::kNotFinite);
}

TEST_F(SoftCacheTest, ThresholdsAtTheirEnds) {
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(cues_.rows());
  EXPECT_EQ(Verdicts(zero, -1).reason, MissReason::kNeverHit);
  EXPECT_FALSE(Verdicts(zero, 0).hit);
  EXPECT_TRUE(Verdicts(zero, 1e-9).hit);
  EXPECT_TRUE(Verdicts(Eigen::VectorXd::Constant(cues_.rows(), 1e3), kInfinity).hit);
}

TEST(SoftCache, TheBlendIsSmoothAndMonotone) {
  const SoftCacheThreshold threshold{.tau = 2, .blend_start = 0.75};
  EXPECT_EQ(FullWeight(0, threshold), 0);
  EXPECT_EQ(FullWeight(1.5, threshold), 0);
  EXPECT_DOUBLE_EQ(FullWeight(1.75, threshold), 0.5);
  EXPECT_EQ(FullWeight(2, threshold), 1);
  EXPECT_EQ(FullWeight(kInfinity, threshold), 1);
  EXPECT_EQ(FullWeight(std::nan(""), threshold), 1);
  double last = 0;
  for (int i = 0; i <= 1000; ++i) {
    const double weight = FullWeight(1.5 + 0.5 * i / 1000, threshold);
    EXPECT_GE(weight, last);
    EXPECT_LT(weight - last, 0.0016);  // the slope of a smoothstep is at most 1.5
    last = weight;
  }
  EXPECT_EQ(FullWeight(1, {.tau = 1, .blend_start = 1}), 1);  // no blend zone
  EXPECT_EQ(FullWeight(0.999, {.tau = 1, .blend_start = 1}), 0);
}

TEST(SoftCache, GuardsComeInSmoothly) {
  const TrainedRange range = MakeTrainedRange("jaw.open", 0, 1, 0.02, 0.1);
  EXPECT_NEAR(range.hi, 1.02, 1e-5);
  const auto weight = [&](double value) { return GuardWeight(range.lo, range.hi, range.ramp, value); };
  for (const double inside : {-0.02, 0.0, 0.5, 1.02}) EXPECT_EQ(weight(inside), 0) << inside;
  for (const double forgiven : {range.lo - 0.009, range.hi + 0.009}) EXPECT_EQ(weight(forgiven), 0);
  for (const double beyond : {range.lo - 0.011, range.hi + 0.011}) EXPECT_GT(weight(beyond), 0);
  for (const double outside : {-0.13, 1.13, kInfinity, -kInfinity, std::nan("")})
    EXPECT_EQ(weight(outside), 1);
  EXPECT_NEAR(weight(range.hi + 0.055), 0.5, 1e-9);
  EXPECT_NEAR(weight(range.lo - 0.055), 0.5, 1e-9);
  double last = 0;
  for (int i = 0; i <= 1000; ++i) {
    const double w = weight(1 + 0.15 * i / 1000);
    EXPECT_GE(w, last);
    EXPECT_LT(w - last, 1.6 * 0.15 / 1000 / 0.09);  // the slope of a smoothstep is at most 1.5
    last = w;
  }
  EXPECT_EQ(GuardWeight(3, 3, 0, 3), 0);  // no ramp
  EXPECT_EQ(GuardWeight(3, 3, 0, 3.001), 1);
  EXPECT_EQ(OutsideMessage(range, 1.25), "jaw.open = 1.25 is outside its trained range [-0.020001, 1.02]");
}

// The definition in double, value by value.
RawScores NaiveScores(const SoftCacheModel& model, const Eigen::MatrixXd& factor, const Eigen::VectorXd& y) {
  const Eigen::VectorXd w = factor * y, g = factor.transpose() * w;
  RawScores raw;
  raw.score1 = w.squaredNorm();
  double largest = -1;
  for (std::size_t k = 0; k < model.cues(); ++k) {
    const double value = static_cast<double>(model.leave_one_out[k]) * g[static_cast<Eigen::Index>(k)];
    if (value * value > largest) largest = value * value, raw.worst_cue = static_cast<Index>(k);
  }
  raw.score2 = std::sqrt(largest);
  return raw;
}

TEST(SoftCache, ScoresAreTheSameOnEveryTargetAndAgreeWithTheNaiveTwin) {
  for (const Eigen::Index n : {1, 3, 4, 15, 16, 17, 32, 33, 64, 95, 240}) {
    // Factors of all sizes
    CueSet cues;
    cues.noise = Eigen::VectorXd::Constant(n, 1e-4);
    cues.mean = Eigen::VectorXd::Zero(n);
    for (Eigen::Index k = 0; k <= n; ++k) cues.offsets.push_back(static_cast<Index>(k));
    for (Eigen::Index k = 0; k < n; ++k) cues.cues.push_back({CueKind::kOutput, static_cast<Index>(k)});
    const Eigen::MatrixXd mixed = RandomNormal(n, n + 5, static_cast<std::uint64_t>(n));
    Estimator estimator;
    estimator.covariance =
        mixed * mixed.transpose() / static_cast<double>(n) + 1e-2 * Eigen::MatrixXd::Identity(n, n);
    estimator.whitening = Eigen::MatrixXd(Eigen::MatrixXd(estimator.covariance.llt().matrixL()).inverse())
                              .triangularView<Eigen::Lower>();
    estimator.judge = estimator.covariance.inverse();
    const SoftCacheModel model = MakeSoftCacheModel(estimator, cues, RandomNormal(n, 8, 3));
    const Eigen::VectorXd y =
        RandomNormal(n, 1, static_cast<std::uint64_t>(n) + 1).cast<float>().cast<double>();
    const RawScores naive = NaiveScores(model, estimator.whitening, y);
    std::vector<float> padded(model.padded_rows());
    for (Eigen::Index j = 0; j < n; ++j) padded[static_cast<std::size_t>(j)] = static_cast<float>(y[j]);
    std::vector<RawScores> found;
    for (const char* target : {"avx512", "avx2", "scalar"}) {
      if (!SelectSimdTarget(target)) continue;
      std::vector<float> g(model.padded_rows());
      found.push_back(ComputeRawScores(model, padded, g));
      EXPECT_EQ(found.back().score1, found.front().score1) << target << " " << n;
      EXPECT_EQ(found.back().score2, found.front().score2) << target << " " << n;
      EXPECT_NEAR(found.back().score1 / naive.score1, 1, 1e-4) << target << " " << n;
      EXPECT_NEAR(found.back().score2 / naive.score2, 1, 1e-3) << target << " " << n;
      EXPECT_EQ(found.back().worst_cue, naive.worst_cue);
    }
    SelectSimdTarget("");
  }
}

}  // namespace
}  // namespace kpsa::engine
