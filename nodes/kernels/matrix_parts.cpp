#include "nodes/kernels/matrix_parts.h"

namespace kpsa::engine {
namespace {

// Exactly a at 0 and b at 1.
double Mix(double a, double b, double t) { return t == 1 ? b : a + t * (b - a); }
Double3 Mix(Double3 a, Double3 b, double t) { return {Mix(a.x, b.x, t), Mix(a.y, b.y, t), Mix(a.z, b.z, t)}; }

}  // namespace

MatrixParts TakeApart(const Matrix4& m) {
  MatrixParts parts;
  DecomposeTrs(m, &parts.translation, &parts.rotation, &parts.scale);
  // What the rotation leaves is upper triangular: scales on the diagonal, shear times scale above it
  const Matrix4 r = RotationFromUnit(parts.rotation);
  const auto left = [&](int row, int column) {
    return r(0, row) * m(0, column) + r(1, row) * m(1, column) + r(2, row) * m(2, column);
  };
  const Double3& s = parts.scale;
  if (s.y != 0) parts.shear.x = left(0, 1) / s.y;
  if (s.z != 0) parts.shear.y = left(0, 2) / s.z, parts.shear.z = left(1, 2) / s.z;
  return parts;
}

Matrix4 PutTogether(const MatrixParts& parts) {
  Matrix4 m = RotationFromQuaternion(parts.rotation);
  for (int row = 0; row < 3; ++row) {
    const double x = m(row, 0), y = m(row, 1), z = m(row, 2);
    m(row, 0) = x * parts.scale.x;
    m(row, 1) = (parts.shear.x * x + y) * parts.scale.y;
    m(row, 2) = (parts.shear.y * x + parts.shear.z * y + z) * parts.scale.z;
  }
  m(0, 3) = parts.translation.x, m(1, 3) = parts.translation.y, m(2, 3) = parts.translation.z;
  return m;
}

Matrix4 BlendMatrices(const Matrix4& a, const Matrix4& b, const PartWeights& weights) {
  if (weights == PartWeights{0, 0, 0, 0}) return a;
  if (weights == PartWeights{1, 1, 1, 1}) return b;
  const MatrixParts from = TakeApart(a), to = TakeApart(b);
  return PutTogether({Mix(from.translation, to.translation, weights.translate),
                      weights.rotate == 0   ? from.rotation
                      : weights.rotate == 1 ? to.rotation
                                            : Slerp(from.rotation, to.rotation, weights.rotate),
                      Mix(from.scale, to.scale, weights.scale), Mix(from.shear, to.shear, weights.shear)});
}

}  // namespace kpsa::engine
