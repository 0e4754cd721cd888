// The frame that a subspace lives in: the rigid part of a transform's world matrix, times the
// uniform scale that has come above it since the rest pose. Points of the frame are in metres as at rest,
// whatever stands above: an armature of scale 100 is part of the rest pose, and is divided out.
#pragma once

#include "base/types.h"

namespace kpsa::engine {

// Of the space at rest, A = R U with R a rotation: what is no rotation, inverted (its linear part; mirrored
// spaces have a negative determinant). The identity for most; also of a flat space.
Matrix4 InverseRestStretch(const Matrix4& world_at_rest);

struct SpaceFrame {
  Matrix4 world_from_space;  // rotation times `scale`, and translation
  double scale = 1;          // against rest
  // How far from a rotation times a scale the space is, relative: 0.01 moves a point that is 1 m from the
  // origin by 1 cm. Infinite if it is mirrored against rest, flat, or not finite.
  double stretch = 0;
};
SpaceFrame SpaceFrameOf(const Matrix4& world, const Matrix4& inverse_rest_stretch);

}  // namespace kpsa::engine
