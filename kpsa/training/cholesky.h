// Cholesky decomposition of symmetric positive definite matrices of some hundred rows, by blocks whose products are those
// of kpsa/training/gemm.h: several times as fast as Eigen's, whose products use SSE2 in this build. Internal to training.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace kpsa::engine {

class Cholesky {
 public:
  explicit Cholesky(Eigen::MatrixXd matrix);  // of which the lower half is read
  // Whether it is positive definite, as far as rounding tells.
  bool ok() const { return ok_; }
  // matrix^-1 b. b: [n x any]. Where it is ok.
  Eigen::MatrixXd Solve(const Eigen::MatrixXd& b) const;

 private:
  Eigen::MatrixXd lower_;                  // L below the blocks of the diagonal
  std::vector<Eigen::MatrixXd> inverses_;  // of these
  bool ok_ = true;
};

}  // namespace kpsa::engine
