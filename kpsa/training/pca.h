// Principal components of the training poses. Glossary: T poses, D columns (kpsa/training/pose_matrix.h), N
// output points, M modes, X the centred poses [T x D] with every column scaled by the square root of its
// weight.
//
// X = U S A^T. Snapshot method (L. Sirovich 1987): eigenvectors of the smaller Gram matrix, in float64; modes
// with S_k < 1e-7 S_1 are dropped (they are rounding); a thin QR, a projection and a small SVD of it restore
// what the squaring lost, so that A^T A = I to 1e-12. Randomised method (Halko, Martinsson, Tropp 2011,
// algorithm 4.4): two power iterations, the same finish.
//
// Columns of weight zero are no part of the decomposition: their rows of `modes` are the regression of that
// column on the mode coordinates, which is what an estimator needs of a cue (cross-covariance / variance).
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>

#include "base/status.h"
#include "kpsa/training/pose_matrix.h"

namespace kpsa::engine {

struct PcaOptions {
  int max_modes = 250;
  double min_ratio = 1e-7;  // of S_k to S_1
  enum class Method : std::uint8_t { kAuto, kSnapshot, kRandomised } method = Method::kAuto;
  int power_iterations = 2;                    // of the randomised method
  std::uint64_t seed = 1;                      // of its random start
  std::span<const double> point_weights = {};  // [N] e.g. areas, > 0; empty: 1
  double stage_weight = 0;                     // weight of the columns of stage points in the decomposition
  double scalar_weight = 0;                    // of the scalars, each first divided by its trained deviation
};

struct Pca {
  PoseLayout layout;
  std::size_t poses = 0;     // T
  Eigen::VectorXd mean;      // [D]
  Eigen::MatrixXd modes;     // [D x M]; rows [0, cN) are A, orthonormal (in the weighted norm if weighted)
  Eigen::VectorXd singular;  // [M] S_k, descending
  double total_energy = 0;   // sum of all S_k^2 = |X|^2 (weighted columns)
  Eigen::VectorXd row_variance;    // [D] of each column over the poses, in its own unit
  Eigen::VectorXd row_residual;    // [D] the part of it that the M modes do not explain
  bool output_orthonormal = true;  // false if weights or jointly decomposed columns make A^T A differ from I

  Eigen::Index mode_count() const { return singular.size(); }
  auto output_modes() const {
    return modes.topRows(static_cast<Eigen::Index>(layout.outputs()));
  }                                                                                  // A [cN x M]
  Eigen::VectorXd mode_variance() const;                                             // L = S_k^2 / (T - 1)
  double discarded_energy() const { return total_energy - singular.squaredNorm(); }  // sum_{k > M} S_k^2
  // sum_{k > M} S_k^2 / ((T - 1) c N): mean variance of an output value outside the modes.
  double output_noise() const;
};

// `poses` must be centred with `mean` (poses.Subtract(mean)). Errors: fewer than 2 poses, no motion at all,
// NaN or infinity in a pose, weights that are not positive. Uses several threads; the result does not depend
// on how many.
Result<Pca> ComputePca(const PoseMatrix& poses, const Eigen::VectorXd& mean, const PcaOptions& options);

// The same PCA with fewer modes (energies adjusted).
Pca TruncatedPca(const Pca& pca, Eigen::Index modes);

}  // namespace kpsa::engine
