// The hot loop of SelectCues (kpsa/training/cue_selection.h): gains of all candidates, corrected by one taken
// cue at a time.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "base/points.h"
#include "base/types.h"

namespace kpsa::engine {

// Candidates i = 0..n-1 with rows offsets[i]..offsets[i + 1], at most 3 each.
class CandidateGains {
 public:
  // loadings C [R x M], one row after the other; noise [R]; output_root F [M x M] with W = F^T F, or empty
  // for the identity.
  CandidateGains(std::vector<Index> offsets, std::vector<float> loadings, std::vector<double> noise,
                 Eigen::MatrixXd output_root);

  std::size_t count() const { return offsets_.size() - 1; }
  // C_i as float64 [h x M].
  Eigen::MatrixXd Loadings(std::size_t candidate) const;
  Eigen::VectorXd Noise(std::size_t candidate) const;

  // All gains for a covariance Sigma [M x M].
  void Reset(const Eigen::MatrixXd& sigma);
  // Sigma += sign * update^T update, update [q x M], q <= 3: corrects H, G and the gains.
  void Apply(const Eigen::MatrixXd& update, double sign);
  const std::vector<double>& gains() const { return gains_; }

 private:
  void UpdateGain(std::size_t candidate);

  std::vector<Index> offsets_;
  std::vector<float> loadings_;  // [R x stride] C
  std::vector<double> noise_;    // [R]
  Eigen::MatrixXd output_root_;  // F
  std::size_t modes_ = 0, stride_ = 0;
  AlignedFloats products_;      // as doubles: H [R x stride], H_i = C_i Sigma F^T
  std::vector<double> blocks_;  // [R x 3] C_i Sigma C_i^T, without noise
  std::vector<double> gains_;   // [candidates]
};

}  // namespace kpsa::engine
