#include "kpsa/training/mode_choice.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "base/check.h"
#include "kpsa/training/estimator.h"
#include "kpsa/training/gemm.h"

namespace kpsa::engine {
namespace {

constexpr double kStill = 0.05;  // of the tolerance: the norm of all displacements, RMS over the poses

}  // namespace

bool IsStill(const Pca& pca, double tolerance) {
  const double still = kStill * tolerance;
  return pca.total_energy < still * still * static_cast<double>(pca.poses);
}

double HonestResidual(double residual, std::size_t poses, Eigen::Index modes) {
  const auto t = static_cast<double>(poses), left = t - 1 - static_cast<double>(modes);
  return residual * (t - 1) / std::max(left, 1.0);
}

Eigen::Index ChooseModeCount(const Pca& pca, std::span<const CueRef> cues, const CueNoise& noise,
                             const PoseMatrix& judges) {
  KPSA_CHECK(judges.centered() && judges.layout() == pca.layout && pca.output_orthonormal);
  const CueSet set = MakeCueSet(pca, cues, noise);
  const Eigen::MatrixXd best =
      Multiply(GemmOperand::Dense(pca.output_modes()).Transposed(),
               GemmOperand::Poses(judges, 0, judges.poses(), 0, pca.layout.outputs()).Transposed());
  const Eigen::MatrixXd y = MeasuredPoses(pca.layout, set, judges);
  const Eigen::VectorXd variances = pca.mode_variance();
  std::vector<Eigen::Index> counts;
  std::vector<double> errors;  // less the poses' own energy, which no mode changes
  for (double wanted = 1; counts.empty() || counts.back() < pca.mode_count(); wanted *= 1.2) {
    const auto m = std::min(static_cast<Eigen::Index>(std::ceil(wanted)), pca.mode_count());
    if (!counts.empty() && m == counts.back()) continue;
    const Eigen::MatrixXd c = set.loadings.leftCols(m);
    const Eigen::MatrixXd cp = c * variances.head(m).asDiagonal();
    Eigen::MatrixXd covariance = Multiply(cp, c.transpose());
    for (Eigen::Index row = 0; row < set.rows(); ++row) {
      const Eigen::Index rest =
          pca.mode_count() - m;  // of the modes; what all leave over is in the set's noise
      const double left =
          (set.loadings.row(row).tail(rest).array().square() * variances.tail(rest).array().transpose())
              .sum();
      covariance(row, row) += HonestResidual(left + set.noise[row], pca.poses, m);
    }
    const Eigen::MatrixXd p = cp.transpose() * covariance.llt().solve(y);  // [m x poses]
    counts.push_back(m);
    errors.push_back(p.squaredNorm() - 2 * p.cwiseProduct(best.topRows(m)).sum());
  }
  double energy = 0;
  for (std::size_t t = 0; t < judges.poses(); ++t) {
    for (std::size_t i = 0; i < pca.layout.outputs(); ++i)
      energy += static_cast<double>(judges.row(t)[i]) * static_cast<double>(judges.row(t)[i]);
  }
  const double least = energy + *std::min_element(errors.begin(), errors.end());
  std::size_t chosen = 0;
  while (energy + errors[chosen] > 1.02 * std::max(least, 0.0) && chosen + 1 < errors.size()) ++chosen;
  return counts[chosen];
}

std::vector<Index> GoldenSpread(std::size_t total, std::size_t count) {
  std::vector<Index> points;
  if (count >= total) {
    for (std::size_t i = 0; i < total; ++i) points.push_back(static_cast<Index>(i));
    return points;
  }
  for (std::size_t i = 0; i < count; ++i) {
    const double place = static_cast<double>(i) * 0.6180339887498949;
    points.push_back(static_cast<Index>((place - std::floor(place)) * static_cast<double>(total)));
  }
  std::sort(points.begin(), points.end());
  points.erase(std::unique(points.begin(), points.end()), points.end());
  return points;
}

std::vector<Index> EvenSpread(std::size_t total, std::size_t count) {
  std::vector<Index> points;
  count = std::min(count, total);
  for (std::size_t i = 0; i < count; ++i)
    points.push_back(static_cast<Index>((2 * i + 1) * total / (2 * count)));
  return points;
}

}  // namespace kpsa::engine
