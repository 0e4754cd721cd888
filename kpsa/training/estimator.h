// From measured cues to the outputs: one linear map, in two modes. Glossary: y the r measurements
// (normalised, mean free: kpsa/training/cue_selection.h), A [cN x M] the output rows of the modes, L their
// variances, C [r x M] the cues' rows.
//
// map:   f = mu + A L C^T G^-1 y,  G = C L C^T + noise   (maximum a posteriori; all modes that training supports)
// paper: f = mu + A p,  p = argmin |y - C p|             (least squares through a QR of C; M <= r modes)
#pragma once

#include <Eigen/Core>
#include <limits>
#include <string>

#include "kpsa/soft_cache.h"
#include "kpsa/training/cue_selection.h"

namespace kpsa::engine {

struct Estimator {
  EstimatorMode mode = EstimatorMode::kMap;
  Eigen::MatrixXd gain;         // B [cN x r]: f - mu = B y; empty where it was not asked for (B = A Q)
  Eigen::VectorXd reach;        // [r] the largest entry of each column of B
  Eigen::MatrixXd coordinates;  // Q [M x r]: mode coordinates p = Q y
  Eigen::MatrixXd covariance;   // G [r x r] of y under the model (both modes)
  Eigen::MatrixXd whitening;  // [r x r] lower triangular, inverse Cholesky factor of G: w = whitening * y has
                              // unit covariance
  Eigen::MatrixXd judge;  // [r x r] symmetric: G^-1 (map) or the projector on the residual I - C C^+ (paper)
  double condition = 0;   // sigma_max / sigma_min of C (paper mode; 0 in map mode)
  std::string warning;    // not empty: paper mode fell back to map, and why
};

// B takes much memory for pictures, and its columns' reach much time where errors alone are asked for.
enum class EstimatorParts { kAll, kReach, kNoGain };  // without B; without reach, too, which SoftCache needs
Estimator MapEstimator(const Pca& pca, const CueSet& cues, EstimatorParts parts = EstimatorParts::kAll);

// Paper mode. A condition number above 1e4, or fewer rows than modes, gives MapEstimator with a warning.
inline constexpr double kMaxCondition = 1e4;
Estimator LeastSquaresEstimator(const Pca& pca, const CueSet& cues);

// PCA modes rotated: A R with the variances of the rotated coordinates on the diagonal only when R is a
// permutation, so the full covariance R^T L R travels with it (MAP gives the same result before and after
// rotation).
Estimator RotatedMapEstimator(const Pca& pca, const CueSet& cues, const Eigen::MatrixXd& rotation);

// Measured values of pose t: y from a row of a centred pose matrix. [r]
Eigen::VectorXd MeasuredCues(const PoseLayout& layout, const CueSet& cues,
                             std::span<const float> centered_row);
// Of all poses, one a column. [r x T]
Eigen::MatrixXd MeasuredPoses(const PoseLayout& layout, const CueSet& cues, const PoseMatrix& centered);

// Errors of one pose in the norm of the outputs: total^2 = projection^2 + cue^2 where A is orthonormal.
struct PoseErrors {
  double projection = 0;  // |f - A A^T f|
  double cue = 0;         // |A A^T f - B y|
  double total = 0;       // |f - B y|
  double largest = 0;     // largest point error
};
// For all poses (centred with pca.mean). RMS of a pose = error / sqrt(N).
std::vector<PoseErrors> EstimateErrors(const Pca& pca, const CueSet& cues, const Estimator& estimator,
                                       const PoseMatrix& poses);
// Errors by point, over every `stride`-th pose. A point that is no number is infinitely far off.
struct PointSurvey {
  std::vector<double> largest;  // [N] scene units
  std::vector<Index> beyond;    // [N] poses in which the point is farther off than `limit`
  std::vector<double> by_pose;  // largest error of each pose that was looked at
  std::size_t poses() const { return by_pose.size(); }
  std::size_t poses_beyond(double limit) const;
};
PointSurvey SurveyPoints(const Pca& pca, const CueSet& cues, const Estimator& estimator,
                         const PoseMatrix& poses, std::size_t stride,
                         double limit = std::numeric_limits<double>::infinity());
// Root of the mean over poses and points of the squared total error, scene units.
double RmsError(const std::vector<PoseErrors>& errors, std::size_t points);

}  // namespace kpsa::engine
