// What a handle has done since rest, less what its parent has done: three products and an inverse in one call, four
// rows side by side. The bits are those of base/matrix.h on every target.
#pragma once

#include "base/matrix.h"

namespace kpsa::engine {

struct CarriedDelta {
  Matrix4 delta;   // handle * parent_from_handle * parent^-1; a singular parent counts as the identity
  Matrix4 motion;  // parent * parent_rest_inverse
};
void FindCarriedDelta(const Matrix4& handle, const Matrix4& parent_from_handle, const Matrix4& parent,
                      const Matrix4& parent_rest_inverse, CarriedDelta* result) noexcept;

}  // namespace kpsa::engine
