#include "kpsa/training/cholesky.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "kpsa/training/eigen_solvers.h"
#include "kpsa/training/ridge.h"

namespace kpsa::engine {
namespace {

TEST(CholeskyTest, SolvesAsEigenDoes) {
  for (const Eigen::Index n : {1, 2, 47, 48, 49, 96, 131, 400}) {
    const Eigen::MatrixXd root = RandomNormal(n, n + 5, 1), matrix = root * root.transpose(),
                          b = RandomNormal(n, 7, 2), expected = matrix.llt().solve(b);
    const Cholesky solver(matrix);
    ASSERT_TRUE(solver.ok()) << n;
    EXPECT_LT((matrix * solver.Solve(b) - b).norm(), 1e-9 * b.norm()) << n;
    EXPECT_LT((solver.Solve(b) - expected).norm(), 1e-8 * expected.norm()) << n;
  }
}

TEST(CholeskyTest, SaysWhatIsNotPositive) {
  for (const Eigen::Index bad : {0, 30, 60, 119}) {
    Eigen::MatrixXd matrix = Eigen::MatrixXd::Identity(120, 120);
    matrix(bad, bad) = -1e-3;
    EXPECT_FALSE(Cholesky(matrix).ok()) << bad;
  }
}

// Rows that are all but the same: the damping that was asked for is below rounding.
TEST(CholeskyTest, IsDampedMoreWhereRoundingLeavesNothingPositive) {
  const Eigen::MatrixXd row = RandomNormal(1, 50, 3), rows = row.replicate(90, 1);
  Eigen::MatrixXd gram = rows * rows.transpose();
  gram(7, 7) -= 1e-9 * gram(7, 7);  // as rounding may leave it
  EXPECT_FALSE(Cholesky(gram).ok());
  const Eigen::MatrixXd solved = Damped(gram, 1e-18).Solve(Eigen::MatrixXd::Ones(90, 1));
  EXPECT_TRUE(solved.allFinite());
  // Nothing moves at all
  EXPECT_TRUE(Damped(Eigen::MatrixXd::Zero(60, 60), 1e-7).Solve(Eigen::MatrixXd::Zero(60, 2)).isZero());
}

}  // namespace
}  // namespace kpsa::engine
