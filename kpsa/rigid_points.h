// Points through a matrix, in place, in float; the translation is added last so that small shapes far away keep
// their detail up to the spacing of float there.
#pragma once

#include "base/points.h"
#include "base/types.h"

namespace kpsa {

// The same bits on every SIMD target.
void TransformPoints(const Matrix4& matrix, PointsView points);

}  // namespace kpsa
