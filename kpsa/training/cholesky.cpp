#include "kpsa/training/cholesky.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <utility>

#include "base/check.h"
#include "kpsa/training/gemm.h"

namespace kpsa::engine {
namespace {

constexpr Eigen::Index kBlock = 48;

}  // namespace

Cholesky::Cholesky(Eigen::MatrixXd matrix) : lower_(std::move(matrix)) {
  const Eigen::Index n = lower_.rows();
  KPSA_CHECK_EQ(n, lower_.cols());
  for (Eigen::Index k = 0; k < n; k += kBlock) {
    const Eigen::Index size = std::min(kBlock, n - k), rest = n - k - size;
    const Eigen::LLT<Eigen::MatrixXd> block(lower_.block(k, k, size, size));
    ok_ = block.info() == Eigen::Success;
    if (!ok_) return;
    Eigen::MatrixXd& inverse = inverses_.emplace_back(Eigen::MatrixXd::Identity(size, size));
    block.matrixL().solveInPlace(inverse);
    if (rest == 0) break;
    auto below = lower_.block(k + size, k, rest, size);
    below = Multiply(GemmOperand::Dense(below), GemmOperand::Dense(inverse).Transposed());
    lower_.bottomRightCorner(rest, rest) -= Gram(GemmOperand::Dense(below));
  }
}

Eigen::MatrixXd Cholesky::Solve(const Eigen::MatrixXd& b) const {
  KPSA_CHECK(ok_);
  const Eigen::Index n = lower_.rows();
  KPSA_CHECK_EQ(n, b.rows());
  Eigen::MatrixXd x = b;
  for (Eigen::Index k = 0; k < n; k += kBlock) {
    const Eigen::MatrixXd& inverse = inverses_[static_cast<std::size_t>(k / kBlock)];
    const Eigen::Index size = inverse.rows(), rest = n - k - size;
    x.middleRows(k, size) = Multiply(inverse, x.middleRows(k, size));
    if (rest > 0)
      x.bottomRows(rest) -= Multiply(lower_.block(k + size, k, rest, size), x.middleRows(k, size));
  }
  for (std::size_t i = inverses_.size(); i-- > 0;) {
    const Eigen::MatrixXd& inverse = inverses_[i];
    const Eigen::Index k = static_cast<Eigen::Index>(i) * kBlock, size = inverse.rows(), rest = n - k - size;
    if (rest > 0)
      x.middleRows(k, size) -=
          Multiply(GemmOperand::Dense(lower_.block(k + size, k, rest, size)).Transposed(),
                   GemmOperand::Dense(x.bottomRows(rest)));
    x.middleRows(k, size) =
        Multiply(GemmOperand::Dense(inverse).Transposed(), GemmOperand::Dense(x.middleRows(k, size)));
  }
  return x;
}

}  // namespace kpsa::engine
