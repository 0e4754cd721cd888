#include "bench/ablation_q_deim.h"

#include <Eigen/QR>
#include <algorithm>

namespace kpsa::engine::ablation {
namespace {

constexpr double kSpanned = 1e-9;  // of the longest column: what is left of one that others span is rounding

class Pivoting {
 public:
  Pivoting(const Eigen::MatrixXd& modes, Eigen::Index height)
      : height_(height),
        columns_(modes.transpose()),
        left_(columns_),
        is_taken_(static_cast<std::size_t>(modes.rows() / height), 0),
        spanned_(kSpanned * kSpanned * columns_.colwise().squaredNorm().maxCoeff()) {}

  std::size_t points() const { return is_taken_.size(); }

  Index Take() {
    std::size_t best = Farthest();
    if (Left(best).squaredNorm() <= spanned_) {
      left_ = columns_;
      best = Farthest();
    }
    is_taken_[best] = 1;
    const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(Left(best));
    const Eigen::MatrixXd directions = qr.householderQ() * Eigen::MatrixXd::Identity(left_.rows(), qr.rank());
    left_ -= directions * (directions.transpose() * left_).eval();
    return static_cast<Index>(best);
  }

 private:
  Eigen::MatrixXd::ConstColsBlockXpr Left(std::size_t point) const {
    return left_.middleCols(static_cast<Eigen::Index>(point) * height_, height_);
  }
  std::size_t Farthest() const {
    std::size_t best = 0;
    double most = -1;
    for (std::size_t p = 0; p < points(); ++p) {
      if (const double norm = Left(p).squaredNorm(); !is_taken_[p] && norm > most) best = p, most = norm;
    }
    return best;
  }

  const Eigen::Index height_;      // of a point
  const Eigen::MatrixXd columns_;  // [M x cN]
  Eigen::MatrixXd left_;           // of them, outside of what the pivots span
  std::vector<char> is_taken_;
  const double spanned_;
};

}  // namespace

std::vector<Index> QDeimPoints(const Eigen::MatrixXd& modes, int components, std::size_t count) {
  Pivoting pivoting(modes, components);
  std::vector<Index> points;
  while (points.size() < std::min(count, pivoting.points())) points.push_back(pivoting.Take());
  return points;
}

}  // namespace kpsa::engine::ablation
