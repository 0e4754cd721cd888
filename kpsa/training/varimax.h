// Varimax rotation of orthonormal modes with the vector criterion: modes become local, the subspace stays.
// With s_ik = |a_ik|^2, the squared length of mode k at point i,
//   V = sum_k [ mean_i s_ik^2 - (mean_i s_ik)^2 ],
// which does not depend on the orientation of the frame. Planar step for modes (j, k): u = s_j - s_k, v = 2
// a_j . a_k,
//   tan 4phi = (2 sum uv - 2 sum u sum v / N) / (sum(u^2 - v^2) - ((sum u)^2 - (sum v)^2) / N)
//   a_j' = cos phi a_j + sin phi a_k,  a_k' = -sin phi a_j + cos phi a_k.
// (H. F. Kaiser 1958, with the row vectors of a point in place of single loadings.)
#pragma once

#include <Eigen/Core>
#include <vector>

namespace kpsa::engine {

struct VarimaxOptions {
  int max_sweeps = 60;
  double tolerance = 1e-10;  // stop when a sweep raises V by less than this share
};

struct VarimaxResult {
  Eigen::MatrixXd rotation;       // R [M x M], orthonormal: rotated = modes * R
  std::vector<double> criterion;  // V before the first sweep and after each; never falls
};

// Rotates `modes` [cN x M] in place. components c: 3 or 1. The rotated modes are recomputed as modes * R at
// the end, so that errors of many planar steps do not add up.
VarimaxResult Varimax(const VarimaxOptions& options, int components, Eigen::MatrixXd* modes);

// V of the modes as they are.
double VarimaxCriterion(const Eigen::MatrixXd& modes, int components);

}  // namespace kpsa::engine
