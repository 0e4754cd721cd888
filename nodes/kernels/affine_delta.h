// d(p) = M p - p in float, precise far from the origin: the matrix is taken about a pivot in double first.
#pragma once

#include <span>

#include "base/matrix.h"
#include "base/points.h"

namespace kpsa::engine {

// d(p) = linear (p - pivot) + offset
struct AffineDelta {
  float linear[9];  // row-major: upper 3x3 of M, minus the identity
  float pivot[3];
  float offset[3];       // M pivot - pivot
  bool is_zero = false;  // M is the identity exactly
};

// `pivot` should lie near the points (the handle's own origin); it is rounded to float.
AffineDelta MakeAffineDelta(const Matrix4& matrix, Double3 pivot);

// out = in + w d(in) over points [begin, end) of dense views, begin a multiple of 16; w = weights[i] *
// envelope, weights padded. In place allowed. Points of weight 0 keep their bits.
void ApplyAffineDelta(const AffineDelta& delta, const float* weights, float envelope, ConstPointsView in,
                      PointsView out, std::size_t begin, std::size_t end) noexcept;

}  // namespace kpsa::engine
