#include "nodes/kernels/constraint_math.h"

#include <cmath>

#include "base/scalar_math.h"

namespace kpsa::engine {
namespace {

constexpr double kParallel = 1e-12;  // sine of the angle below which two directions are one

// Columns x, y, z: x along `first`, y in its plane with `second`.
bool FrameOf(Double3 first, Double3 second, Matrix4* frame) {
  Double3 x, y, z;
  if (!Direction(first, 0, &x) || !Direction(second, 0, &y) || !Direction(Cross(x, y), kParallel, &z))
    return false;
  y = Cross(z, x);
  for (int row = 0; row < 3; ++row) {
    (*frame)(row, 0) = x[row];
    (*frame)(row, 1) = y[row];
    (*frame)(row, 2) = z[row];
  }
  return true;
}

}  // namespace

Double3 Rotate(Quaternion q, Double3 v) {
  const Double3 u{q.x, q.y, q.z}, t = 2.0 * Cross(u, v);
  return v + q.w * t + Cross(u, t);
}

Quaternion AxisAngle(Double3 axis, double radians) {
  double s, c;
  SinCos(0.5 * radians, &s, &c);
  return {axis.x * s, axis.y * s, axis.z * s, c};
}

bool Direction(Double3 v, double least, Double3* unit) {
  // Scaled first: the square of a tiny or a huge length is none
  const double largest = std::fmax(std::fmax(std::fabs(v.x), std::fabs(v.y)), std::fabs(v.z));
  if (!(largest > 0) || !std::isfinite(largest)) return false;
  const Double3 scaled{v.x / largest, v.y / largest, v.z / largest};
  const double length = Length(scaled);
  if (!(length * largest > least)) return false;
  *unit = scaled * (1 / length);
  return true;
}

Double3 Perpendicular(Double3 unit, Double3 wish) {
  Double3 result;
  if (Direction(wish - unit * Dot(unit, wish), kParallel * Length(wish), &result)) return result;
  const double x = std::fabs(unit.x), y = std::fabs(unit.y), z = std::fabs(unit.z);
  const Double3 other = x <= y && x <= z ? Double3{1, 0, 0} : y <= z ? Double3{0, 1, 0} : Double3{0, 0, 1};
  return Direction(other - unit * Dot(unit, other), 0, &result) ? result : Double3{1, 0, 0};
}

Quaternion ShortestArc(Double3 from, Double3 to, Double3 wish) {
  const double w = 1 + Dot(from, to);
  if (w > 1e-12) {
    const Double3 c = Cross(from, to);
    return Normalized({c.x, c.y, c.z, w});
  }
  // Half a turn, then the rest of the way
  const Double3 axis = Perpendicular(from, wish);
  const Quaternion half{axis.x, axis.y, axis.z, 0};
  const Double3 turned = Rotate(half, from), c = Cross(turned, to);
  return Normalized(Normalized({c.x, c.y, c.z, 1 + Dot(turned, to)}) * half);
}

bool AimRotation(Double3 aim_axis, Double3 up_axis, Double3 direction, Double3 up, Quaternion* turn) {
  Matrix4 own, wanted, own_transposed;
  if (!FrameOf(aim_axis, up_axis, &own) || !FrameOf(direction, up, &wanted)) return false;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) own_transposed(row, column) = own(column, row);
  }
  *turn = QuaternionFromRotation(wanted * own_transposed);
  return true;
}

bool AngleAbout(Double3 axis, Double3 from, Double3 to, double* radians) {
  Double3 a, b;
  if (!Direction(from - axis * Dot(axis, from), kParallel * Length(from), &a) ||
      !Direction(to - axis * Dot(axis, to), kParallel * Length(to), &b))
    return false;
  *radians = Atan2(Dot(axis, Cross(a, b)), Dot(a, b));
  return true;
}

void RotationMean::Add(Quaternion q, double weight) {
  if (!(weight > 0)) return;
  if (mode_ == Mode::kShortest) {
    mean_ = total_ == 0 ? q : Slerp(mean_, q, weight / (total_ + weight));
  } else if (total_ == 0) {
    mean_ = {q.x * weight, q.y * weight, q.z * weight, q.w * weight};
  } else {
    const double along = mean_.x * q.x + mean_.y * q.y + mean_.z * q.z + mean_.w * q.w;
    const double s = along < 0 ? -weight : weight;
    mean_ = {mean_.x + s * q.x, mean_.y + s * q.y, mean_.z + s * q.z, mean_.w + s * q.w};
  }
  total_ += weight;
}

Quaternion RotationMean::Get() const {
  return mode_ == Mode::kAverage && total_ > 0 ? Normalized(mean_) : mean_;
}

}  // namespace kpsa::engine
