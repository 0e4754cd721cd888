#include "nodes/kernels/transform_math.h"

#include <algorithm>
#include <cmath>

#include "base/scalar_math.h"

namespace kpsa::engine {

Matrix4 ComposeLocal(const Matrix4& offset_parent, const TransformValues& values) {
  Matrix4 m = RotationFromEuler(values.rotate, values.rotate_order);
  for (int column = 0; column < 3; ++column) {
    for (int row = 0; row < 3; ++row) m(row, column) *= values.scale[column];
  }
  m(0, 3) = values.translate.x, m(1, 3) = values.translate.y, m(2, 3) = values.translate.z;
  return m == Matrix4() ? offset_parent : offset_parent * m;
}

Quaternion PoseRotation(const Matrix4& local, const Matrix4& rest) {
  Double3 translation, scale;
  Quaternion now, then;
  DecomposeTrs(local, &translation, &now, &scale);
  DecomposeTrs(rest, &translation, &then, &scale);
  return Normalized(Conjugate(then) * now);
}

SwingTwist DecomposeSwingTwist(Quaternion q, Double3 axis) {
  const double along = q.x * axis.x + q.y * axis.y + q.z * axis.z;
  SwingTwist parts;
  if (along * along + q.w * q.w > 1e-24) {
    parts.twist = Normalized({axis.x * along, axis.y * along, axis.z * along, q.w});
  }
  parts.swing = Normalized(q * Conjugate(parts.twist));
  return parts;
}

double TwistAngle(Quaternion twist, Double3 axis) {
  const double along = twist.x * axis.x + twist.y * axis.y + twist.z * axis.z;
  // q and -q are the same turn: take the one with w >= 0, whose half angle lies within [-pi/2, pi/2]
  return twist.w < 0 ? 2 * Atan2(-along, -twist.w) : 2 * Atan2(along, twist.w);
}

Matrix4 NearestRotation(const Matrix4& m) {
  constexpr int kSteps = 40;
  const double sign = Determinant3(m) < 0 ? -1 : 1;
  Matrix4 r;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) r(row, column) = sign * m(row, column);
  }
  // Newton's iteration; the first steps are scaled, so that any size of m takes few of them
  for (int step = 0; step < kSteps; ++step) {
    Matrix4 inverse;
    if (!Invert(r, &inverse)) break;
    double size = 0, inverse_size = 0, change = 0;
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) {
        size += r(row, column) * r(row, column);
        inverse_size += inverse(row, column) * inverse(row, column);
      }
    }
    const double scale = std::sqrt(std::sqrt(inverse_size / size));
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) {
        const double next = 0.5 * (scale * r(row, column) + inverse(column, row) / scale);
        change = std::max(change, std::fabs(next - r(row, column)));
        r(row, column) = next;
      }
    }
    if (change < 1e-14) return r;
  }
  Double3 translation, lengths;
  Quaternion rotation;
  DecomposeTrs(m, &translation, &rotation, &lengths);
  return RotationFromUnit(rotation);
}

}  // namespace kpsa::engine
