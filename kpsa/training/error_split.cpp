#include "kpsa/training/error_split.h"

#include "base/check.h"
#include "kpsa/training/gemm.h"

namespace kpsa::engine {

std::vector<SplitError> SplitErrors(const Eigen::MatrixXd& modes, const Eigen::MatrixXd& poses,
                                    const Eigen::MatrixXd& estimates) {
  KPSA_CHECK(poses.rows() == modes.rows() && estimates.rows() == modes.rows() &&
             poses.cols() == estimates.cols());
  const GemmOperand transposed = GemmOperand::Dense(modes).Transposed();
  const Eigen::MatrixXd best = Multiply(transposed, GemmOperand::Dense(poses)),
                        reached = Multiply(transposed, GemmOperand::Dense(estimates));
  const Eigen::MatrixXd projected = Multiply(modes, best), inside = Multiply(modes, reached);
  std::vector<SplitError> errors;
  for (Eigen::Index t = 0; t < poses.cols(); ++t) {
    errors.push_back({(poses.col(t) - projected.col(t)).norm(), (projected.col(t) - inside.col(t)).norm(),
                      (estimates.col(t) - inside.col(t)).norm(), (poses.col(t) - estimates.col(t)).norm()});
  }
  return errors;
}

}  // namespace kpsa::engine
