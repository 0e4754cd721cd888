// How far off points are, of what some poses are off by: [3n x T], three rows a point. Internal to training.
#pragma once

#include <Eigen/Core>

namespace kpsa::engine {

// [n x T]
Eigen::MatrixXd PointErrors(const Eigen::MatrixXd& off);
// Of each pose, that of the point that is off farthest. [T]
Eigen::VectorXd LargestErrors(const Eigen::MatrixXd& off);

}  // namespace kpsa::engine
