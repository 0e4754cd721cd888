#include "kpsa/training/varimax.h"

#include <algorithm>
#include <cmath>

#include "base/cancel.h"
#include "base/check.h"
#include "kpsa/training/gemm.h"

namespace kpsa::engine {
namespace {

// s_ik = |a_ik|^2 of mode k at all points. [N]
Eigen::VectorXd SquaredLengths(const double* mode, Eigen::Index points, int components) {
  const Eigen::Map<const Eigen::MatrixXd> values(mode, components, points);
  return values.colwise().squaredNorm();
}

// Turns the pair of modes in its plane; returns false where it stands already at its maximum.
bool PlanarStep(Eigen::Index points, int components, double* j, double* k, Eigen::VectorXd* s_j,
                Eigen::VectorXd* s_k) {
  const double n = static_cast<double>(points);
  double sum_u = 0, sum_v = 0, sum_uv = 0, sum_difference = 0;
  for (Eigen::Index i = 0; i < points; ++i) {
    const double* a = j + i * components;
    const double* b = k + i * components;
    const double dot = components == 3 ? a[0] * b[0] + a[1] * b[1] + a[2] * b[2] : a[0] * b[0];
    const double u = (*s_j)[i] - (*s_k)[i], v = 2 * dot;
    sum_u += u, sum_v += v, sum_uv += u * v, sum_difference += u * u - v * v;
  }
  const double numerator = 2 * sum_uv - 2 * sum_u * sum_v / n;
  const double denominator = sum_difference - (sum_u * sum_u - sum_v * sum_v) / n;
  const double phi = std::atan2(numerator, denominator) / 4;
  if (!(std::fabs(phi) > 1e-9)) return false;
  const double c = std::cos(phi), s = std::sin(phi);
  for (Eigen::Index i = 0; i < points * components; ++i) {
    const double a = j[i], b = k[i];
    j[i] = c * a + s * b;
    k[i] = c * b - s * a;
  }
  *s_j = SquaredLengths(j, points, components);
  *s_k = SquaredLengths(k, points, components);
  return true;
}

}  // namespace

double VarimaxCriterion(const Eigen::MatrixXd& modes, int components) {
  const Eigen::Index points = modes.rows() / components;
  double criterion = 0;
  for (Eigen::Index k = 0; k < modes.cols(); ++k) {
    const Eigen::VectorXd s = SquaredLengths(modes.col(k).data(), points, components);
    const double mean = s.mean();
    criterion += s.squaredNorm() / static_cast<double>(points) - mean * mean;
  }
  return criterion;
}

VarimaxResult Varimax(const VarimaxOptions& options, int components, Eigen::MatrixXd* modes) {
  KPSA_CHECK(components == 1 || components == 3);
  KPSA_CHECK_EQ(modes->rows() % components, 0);
  const Eigen::Index points = modes->rows() / components, m = modes->cols();
  const Eigen::MatrixXd original = *modes;
  VarimaxResult result;
  result.criterion.push_back(VarimaxCriterion(*modes, components));
  std::vector<Eigen::VectorXd> s;
  for (Eigen::Index k = 0; k < m; ++k) s.push_back(SquaredLengths(modes->col(k).data(), points, components));

  for (int sweep = 0; sweep < options.max_sweeps; ++sweep) {
    bool turned = false;
    for (Eigen::Index j = 0; j + 1 < m; ++j) {
      for (Eigen::Index k = j + 1; k < m; ++k) {
        ThrowIfCancelled();
        turned |= PlanarStep(points, components, modes->col(j).data(), modes->col(k).data(),
                             &s[static_cast<std::size_t>(j)], &s[static_cast<std::size_t>(k)]);
      }
    }
    const double before = result.criterion.back(), after = VarimaxCriterion(*modes, components);
    result.criterion.push_back(after);
    if (!turned || after - before <= options.tolerance * after) break;
  }

  // The rotation as one orthonormal matrix; Newton-Schulz takes out what the planar steps rounded
  result.rotation = Multiply(GemmOperand::Dense(original).Transposed(), GemmOperand::Dense(*modes));
  for (int i = 0; i < 2; ++i) {
    const Eigen::MatrixXd error =
        result.rotation.transpose() * result.rotation - Eigen::MatrixXd::Identity(m, m);
    result.rotation -= 0.5 * result.rotation * error;
  }
  *modes = Multiply(original, result.rotation);
  return result;
}

}  // namespace kpsa::engine
