// d(p) = M p - p in float, precise far from the origin: the matrix is taken about a pivot in double first.
#pragma once

#include <span>

#include "base/matrix.h"
#include "base/points.h"

namespace kpsa::engine {

// d(p) = linear (p - pivot) + offset
struct AffineDelta {
  float linear[12];      // columns x y z and a spare number: upper 3x3 of M, minus the identity
  float pivot[4];        // x y z and a spare number, as is the next
  float offset[4];       // M pivot - pivot
  bool is_zero = false;  // M is the identity exactly
};

// `pivot` should lie near the points (the handle's own origin); it is rounded to float.
AffineDelta MakeAffineDelta(const Matrix4& matrix, Double3 pivot);

// out = in + w d(in) over points [begin, end) of dense views, begin a multiple of 16; w = weights[i] *
// envelope, weights padded; null: envelope. In place allowed. Points of weight 0 keep their bits.
void ApplyAffineDelta(const AffineDelta& delta, const float* weights, float envelope, ConstPointsView in,
                      PointsView out, std::size_t begin, std::size_t end) noexcept;

// out = in + linear (to - from), likewise; linear as an AffineDelta's, with the identity in it. Points whose `to` is
// `from` keep their bits.
void AddTurned(const float* linear, ConstPointsView from, ConstPointsView to, ConstPointsView in,
               PointsView out, std::size_t begin, std::size_t end) noexcept;

}  // namespace kpsa::engine
