#include "kpsa/training/ridge.h"

#include <algorithm>

#include "kpsa/training/gemm.h"

namespace kpsa::engine {
namespace {

// rows: of which the mean of the diagonal is taken.
Eigen::LLT<Eigen::MatrixXd> DampedOf(Eigen::MatrixXd gram, Eigen::Index rows, double ridge) {
  gram.diagonal().array() += ridge * std::max(gram.trace() / static_cast<double>(rows), 1e-300);
  return gram.llt();
}

}  // namespace

Eigen::LLT<Eigen::MatrixXd> Damped(const Eigen::MatrixXd& gram, double ridge) {
  return DampedOf(gram, gram.rows(), ridge);
}

Eigen::MatrixXd RidgeAt(const Eigen::MatrixXd& x, const Eigen::MatrixXd& y, const Eigen::MatrixXd& xh,
                        double ridge) {
  if (x.rows() <= x.cols()) return Damped(GramOf(x), ridge).solve(CrossOf(x, y)).transpose() * xh;
  const Eigen::MatrixXd columns = x.transpose();
  return y * DampedOf(GramOf(columns), x.rows(), ridge).solve(Multiply(columns, xh));
}

double ToldByRidge(const Eigen::MatrixXd& x, const Eigen::MatrixXd& y, const Eigen::MatrixXd& gram,
                   const Eigen::MatrixXd& cross, double ridge) {
  if (x.rows() <= x.cols()) {
    const Eigen::MatrixXd map = Damped(gram, ridge).solve(cross.transpose());
    return map.cwiseProduct(cross.transpose()).sum();
  }
  const Eigen::MatrixXd columns = GramOf(x.transpose());
  const Eigen::MatrixXd solved = DampedOf(columns, x.rows(), ridge).solve(y.transpose());
  return Multiply(columns, solved).cwiseProduct(y.transpose()).sum();
}

}  // namespace kpsa::engine
