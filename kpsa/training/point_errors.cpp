#include "kpsa/training/point_errors.h"

#include <cmath>

namespace kpsa::engine {
namespace {

Eigen::Map<const Eigen::Matrix3Xd> ByPoint(const Eigen::MatrixXd& off, Eigen::Index pose) {
  return {off.col(pose).data(), 3, off.rows() / 3};
}

}  // namespace

Eigen::MatrixXd PointErrors(const Eigen::MatrixXd& off) {
  Eigen::MatrixXd errors(off.rows() / 3, off.cols());
  for (Eigen::Index t = 0; t < off.cols(); ++t) errors.col(t) = ByPoint(off, t).colwise().norm().transpose();
  return errors;
}

Eigen::VectorXd LargestErrors(const Eigen::MatrixXd& off) {
  Eigen::VectorXd largest(off.cols());
  for (Eigen::Index t = 0; t < off.cols(); ++t)
    largest[t] = std::sqrt(ByPoint(off, t).colwise().squaredNorm().maxCoeff());
  return largest;
}

}  // namespace kpsa::engine
