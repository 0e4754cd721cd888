// Inside deformers that map points of a handle's space only: that space in floats, about the handle's origin.
#pragma once

#include "base/matrix.h"

namespace kpsa::engine {

// q = inverse (p - pivot) + offset: the pivot is the handle's origin in floats, offset what that leaves. A move of q
// is `linear` times that of p. x y z and a spare number each.
struct HandleFrame {
  float pivot[4], offset[4];
  float inverse[12], linear[12];  // rows; columns
};
// Of the points' space from the handle's, whose axes are `size` times as long as the matrix says; false where it has
// no inverse, or none in floats.
bool PrepareHandleFrame(const Matrix4& matrix, double size, HandleFrame* frame) noexcept;

}  // namespace kpsa::engine
