// Regressions on many rows, which go by columns, against the same by rows.
#include "kpsa/training/ridge.h"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include "kpsa/training/random.h"

namespace kpsa::engine {
namespace {

Eigen::MatrixXd Made(Eigen::Index rows, Eigen::Index columns, std::uint64_t seed) {
  Random random(seed);
  Eigen::MatrixXd m(rows, columns);
  for (double& value : m.reshaped()) value = random.Unit() - 0.5;
  return m;
}

// The textbook's.
Eigen::MatrixXd ByRows(const Eigen::MatrixXd& x, const Eigen::MatrixXd& y, double ridge) {
  Eigen::MatrixXd gram = x * x.transpose();
  gram.diagonal().array() += ridge * gram.trace() / static_cast<double>(gram.rows());
  return y * x.transpose() * gram.inverse();
}

TEST(Ridge, IsTheSameByRowsAndByColumns) {
  constexpr double kRidge = 1e-2;
  const std::pair<Eigen::Index, Eigen::Index> shapes[] = {{7, 40}, {40, 40}, {40, 9}, {90, 31}};
  for (const auto& [rows, columns] : shapes) {
    const Eigen::MatrixXd x = Made(rows, columns, 1), y = Made(6, columns, 2), xh = Made(rows, 5, 3);
    const Eigen::MatrixXd map = ByRows(x, y, kRidge);
    EXPECT_LT((RidgeAt(x, y, xh, kRidge) - map * xh).cwiseAbs().maxCoeff(), 1e-9) << rows;
    const double told = (map * x).cwiseProduct(y).sum();
    EXPECT_NEAR(ToldByRidge(x, y, x * x.transpose(), y * x.transpose(), kRidge), told, 1e-9) << rows;
    EXPECT_GT(told, 0.01 * y.squaredNorm()) << "something";
  }
}

}  // namespace
}  // namespace kpsa::engine
