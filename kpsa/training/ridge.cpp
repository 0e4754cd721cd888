#include "kpsa/training/ridge.h"

#include <algorithm>
#include <utility>

#include "kpsa/training/gemm.h"

namespace kpsa::engine {
namespace {

// Where rounding leaves a Gram matrix that is not positive, it is damped so many times as much; never more than so much
constexpr double kMoreRidge = 100, kMostRidge = 10;

// rows: of which the mean of the diagonal is taken.
Cholesky DampedOf(const Eigen::MatrixXd& gram, Eigen::Index rows, double ridge) {
  const double mean = std::max(gram.trace() / static_cast<double>(rows), 1e-300);
  for (double more = ridge; more < kMostRidge; more *= kMoreRidge) {
    Eigen::MatrixXd damped = gram;
    damped.diagonal().array() += more * mean;
    Cholesky solver(std::move(damped));
    if (solver.ok()) return solver;
  }
  return Cholesky(Eigen::MatrixXd(gram.diagonal().cwiseMax(mean).asDiagonal()));
}

}  // namespace

Cholesky Damped(const Eigen::MatrixXd& gram, double ridge) { return DampedOf(gram, gram.rows(), ridge); }

Eigen::MatrixXd RidgeAt(const Eigen::MatrixXd& x, const Eigen::MatrixXd& y, const Eigen::MatrixXd& xh,
                        double ridge) {
  if (x.rows() <= x.cols()) {
    const Eigen::MatrixXd map = Damped(GramOf(x), ridge).Solve(CrossOf(x, y));
    return Multiply(GemmOperand::Dense(map).Transposed(), GemmOperand::Dense(xh));
  }
  const Eigen::MatrixXd columns = x.transpose();
  return Multiply(y, DampedOf(GramOf(columns), x.rows(), ridge).Solve(Multiply(columns, xh)));
}

double ToldByRidge(const Eigen::MatrixXd& x, const Eigen::MatrixXd& y, const Eigen::MatrixXd& gram,
                   const Eigen::MatrixXd& cross, double ridge) {
  if (x.rows() <= x.cols()) {
    const Eigen::MatrixXd map = Damped(gram, ridge).Solve(cross.transpose());
    return map.cwiseProduct(cross.transpose()).sum();
  }
  const Eigen::MatrixXd columns = GramOf(x.transpose());
  const Eigen::MatrixXd solved = DampedOf(columns, x.rows(), ridge).Solve(y.transpose());
  return Multiply(columns, solved).cwiseProduct(y.transpose()).sum();
}

}  // namespace kpsa::engine
