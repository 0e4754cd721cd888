// The error of an estimate, split as Meyer and Anderson 2007 do. Glossary: A [cN x M] the modes, orthonormal;
// mu the mean; f the points of a pose, e their estimate, both [cN].
//   projection = |(I - A A^T)(f - mu)|  what no coordinates reach
//   cueing     = |A A^T (f - e)|        the coordinates that the cues give, against the best ones
//   storage    = |(I - A A^T)(e - mu)|  what leaves the subspace because the map is stored in tiles and bytes
//   total      = |f - e|
// With a dense map storage is 0 and total^2 = projection^2 + cueing^2 (kpsa/training/estimator.h,
// PoseErrors); in general they differ by at most 2 projection storage + storage^2.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace kpsa::engine {

struct SplitError {
  double projection = 0, cueing = 0, storage = 0, total = 0;  // norms over all rows; unit of the points
};

// A [cN x M]; poses and estimates [cN x F], less the mean, one frame a column. One entry a frame.
std::vector<SplitError> SplitErrors(const Eigen::MatrixXd& modes, const Eigen::MatrixXd& poses,
                                    const Eigen::MatrixXd& estimates);

}  // namespace kpsa::engine
