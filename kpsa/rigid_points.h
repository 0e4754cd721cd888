// Points through a matrix, in place, in float; the translation is added last so that small shapes far away
// keep their detail up to the spacing of float there.
#pragma once

#include <array>

#include "base/points.h"
#include "base/types.h"

namespace kpsa::engine {

using FloatMatrix = std::array<float, 12>;  // 3x4 by columns
FloatMatrix ToFloats(const Matrix4& matrix);

// The same bits on every SIMD target. Arrays as PointsView has them: the padding is written.
void TransformPoints(const FloatMatrix& matrix, PointsView points);

}  // namespace kpsa::engine
