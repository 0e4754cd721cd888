#include "base/matrix.h"

#include <algorithm>
#include <cstring>

#include "base/scalar_math.h"

namespace kpsa::engine {

namespace {

typedef double Two __attribute__((vector_size(16)));  // GCC, Clang

Two LoadTwo(const double* from) {
  Two two;
  std::memcpy(&two, from, sizeof(two));
  return two;
}

}  // namespace

Matrix4 operator*(const Matrix4& a, const Matrix4& b) {
  // Two rows at a time, with sums in the order of the definition
  Matrix4 c;
  for (std::size_t half = 0; half < 4; half += 2) {
    const Two a0 = LoadTwo(&a.m[half]), a1 = LoadTwo(&a.m[4 + half]), a2 = LoadTwo(&a.m[8 + half]),
              a3 = LoadTwo(&a.m[12 + half]);
    for (std::size_t column = 0; column < 16; column += 4) {
      const double* of = &b.m[column];
      const Two sum = a0 * of[0] + a1 * of[1] + a2 * of[2] + a3 * of[3];
      std::memcpy(&c.m[column + half], &sum, sizeof(sum));
    }
  }
  return c;
}

double Determinant3(const Matrix4& m) {
  return m(0, 0) * (m(1, 1) * m(2, 2) - m(1, 2) * m(2, 1)) -
         m(0, 1) * (m(1, 0) * m(2, 2) - m(1, 2) * m(2, 0)) +
         m(0, 2) * (m(1, 0) * m(2, 1) - m(1, 1) * m(2, 0));
}

bool Invert(const Matrix4& matrix, Matrix4* inverse) {
  // Cofactors from the 2x2 minors of the upper and the lower two rows
  const auto& m = matrix;
  const double a0 = m(0, 0) * m(1, 1) - m(1, 0) * m(0, 1), a1 = m(0, 0) * m(1, 2) - m(1, 0) * m(0, 2);
  const double a2 = m(0, 0) * m(1, 3) - m(1, 0) * m(0, 3), a3 = m(0, 1) * m(1, 2) - m(1, 1) * m(0, 2);
  const double a4 = m(0, 1) * m(1, 3) - m(1, 1) * m(0, 3), a5 = m(0, 2) * m(1, 3) - m(1, 2) * m(0, 3);
  const double b0 = m(2, 0) * m(3, 1) - m(3, 0) * m(2, 1), b1 = m(2, 0) * m(3, 2) - m(3, 0) * m(2, 2);
  const double b2 = m(2, 0) * m(3, 3) - m(3, 0) * m(2, 3), b3 = m(2, 1) * m(3, 2) - m(3, 1) * m(2, 2);
  const double b4 = m(2, 1) * m(3, 3) - m(3, 1) * m(2, 3), b5 = m(2, 2) * m(3, 3) - m(3, 2) * m(2, 3);
  const double det = a0 * b5 - a1 * b4 + a2 * b3 + a3 * b2 - a4 * b1 + a5 * b0;
  if (det == 0 || !std::isfinite(det) || !std::isfinite(1 / det)) {
    inverse->m.fill(0);
    return false;
  }
  const double s = 1 / det;
  Matrix4 r;
  r(0, 0) = (m(1, 1) * b5 - m(1, 2) * b4 + m(1, 3) * b3) * s;
  r(0, 1) = (-m(0, 1) * b5 + m(0, 2) * b4 - m(0, 3) * b3) * s;
  r(0, 2) = (m(3, 1) * a5 - m(3, 2) * a4 + m(3, 3) * a3) * s;
  r(0, 3) = (-m(2, 1) * a5 + m(2, 2) * a4 - m(2, 3) * a3) * s;
  r(1, 0) = (-m(1, 0) * b5 + m(1, 2) * b2 - m(1, 3) * b1) * s;
  r(1, 1) = (m(0, 0) * b5 - m(0, 2) * b2 + m(0, 3) * b1) * s;
  r(1, 2) = (-m(3, 0) * a5 + m(3, 2) * a2 - m(3, 3) * a1) * s;
  r(1, 3) = (m(2, 0) * a5 - m(2, 2) * a2 + m(2, 3) * a1) * s;
  r(2, 0) = (m(1, 0) * b4 - m(1, 1) * b2 + m(1, 3) * b0) * s;
  r(2, 1) = (-m(0, 0) * b4 + m(0, 1) * b2 - m(0, 3) * b0) * s;
  r(2, 2) = (m(3, 0) * a4 - m(3, 1) * a2 + m(3, 3) * a0) * s;
  r(2, 3) = (-m(2, 0) * a4 + m(2, 1) * a2 - m(2, 3) * a0) * s;
  r(3, 0) = (-m(1, 0) * b3 + m(1, 1) * b1 - m(1, 2) * b0) * s;
  r(3, 1) = (m(0, 0) * b3 - m(0, 1) * b1 + m(0, 2) * b0) * s;
  r(3, 2) = (-m(3, 0) * a3 + m(3, 1) * a1 - m(3, 2) * a0) * s;
  r(3, 3) = (m(2, 0) * a3 - m(2, 1) * a1 + m(2, 2) * a0) * s;
  *inverse = r;
  return true;
}

Matrix4 InverseOrIdentity(const Matrix4& m) {
  Matrix4 inverse;
  return Invert(m, &inverse) ? inverse : Matrix4();
}

Matrix4 Translation(Double3 t) {
  Matrix4 m;
  m(0, 3) = t.x, m(1, 3) = t.y, m(2, 3) = t.z;
  return m;
}

Matrix4 Scaling(Double3 s) {
  Matrix4 m;
  m(0, 0) = s.x, m(1, 1) = s.y, m(2, 2) = s.z;
  return m;
}

namespace {

Matrix4 AxisRotation(int axis, double radians) {
  double s, c;
  SinCos(radians, &s, &c);
  const int j = (axis + 1) % 3, k = (axis + 2) % 3;
  Matrix4 m;
  m(j, j) = c, m(k, k) = c, m(k, j) = s, m(j, k) = -s;
  return m;
}

// The axes in the order of application.
constexpr int kOrders[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {1, 0, 2}, {2, 1, 0}};

}  // namespace

Matrix4 RotationFromEuler(Double3 radians, RotateOrder order) {
  if (radians == Double3()) return Matrix4();
  const int* axes = kOrders[static_cast<int>(order)];
  return AxisRotation(axes[2], radians[axes[2]]) *
         (AxisRotation(axes[1], radians[axes[1]]) * AxisRotation(axes[0], radians[axes[0]]));
}

Double3 EulerFromRotation(const Matrix4& m, RotateOrder order) {
  // R = R_k(c) R_j(b) R_i(a); parity is +1 where (i, j, k) is a cyclic order
  const int* axes = kOrders[static_cast<int>(order)];
  const int i = axes[0], j = axes[1], k = axes[2];
  const double parity = (i + 1) % 3 == j ? 1.0 : -1.0;
  Double3 angles;
  const double sin_b = std::clamp(-parity * m(k, i), -1.0, 1.0);
  if (std::fabs(sin_b) < 1 - 1e-14) {
    angles[i] = Atan2(parity * m(k, j), m(k, k));
    angles[j] = Asin(sin_b);
    angles[k] = Atan2(parity * m(j, i), m(i, i));
  } else {  // gimbal lock: all of the turn goes to the first axis
    angles[i] = Atan2(-parity * m(j, k), m(j, j));
    angles[j] = sin_b > 0 ? kPi / 2 : -kPi / 2;
    angles[k] = 0;
  }
  return angles;
}

Double3 EulerNear(Double3 angles, RotateOrder order, Double3 others) {
  const int* axes = kOrders[static_cast<int>(order)];
  const int i = axes[0], j = axes[1], k = axes[2];
  const auto whole_turns = [](double from, double to) {
    return 2 * kPi * std::round((to - from) / (2 * kPi));
  };
  Double3 nearest;
  double least = std::numeric_limits<double>::infinity();
  // R_k(c) R_j(b) R_i(a) = R_k(c + pi) R_j(pi - b) R_i(a + pi)
  for (const bool other : {false, true}) {
    Double3 now = angles;
    if (other) now[i] += kPi, now[j] = kPi - now[j], now[k] += kPi;
    const double cos_b = std::cos(now[j]), sin_b = std::sin(now[j]);
    if (std::fabs(cos_b) < 1e-4) {  // only a - c, or a + c, is told
      const double parity = (i + 1) % 3 == j ? 1.0 : -1.0, sign = sin_b > 0 ? parity : -parity;
      double off = others[i] - sign * others[k] - (now[i] - sign * now[k]);
      off -= whole_turns(0, off);
      now[i] = others[i] - off / 2, now[k] = others[k] + sign * off / 2;
    }
    double squared = 0;
    for (int axis = 0; axis < 3; ++axis) {
      now[axis] += whole_turns(now[axis], others[axis]);
      squared += (now[axis] - others[axis]) * (now[axis] - others[axis]);
    }
    if (squared < least) nearest = now, least = squared;
  }
  return nearest;
}

Matrix4 RotationFromQuaternion(Quaternion q) { return RotationFromUnit(Normalized(q)); }

Matrix4 RotationFromUnit(Quaternion q) {
  Matrix4 m;
  m(0, 0) = 1 - 2 * (q.y * q.y + q.z * q.z), m(0, 1) = 2 * (q.x * q.y - q.z * q.w),
       m(0, 2) = 2 * (q.x * q.z + q.y * q.w);
  m(1, 0) = 2 * (q.x * q.y + q.z * q.w), m(1, 1) = 1 - 2 * (q.x * q.x + q.z * q.z),
       m(1, 2) = 2 * (q.y * q.z - q.x * q.w);
  m(2, 0) = 2 * (q.x * q.z - q.y * q.w), m(2, 1) = 2 * (q.y * q.z + q.x * q.w),
       m(2, 2) = 1 - 2 * (q.x * q.x + q.y * q.y);
  return m;
}

Matrix4 ComposeTrs(Double3 translation, Quaternion rotation, Double3 scale) {
  Matrix4 m = RotationFromQuaternion(rotation);
  for (int column = 0; column < 3; ++column) {
    for (int row = 0; row < 3; ++row) m(row, column) *= scale[column];
  }
  m(0, 3) = translation.x, m(1, 3) = translation.y, m(2, 3) = translation.z;
  return m;
}

void DecomposeTrs(const Matrix4& m, Double3* translation, Quaternion* rotation, Double3* scale) {
  *translation = {m(0, 3), m(1, 3), m(2, 3)};
  // Gram-Schmidt on the columns keeps the first axis and drops the shear
  Double3 c[3];
  for (int i = 0; i < 3; ++i) c[i] = {m(0, i), m(1, i), m(2, i)};
  Double3 axis[3], s;
  for (int i = 0; i < 3; ++i) {
    Double3 v = c[i];
    for (int j = 0; j < i; ++j) v = v - axis[j] * Dot(axis[j], c[i]);
    s[i] = Length(v);
    axis[i] = UnitOrZero(v);
  }
  for (int i = 0; i < 3; ++i) {  // a collapsed axis is rebuilt from the other two
    if (s[i] == 0) axis[i] = Cross(axis[(i + 1) % 3], axis[(i + 2) % 3]);
  }
  if (Dot(Cross(axis[0], axis[1]), axis[2]) < 0) {
    s.x = -s.x;
    axis[0] = axis[0] * -1.0;
  }
  Matrix4 r;
  for (int column = 0; column < 3; ++column) {
    for (int row = 0; row < 3; ++row) r(row, column) = axis[column][row];
  }
  *rotation = QuaternionFromRotation(r);
  *scale = s;
}

Quaternion QuaternionFromRotation(const Matrix4& m) {
  // The largest of the four candidates is the numerically safe one
  const double t[4] = {1 + m(0, 0) - m(1, 1) - m(2, 2), 1 - m(0, 0) + m(1, 1) - m(2, 2),
                       1 - m(0, 0) - m(1, 1) + m(2, 2), 1 + m(0, 0) + m(1, 1) + m(2, 2)};
  const int largest = static_cast<int>(std::max_element(t, t + 4) - t);
  if (!(t[largest] > 0)) return Quaternion();
  const double s = 0.5 / std::sqrt(t[largest]);
  switch (largest) {
    case 0:
      return Normalized(
          {t[0] * s, (m(1, 0) + m(0, 1)) * s, (m(0, 2) + m(2, 0)) * s, (m(2, 1) - m(1, 2)) * s});
    case 1:
      return Normalized(
          {(m(1, 0) + m(0, 1)) * s, t[1] * s, (m(2, 1) + m(1, 2)) * s, (m(0, 2) - m(2, 0)) * s});
    case 2:
      return Normalized(
          {(m(0, 2) + m(2, 0)) * s, (m(2, 1) + m(1, 2)) * s, t[2] * s, (m(1, 0) - m(0, 1)) * s});
    default:
      return Normalized(
          {(m(2, 1) - m(1, 2)) * s, (m(0, 2) - m(2, 0)) * s, (m(1, 0) - m(0, 1)) * s, t[3] * s});
  }
}

Quaternion operator*(Quaternion a, Quaternion b) {
  return {a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y, a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x,
          a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w, a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z};
}

Quaternion Conjugate(Quaternion q) { return {-q.x, -q.y, -q.z, q.w}; }

Quaternion Normalized(Quaternion q) {
  const double length = std::sqrt(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w);
  if (!(length > 0) || !std::isfinite(length)) return Quaternion();
  const double s = 1 / length;
  return {q.x * s, q.y * s, q.z * s, q.w * s};
}

Quaternion Slerp(Quaternion a, Quaternion b, double t) {
  double cosine = a.x * b.x + a.y * b.y + a.z * b.z + a.w * b.w;
  const double sign = cosine < 0 ? -1.0 : 1.0;
  cosine *= sign;
  double wa = 1 - t, wb = t;
  if (cosine < 1 - 1e-9) {  // nearly equal quaternions: linear is exact to double precision
    const double angle = Acos(cosine), inverse = 1 / std::sqrt((1 - cosine) * (1 + cosine));
    wa = Sin((1 - t) * angle) * inverse;
    wb = Sin(t * angle) * inverse;
  }
  wb *= sign;
  return Normalized({a.x * wa + b.x * wb, a.y * wa + b.y * wb, a.z * wa + b.z * wb, a.w * wa + b.w * wb});
}

Double3 RotationVector(Quaternion q) {
  if (q.w < 0) q = {-q.x, -q.y, -q.z, -q.w};
  const double s = std::sqrt(q.x * q.x + q.y * q.y + q.z * q.z);
  if (s < 1e-12) return {2 * q.x, 2 * q.y, 2 * q.z};
  const double f = 2 * Atan2(s, q.w) / s;
  return {q.x * f, q.y * f, q.z * f};
}

}  // namespace kpsa::engine
