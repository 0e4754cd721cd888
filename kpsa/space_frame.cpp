#include "kpsa/space_frame.h"

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "base/matrix.h"

namespace kpsa::engine {
namespace {

constexpr double kFileRounding = 1e-6;  // rotations of a file are floats
constexpr double kRounding = 1e-9;      // of a product of a few matrices

}  // namespace

Matrix4 InverseRestStretch(const Matrix4& world_at_rest) {
  Eigen::Matrix3d a;
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) a(r, c) = world_at_rest(r, c);
  }
  Matrix4 inverse;
  if (!a.allFinite() || std::fabs(a.determinant()) < 1e-30) return inverse;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(a.transpose() * a);
  Eigen::Matrix3d u = eigen.eigenvectors() * eigen.eigenvalues().cwiseSqrt().cwiseInverse().asDiagonal() *
                      eigen.eigenvectors().transpose();
  if (a.determinant() < 0) u = -u;
  if ((u - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < kFileRounding) return inverse;
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) inverse(r, c) = 0.5 * (u(r, c) + u(c, r));
  }
  return inverse;
}

SpaceFrame SpaceFrameOf(const Matrix4& world, const Matrix4& inverse_rest_stretch) {
  SpaceFrame frame;
  frame.world_from_space = inverse_rest_stretch == Matrix4() ? world : world * inverse_rest_stretch;
  const Matrix4& b = frame.world_from_space;
  if (b == Matrix4()) return frame;
  double squared[3][3], trace = 0;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) squared[i][j] = b(0, i) * b(0, j) + b(1, i) * b(1, j) + b(2, i) * b(2, j);
    trace += squared[i][i];
  }
  const double scale2 = trace / 3;
  if (!(scale2 > 0) || !std::isfinite(scale2) || !(Determinant3(b) > 0)) {
    frame.stretch = std::numeric_limits<double>::infinity();
    return frame;
  }
  double off = 0;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) off = std::max(off, std::fabs(squared[i][j] / scale2 - (i == j)) / 2);
  }
  frame.scale = std::sqrt(scale2);
  if (std::fabs(frame.scale - 1) < kFileRounding) frame.scale = 1;
  frame.stretch = off < kRounding ? 0 : off;
  return frame;
}

}  // namespace kpsa::engine
