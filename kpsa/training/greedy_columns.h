// Which of many measurements predict something best: greedy, by the fall of the expected squared error.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <vector>

namespace kpsa::engine {

struct GreedyOptions {
  double total = 0;                                            // squared error without any column
  double left = 0;                                             // until less than this would be left
  std::size_t most = std::numeric_limits<std::size_t>::max();  // columns
  double least_variance = 1e-12;  // of a column's own: less is left where it is a sum of those chosen
  double least_gain = 0;          // of a step
};

// covariance [p x p] of the columns, cross [q x p] of what is predicted with them. In the order of choice.
std::vector<Eigen::Index> GreedyColumns(const Eigen::MatrixXd& covariance, Eigen::MatrixXd cross,
                                        const GreedyOptions& options);

}  // namespace kpsa::engine
