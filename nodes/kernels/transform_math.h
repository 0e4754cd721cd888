// The mathematics of the transform node. Double, pure, any thread.
#pragma once

#include "base/matrix.h"

namespace kpsa::engine {

struct TransformValues {
  Double3 translate;
  Double3 rotate;  // radians, in rotate_order
  RotateOrder rotate_order = RotateOrder::kXyz;
  Double3 scale{1, 1, 1};
};

// offset_parent * T * R * S
Matrix4 ComposeLocal(const Matrix4& offset_parent, const TransformValues& values);

// The rotation of `local` against `rest`: rest_rotation^-1 * local_rotation; scale and shear are dropped.
Quaternion PoseRotation(const Matrix4& local, const Matrix4& rest);

// q = swing * twist, twist about `axis` (unit length), swing about an axis perpendicular to it. Where q turns
// the axis around by pi, the twist is the identity.
struct SwingTwist {
  Quaternion swing, twist;
};
SwingTwist DecomposeSwingTwist(Quaternion q, Double3 axis);
// The angle of a twist about `axis`, within (-pi, pi].
double TwistAngle(Quaternion twist, Double3 axis);

// The rotation nearest to the linear part of m (polar decomposition; Higham 1986); of -m where m is a
// reflection. Where m is singular, that of DecomposeTrs.
Matrix4 NearestRotation(const Matrix4& m);

}  // namespace kpsa::engine
