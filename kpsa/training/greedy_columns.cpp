#include "kpsa/training/greedy_columns.h"

#include <cmath>

namespace kpsa::engine {

std::vector<Eigen::Index> GreedyColumns(const Eigen::MatrixXd& covariance, Eigen::MatrixXd cross,
                                        const GreedyOptions& options) {
  std::vector<Eigen::Index> chosen;
  std::vector<Eigen::VectorXd> steps;
  Eigen::VectorXd variance = covariance.diagonal();
  double remaining = options.total;
  while (remaining > options.left && chosen.size() < options.most) {
    Eigen::Index best = -1;
    double best_gain = 0;
    for (Eigen::Index j = 0; j < variance.size(); ++j) {
      if (variance[j] <= options.least_variance * covariance(j, j)) continue;
      const double gain = cross.col(j).squaredNorm() / variance[j];
      if (gain > best_gain) best_gain = gain, best = j;
    }
    if (best < 0 || best_gain <= options.least_gain) break;
    remaining -= best_gain;
    // A step of a pivoted Cholesky decomposition of the covariance
    Eigen::VectorXd step = covariance.col(best);
    for (const Eigen::VectorXd& before : steps) step -= before[best] * before;
    step /= std::sqrt(variance[best]);
    const Eigen::VectorXd direction = cross.col(best) / std::sqrt(variance[best]);
    cross.noalias() -= direction * step.transpose();
    variance -= step.cwiseAbs2();
    variance[best] = 0;
    steps.push_back(std::move(step));
    chosen.push_back(best);
  }
  return chosen;
}

}  // namespace kpsa::engine
