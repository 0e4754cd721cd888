#include "nodes/kernels/transform_math.h"

#include "base/scalar_math.h"

namespace kpsa {

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

}  // namespace kpsa
