#include "kpsa/training/pca.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <Eigen/SVD>

#include "base/check.h"
#include "kpsa/training/eigen_solvers.h"
#include "kpsa/training/gemm.h"
#include "tests/kpsa/synthetic.h"

namespace kpsa::engine {
namespace {

using test::Sheet;

Eigen::MatrixXd Dense(const PoseMatrix& poses) {
  Eigen::MatrixXd x(static_cast<Eigen::Index>(poses.poses()), static_cast<Eigen::Index>(poses.columns()));
  for (std::size_t t = 0; t < poses.poses(); ++t) {
    for (std::size_t j = 0; j < poses.columns(); ++j)
      x(static_cast<Eigen::Index>(t), static_cast<Eigen::Index>(j)) = static_cast<double>(poses.row(t)[j]);
  }
  return x;
}

// Errors of the subspace itself, without an estimator: for each pose |f - A A^T f| over the outputs (centred
// with pca.mean; weighted if the PCA is). [poses]
Eigen::VectorXd ProjectionErrors(const Pca& pca, const PoseMatrix& poses) {
  KPSA_CHECK(poses.centered() && poses.layout() == pca.layout);
  const std::size_t outputs = pca.layout.outputs(), kChunk = 384;
  const Eigen::MatrixXd a = pca.output_modes();
  Eigen::VectorXd errors(static_cast<Eigen::Index>(poses.poses()));
  Eigen::LDLT<Eigen::MatrixXd> gram;
  if (!pca.output_orthonormal) gram.compute(Gram(GemmOperand::Dense(a).Transposed()));
  for (std::size_t first = 0; first < poses.poses(); first += kChunk) {
    const std::size_t count = std::min(kChunk, poses.poses() - first);
    const GemmOperand x = GemmOperand::Poses(poses, first, count, 0, outputs);
    Eigen::MatrixXd coordinates =
        Multiply(GemmOperand::Dense(a).Transposed(), x.Transposed());  // [M x count]
    if (!pca.output_orthonormal) coordinates = gram.solve(coordinates);
    const Eigen::MatrixXd projected = Multiply(a, coordinates);
    for (std::size_t t = 0; t < count; ++t) {
      const std::span<const float> row = poses.row(first + t);
      const Eigen::Map<const Eigen::VectorXf> f(row.data(), static_cast<Eigen::Index>(outputs));
      errors[static_cast<Eigen::Index>(first + t)] =
          (f.cast<double>() - projected.col(static_cast<Eigen::Index>(t))).norm();
    }
  }
  return errors;
}

double DistanceFromIdentity(const Eigen::MatrixXd& a) {
  return (a.transpose() * a - Eigen::MatrixXd::Identity(a.cols(), a.cols())).cwiseAbs().maxCoeff();
}

struct Trained {
  PoseMatrix poses;
  Eigen::VectorXd mean;
  Pca pca;
};
Trained Train(PoseMatrix poses, const PcaOptions& options) {
  Eigen::VectorXd mean = poses.Mean();
  poses.Subtract(mean);
  Result<Pca> pca = ComputePca(poses, mean, options);
  EXPECT_TRUE(pca.ok()) << pca.status().ToString();
  return {std::move(poses), std::move(mean), std::move(*pca)};
}

TEST(Pca, BothSidesAndTheRandomisedMethodAgreeWithADenseSvd) {
  const Sheet sheet(60, 12, 1);
  for (const std::size_t count : {90, 300}) {  // fewer and more poses than the 180 values
    for (const auto method : {PcaOptions::Method::kSnapshot, PcaOptions::Method::kRandomised}) {
      const Trained t =
          Train(sheet.RandomPoses(count, 2, sheet.Layout()), {.max_modes = 15, .method = method});
      const Eigen::JacobiSVD<Eigen::MatrixXd> svd(Dense(t.poses), Eigen::ComputeThinV);
      ASSERT_EQ(t.pca.mode_count(), 15);
      for (Eigen::Index k = 0; k < 15; ++k)
        EXPECT_NEAR(t.pca.singular[k] / svd.singularValues()[k], 1, 1e-6) << k;
      EXPECT_NEAR(std::fabs(t.pca.modes.col(0).dot(svd.matrixV().col(0))), 1, 1e-9);
      EXPECT_NEAR(t.pca.total_energy / svd.singularValues().squaredNorm(), 1, 1e-12);
      EXPECT_LT(DistanceFromIdentity(t.pca.output_modes()), 1e-12);
    }
  }
}

TEST(Pca, PosesInTheSpanAreReproduced) {
  // 5 modes of very different size, 40 poses: all of it lies in the span, up to the rounding of the poses to
  // float32
  const Eigen::MatrixXd basis = RandomNormal(300, 5, 3), weights = RandomNormal(40, 5, 4);
  PoseMatrix poses({.points = 100});
  for (Eigen::Index t = 0; t < 40; ++t) {
    const std::span<float> row = poses.AddPose();
    for (Eigen::Index j = 0; j < 300; ++j) {
      double sum = 0;
      for (Eigen::Index k = 0; k < 5; ++k)
        sum += weights(t, k) * basis(j, k) * std::pow(10.0, -static_cast<double>(k));
      row[static_cast<std::size_t>(j)] = static_cast<float>(sum);
    }
  }
  const Trained t = Train(std::move(poses), {.max_modes = 5});
  const Eigen::MatrixXd x = Dense(t.poses);
  for (Eigen::Index i = 0; i < 40; ++i)
    EXPECT_LT(ProjectionErrors(t.pca, t.poses)[i], 1e-5 * x.row(i).norm());

  // In float64: a combination of the modes comes back to 1e-12 from least squares on some of its rows
  const Eigen::MatrixXd a = t.pca.output_modes(), rows = a.topRows(60);
  const Eigen::VectorXd p = RandomNormal(5, 1, 5);
  const Eigen::VectorXd found = Eigen::HouseholderQR<Eigen::MatrixXd>(rows).solve(rows * p);
  EXPECT_LT((a * found - a * p).norm(), 1e-12 * (a * p).norm());
}

TEST(Pca, TrainingErrorIsTheDiscardedEnergyAndHeldOutErrorFallsWithTheModes) {
  const Sheet sheet(150, 20, 5);
  PoseMatrix held_out = sheet.RandomPoses(40, 7, sheet.Layout());
  const Trained t = Train(sheet.RandomPoses(120, 6, sheet.Layout()), {.max_modes = 60});
  held_out.Subtract(t.mean);
  double last = INFINITY;
  for (const Eigen::Index modes : {2, 5, 10, 20, 40, 60}) {
    const Pca pca = TruncatedPca(t.pca, modes);
    const double left = pca.discarded_energy();  // a difference of two sums: exact to rounding of the total
    EXPECT_NEAR(ProjectionErrors(pca, t.poses).squaredNorm(), left, 1e-6 * left + 1e-14 * pca.total_energy)
        << modes;
    const double error = ProjectionErrors(pca, held_out).norm();
    EXPECT_LT(error, last) << modes;
    last = error;
  }
}

TEST(Pca, OrthonormalAlthoughTheSpectrumSpansSevenDecades) {
  PoseMatrix poses({.points = 200});
  const Eigen::MatrixXd basis = RandomNormal(600, 30, 8), weights = RandomNormal(60, 30, 9);
  for (Eigen::Index t = 0; t < 60; ++t) {
    const std::span<float> row = poses.AddPose();
    for (Eigen::Index j = 0; j < 600; ++j) {
      double sum = 0;
      for (Eigen::Index k = 0; k < 30; ++k)
        sum += weights(t, k) * basis(j, k) * std::pow(10.0, -0.25 * static_cast<double>(k));
      row[static_cast<std::size_t>(j)] = static_cast<float>(sum);
    }
  }
  const Trained t = Train(std::move(poses), {.max_modes = 50});
  EXPECT_GT(t.pca.mode_count(), 25);
  EXPECT_LT(DistanceFromIdentity(t.pca.output_modes()), 1e-12);
  EXPECT_GT(t.pca.singular[t.pca.mode_count() - 1], 1e-7 * t.pca.singular[0]);
}

TEST(Pca, WeightsMakeModesOrthonormalInTheirNorm) {
  const Sheet sheet(80, 10, 10);
  std::vector<double> weights;
  for (std::size_t i = 0; i < sheet.points(); ++i) weights.push_back(0.5 + 0.1 * static_cast<double>(i % 7));
  const Trained t =
      Train(sheet.RandomPoses(60, 11, sheet.Layout()), {.max_modes = 8, .point_weights = weights});
  Eigen::MatrixXd scaled = t.pca.output_modes();
  for (Eigen::Index j = 0; j < scaled.rows(); ++j)
    scaled.row(j) *= std::sqrt(weights[static_cast<std::size_t>(j / 3)]);
  EXPECT_LT(DistanceFromIdentity(scaled), 1e-12);
  EXPECT_FALSE(t.pca.output_orthonormal);
}

TEST(Pca, ColumnsOutsideTheDecompositionAreRegressedOnTheModes) {
  const Sheet sheet(70, 8, 12);
  const PoseLayout layout = sheet.Layout(true, true);
  const Trained t = Train(sheet.RandomPoses(80, 13, layout), {.max_modes = 6});
  const Eigen::MatrixXd x = Dense(t.poses), a = t.pca.output_modes();
  const Eigen::MatrixXd coordinates = x.leftCols(static_cast<Eigen::Index>(layout.outputs())) * a;  // [T x M]
  const Eigen::Index rest = x.cols() - a.rows();
  const Eigen::MatrixXd regression = coordinates.colPivHouseholderQr().solve(x.rightCols(rest)).transpose();
  EXPECT_LT((t.pca.modes.bottomRows(rest) - regression).norm(), 1e-7 * regression.norm());
  // What they leave unexplained is the residual of that regression
  const Eigen::VectorXd left =
      (x.rightCols(rest) - coordinates * regression.transpose()).colwise().squaredNorm().transpose() / 79;
  EXPECT_LT((t.pca.row_residual.tail(rest) - left).cwiseAbs().maxCoeff(), 1e-9 * (1 + left.maxCoeff()));
  EXPECT_TRUE(t.pca.output_orthonormal);
}

TEST(Pca, JointDecompositionSharesItsModes) {
  const Sheet sheet(70, 8, 14);
  const Trained t = Train(sheet.RandomPoses(80, 15, sheet.Layout(true, true)),
                          {.max_modes = 12, .stage_weight = 1, .scalar_weight = 1e-4});
  EXPECT_FALSE(t.pca.output_orthonormal);
  // Least squares on the outputs still projects: errors are no larger than the part of the outputs left by
  // the modes
  const Eigen::VectorXd errors = ProjectionErrors(t.pca, t.poses);
  EXPECT_LE(errors.squaredNorm(), t.pca.row_residual.head(210).sum() * 79 * (1 + 1e-6));
  EXPECT_GT(errors.squaredNorm(), 0);
}

TEST(Pca, RefusesWhatHasNoAnswer) {
  const auto message = [](PoseMatrix poses, const PcaOptions& options) {
    const Eigen::VectorXd mean = poses.Mean();
    poses.Subtract(mean);
    const Result<Pca> pca = ComputePca(poses, mean, options);
    return pca.ok() ? std::string() : pca.status().ToString();
  };
  const PoseLayout layout{.points = 4};
  EXPECT_NE(message(test::NoisePoses(1, layout, 1), {}).find("at least 2 training poses"), std::string::npos);
  PoseMatrix still(layout);
  for (int i = 0; i < 5; ++i) still.AddPose()[0] = 3;
  EXPECT_NE(message(std::move(still), {}).find("nothing moves in the 5 training poses: widen the controls"),
            std::string::npos);
  PoseMatrix bad = test::NoisePoses(5, layout, 2);
  bad.row(3)[7] = std::nanf("");
  EXPECT_NE(message(std::move(bad), {}).find("NaN"), std::string::npos);
  const std::vector<double> weights = {1, 1, 0, 1}, few = {1};
  EXPECT_NE(message(test::NoisePoses(5, layout, 3), {.point_weights = weights}).find("weight of point 2"),
            std::string::npos);
  EXPECT_NE(
      message(test::NoisePoses(5, layout, 3), {.point_weights = few}).find("1 point weights for 4 points"),
      std::string::npos);
}

TEST(PoseMatrix, GrowsWithoutMovingRowsAndCentersOnce) {
  PoseMatrix poses({.points = 3});
  const float* first = poses.AddPose().data();
  for (int i = 1; i < 200; ++i) poses.AddPose()[4] = static_cast<float>(i);
  EXPECT_EQ(poses.row(0).data(), first);
  EXPECT_EQ(poses.poses(), 200u);
  const Eigen::VectorXd mean = poses.Mean();
  EXPECT_DOUBLE_EQ(mean[4], 99.5);
  poses.Subtract(mean);
  EXPECT_TRUE(poses.centered());
  EXPECT_EQ(poses.row(199)[4], 99.5f);
  EXPECT_NEAR(poses.Mean().cwiseAbs().maxCoeff(), 0, 1e-12);
}

TEST(PoseMatrix, PosesAreTakenAwayInPlaceAndComeBack) {
  PoseMatrix poses({.points = 3});
  for (int i = 0; i < 200; ++i) poses.AddPose()[4] = static_cast<float>(i);
  const float* const first = poses.row(0).data();
  PoseMatrix taken = poses.TakeEvery(4);
  ASSERT_EQ(poses.poses(), 150u);
  ASSERT_EQ(taken.poses(), 50u);
  EXPECT_EQ(poses.row(0).data(), first);  // nothing was copied anew
  EXPECT_EQ(poses.blocks(), 3u);
  for (std::size_t t = 0; t < 150; ++t) EXPECT_EQ(poses.row(t)[4], static_cast<float>(4 * (t / 3) + t % 3));
  for (std::size_t t = 0; t < 50; ++t) EXPECT_EQ(taken.row(t)[4], static_cast<float>(4 * t + 3));
  EXPECT_EQ(poses.AddPose()[4], 0.0f);  // where a pose was that is gone
  poses.Append(std::move(taken));
  ASSERT_EQ(poses.poses(), 201u);
  EXPECT_EQ(poses.row(200)[4], 199.0f);
  EXPECT_EQ(taken.poses(), 0u);
  taken = poses.TakeAfter(151);
  ASSERT_EQ(poses.poses(), 151u);
  ASSERT_EQ(taken.poses(), 50u);
  EXPECT_EQ(taken.row(49)[4], 199.0f);
}

}  // namespace
}  // namespace kpsa::engine
