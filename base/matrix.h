// Functions over Matrix4 and Quaternion. All are pure, allocate nothing and may be called from any thread.
#pragma once

#include "base/types.h"

namespace kpsa::engine {

Matrix4 operator*(const Matrix4& a, const Matrix4& b);

// m applied to a point (w = 1) and to a direction (w = 0). The last row is taken as (0, 0, 0, 1).
inline Double3 TransformPoint(const Matrix4& m, Double3 p) {
  return {m(0, 0) * p.x + m(0, 1) * p.y + m(0, 2) * p.z + m(0, 3),
          m(1, 0) * p.x + m(1, 1) * p.y + m(1, 2) * p.z + m(1, 3),
          m(2, 0) * p.x + m(2, 1) * p.y + m(2, 2) * p.z + m(2, 3)};
}
inline Double3 TransformVector(const Matrix4& m, Double3 v) {
  return {m(0, 0) * v.x + m(0, 1) * v.y + m(0, 2) * v.z, m(1, 0) * v.x + m(1, 1) * v.y + m(1, 2) * v.z,
          m(2, 0) * v.x + m(2, 1) * v.y + m(2, 2) * v.z};
}

// General inverse by cofactors; a singular matrix (|det| == 0 or not finite) gives the zero matrix and
// `false`.
bool Invert(const Matrix4& m, Matrix4* inverse);
// As Invert, of a matrix that is known to be regular; a singular one gives the identity.
Matrix4 InverseOrIdentity(const Matrix4& m);
double Determinant3(const Matrix4& m);

Matrix4 Translation(Double3 t);
Matrix4 Scaling(Double3 s);
Matrix4 RotationFromEuler(Double3 radians, RotateOrder order);
Matrix4 RotationFromQuaternion(Quaternion q);  // q need not be unit length; it is normalised
Matrix4 RotationFromUnit(Quaternion q);        // of unit length
// T * R * S, the glTF composition (glTF 2.0, 3.5.3).
Matrix4 ComposeTrs(Double3 translation, Quaternion rotation, Double3 scale);

// The inverse of ComposeTrs for matrices without shear; shear is lost. A reflection goes into scale.x.
void DecomposeTrs(const Matrix4& m, Double3* translation, Quaternion* rotation, Double3* scale);
// Angles of a rotation matrix (orthonormal upper 3x3) for an order, each within (-pi, pi].
Double3 EulerFromRotation(const Matrix4& rotation, RotateOrder order);
// Of all angles that turn as these do, those nearest to others: what follows a motion without jumps by half a turn.
// Within 0.1 mrad of gimbal lock the turn is kept to that.
Double3 EulerNear(Double3 angles, RotateOrder order, Double3 others);
Quaternion QuaternionFromRotation(const Matrix4& rotation);

Quaternion operator*(Quaternion a, Quaternion b);  // b is applied first
Quaternion Conjugate(Quaternion q);
Quaternion Normalized(Quaternion q);  // zero length gives the identity
// Shortest-path spherical interpolation of unit quaternions (glTF 2.0, appendix C.4).
Quaternion Slerp(Quaternion a, Quaternion b, double t);
// Axis times angle in radians, |angle| <= pi, of a unit quaternion.
Double3 RotationVector(Quaternion q);

}  // namespace kpsa::engine
