#include "kpsa/training/gemm.h"

#include <gtest/gtest.h>

#include "base/parallel.h"
#include "base/simd.h"
#include "kpsa/training/eigen_solvers.h"
#include "tests/kpsa/synthetic.h"

namespace kpsa::engine {
namespace {

// The widest differences of a product from Eigen's, relative to the depth.
double Difference(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  return (a - b).cwiseAbs().maxCoeff();
}

class GemmTest : public testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    if (!SelectSimdTarget(GetParam())) GTEST_SKIP() << "the processor has no " << GetParam();
  }
  void TearDown() override { SelectSimdTarget(""); }
};
INSTANTIATE_TEST_SUITE_P(Targets, GemmTest, testing::Values("avx512", "avx2", "scalar"));

TEST_P(GemmTest, AgreesWithTheNaiveProduct) {
  for (const auto& [m, k, n] :
       {std::tuple{1, 1, 1}, {17, 5, 13}, {16, 12, 24}, {400, 200, 30}, {33, 401, 390}}) {
    const Eigen::MatrixXd a = RandomNormal(m, k, 1), b = RandomNormal(k, n, 2);
    const double tolerance = 1e-14 * k + 1e-13;
    EXPECT_LT(Difference(Multiply(a, b), a * b), tolerance);
    const Eigen::MatrixXd at = a.transpose(), bt = b.transpose();
    EXPECT_LT(
        Difference(Multiply(GemmOperand::Dense(at).Transposed(), GemmOperand::Dense(bt).Transposed()), a * b),
        tolerance);
    EXPECT_LT(Difference(Gram(GemmOperand::Dense(a)), a * a.transpose()), 10 * tolerance);
  }
}

TEST_P(GemmTest, ReadsPosesWithAScaleAColumn) {
  const PoseLayout layout{.points = 41};
  const PoseMatrix poses = test::NoisePoses(150, layout, 3);
  Eigen::MatrixXd x(150, 123);
  std::vector<double> scale;
  for (int j = 0; j < 123; ++j) scale.push_back(0.5 + 0.01 * j);
  for (int i = 0; i < 150; ++i) {
    for (int j = 0; j < 123; ++j)
      x(i, j) = static_cast<double>(poses.row(static_cast<std::size_t>(i))[static_cast<std::size_t>(j)]) *
                scale[static_cast<std::size_t>(j)];
  }
  EXPECT_LT(Difference(Gram(GemmOperand::Poses(poses, 0, 150, 0, 123, scale)), x * x.transpose()), 1e-11);
  EXPECT_LT(
      Difference(Gram(GemmOperand::Poses(poses, 0, 150, 0, 123, scale).Transposed()), x.transpose() * x),
      1e-11);
  const Eigen::MatrixXd v = RandomNormal(100, 7, 4);
  const Eigen::MatrixXd part = x.middleRows(30, 100).middleCols(20, 60);
  EXPECT_LT(Difference(Multiply(GemmOperand::Poses(poses, 30, 100, 20, 80, scale).Transposed(),
                                GemmOperand::Dense(v)),
                       part.transpose() * v),
            1e-11);
}

TEST_P(GemmTest, RoundsFactorsButNotLongSums) {
  for (const auto& [m, k, n] : {std::tuple{1, 1, 1}, {17, 5, 13}, {33, 401, 390}, {30, 9001, 20}}) {
    const Eigen::MatrixXd a = RandomNormal(m, k, 8), b = RandomNormal(k, n, 9), exact = a * b;
    const double off = Difference(MultiplyFloats(GemmOperand::Dense(a), GemmOperand::Dense(b)), exact);
    EXPECT_LT(off, 1e-6 * std::sqrt(static_cast<double>(k)) * 4);
    EXPECT_GT(off, 0);
  }
}

// A depth that is split, where the product has few tiles.
TEST_P(GemmTest, SumsADeepProductInParts) {
  const Eigen::MatrixXd a = RandomNormal(30, 9001, 6), b = RandomNormal(9001, 20, 7);
  EXPECT_LT(Difference(Multiply(a, b), a * b), 1e-10);
  const Eigen::MatrixXd gram = Gram(GemmOperand::Dense(a));
  EXPECT_LT(Difference(gram, a * a.transpose()), 1e-10);
  EXPECT_EQ(Difference(gram, gram.transpose()), 0);
  const ThreadLimit one(1);
  EXPECT_EQ(Difference(gram, Gram(GemmOperand::Dense(a))), 0);
}

TEST(Gemm, SymmetricAndTheSameWithAnyNumberOfThreads) {
  const Eigen::MatrixXd a = RandomNormal(900, 50, 5);
  const Eigen::MatrixXd gram = Gram(GemmOperand::Dense(a));
  EXPECT_EQ(Difference(gram, gram.transpose()), 0);
  const ThreadLimit one(1);
  EXPECT_EQ(Difference(gram, Gram(GemmOperand::Dense(a))), 0);
}

TEST(EigenSolvers, KrylovFindsTheLargestPairsOfASteepAndOfAFlatSpectrum) {
  const Eigen::Index n = 700, m = 40;
  Eigen::MatrixXd q = RandomNormal(n, n, 6);
  Orthonormalize(&q);
  // The flat one ends at the limit of the space: its eigenvalues are right to the square of the residuals
  for (const auto& [decay, tolerance] : {std::pair{0.9, 1e-9}, {0.99, 1e-6}}) {
    Eigen::VectorXd values(n);
    for (Eigen::Index k = 0; k < n; ++k)
      values[k] = std::pow(decay, static_cast<double>(k / 2));  // every value twice
    const Eigen::MatrixXd matrix = q * values.asDiagonal() * q.transpose();
    const SymmetricEigen eigen = LargestEigen(matrix, m, 1);
    EXPECT_LT((eigen.values - values.head(m)).cwiseAbs().maxCoeff(), tolerance);
    EXPECT_LT((matrix * eigen.vectors - eigen.vectors * eigen.values.asDiagonal()).norm(),
              std::sqrt(tolerance));
  }
}

// What a rig with few controls gives: soon nothing is left that the matrix moves.
TEST(EigenSolvers, VectorsAreOrthonormalWhereTheRankIsLow) {
  for (const Eigen::Index rank : {1, 5, 16, 28, 40}) {
    for (const auto& [n, m] :
         {std::pair<Eigen::Index, Eigen::Index>{210, 24}, {210, 68}, {384, 96}, {700, 24}}) {
      // Half of what there is stands still
      Eigen::MatrixXd q = Eigen::MatrixXd::Zero(n, rank);
      q.topRows(n / 2) = RandomNormal(n / 2, rank, static_cast<std::uint64_t>(n + rank));
      if (rank == 16) q = Eigen::MatrixXd::Identity(n, rank);
      Orthonormalize(&q);
      const Eigen::VectorXd values = Eigen::pow(10.0, Eigen::ArrayXd::LinSpaced(rank, 0, -6));
      const Eigen::MatrixXd matrix = q * values.asDiagonal() * q.transpose();
      const SymmetricEigen eigen = LargestEigen(matrix, m, 1);
      const Eigen::Index k = eigen.vectors.cols();
      EXPECT_LT(Difference(eigen.vectors.transpose() * eigen.vectors, Eigen::MatrixXd::Identity(k, k)), 1e-9)
          << rank << " of " << n;
      const Eigen::Index kept = std::min(rank, k);
      EXPECT_LT((eigen.values.head(kept) - values.head(kept)).cwiseAbs().maxCoeff(), 1e-9)
          << rank << " of " << n;
      EXPECT_LT(eigen.values.tail(k - kept).cwiseAbs().sum(), 1e-9) << rank << " of " << n;
    }
  }
}

TEST(EigenSolvers, PairsOfAnImageAreThoseOfItsProduct) {
  const auto check = [](const Eigen::MatrixXd& map, const Eigen::MatrixXd& inner) {
    const Eigen::MatrixXd product = map * inner * map.transpose();
    const SymmetricEigen eigen = EigenOfImage(map, inner);
    const Eigen::Index k = eigen.values.size();
    ASSERT_EQ(k, std::min(map.rows(), map.cols()));
    EXPECT_LT(Difference(eigen.vectors.transpose() * eigen.vectors, Eigen::MatrixXd::Identity(k, k)), 1e-12);
    EXPECT_LT(Difference(eigen.vectors * eigen.values.asDiagonal() * eigen.vectors.transpose(), product) /
                  product.norm(),
              1e-13);
    EXPECT_LT((eigen.values - AllEigen(product).values.head(k)).norm() / product.norm(), 1e-13);
  };
  for (const auto& [n, r] : {std::pair<Eigen::Index, Eigen::Index>{384, 30}, {20, 20}, {3, 15}, {7, 1}}) {
    SCOPED_TRACE(n);
    Eigen::MatrixXd map = RandomNormal(n, r, static_cast<std::uint64_t>(n));
    const Eigen::MatrixXd inner = Gram(GemmOperand::Dense(RandomNormal(r, r + 3, 2)));
    check(map, inner);
    if (r > 2) map.col(1) = map.col(0), map.col(2).setZero();
    check(map, inner);
  }
  EXPECT_EQ(EigenOfImage(Eigen::MatrixXd(6, 0), Eigen::MatrixXd(0, 0)).vectors.rows(), 6);
}

TEST(EigenSolvers, OrthonormalizeKeepsTheSpanOfDependentColumns) {
  Eigen::MatrixXd a = RandomNormal(300, 20, 7);
  for (Eigen::Index k = 0; k < 20; ++k)
    a.col(k) *= std::pow(10.0, -static_cast<double>(k) / 2);  // condition 1e9
  a.col(5) = a.col(4) + 1e-7 * a.col(5);
  const Eigen::MatrixXd before = a;
  Orthonormalize(&a);
  EXPECT_LT(Difference(a.transpose() * a, Eigen::MatrixXd::Identity(20, 20)), 1e-13);
  EXPECT_LT((before - a * (a.transpose() * before)).norm(), 1e-12 * before.norm());
}

}  // namespace
}  // namespace kpsa::engine
