// What a handle has done since rest, less what its parent has done: products and inverses in one call, a column side
// by side. Matrices are affine: last rows are taken as (0, 0, 0, 1). A parent without an inverse counts as the
// identity. The same bits on every target.
#pragma once

#include "base/matrix.h"
#include "nodes/kernels/affine_delta.h"

namespace kpsa::engine {

// Of points that go along with the parent: M = handle after parent^-1.
struct CarriedRest {
  Matrix4 after;  // handle^-1 parent at rest
  Double3 pivot;  // any point near those that are moved, in the parent's space
};
void FindCarriedDelta(const Matrix4& handle, const Matrix4& parent, const CarriedRest& rest,
                      AffineDelta* delta) noexcept;

// Of points that wait where the parent rests: M = before parent^-1 handle after.
struct WaitingRest {
  Matrix4 before, after;
  Double3 pivot;  // in the points' space
};
void FindWaitingDelta(const Matrix4& handle, const Matrix4& parent, const WaitingRest& rest,
                      AffineDelta* delta) noexcept;

// Of points that are deformed where the parent rests.
struct ParentRest {
  Matrix4 parent, inverse;
  Double3 pivot;  // as CarriedRest's
};
struct ParentMotion {
  AffineDelta to_rest;  // rest parent^-1
  float linear[12];     // of what takes moves back: parent rest^-1, columns x y z and a spare number
};
// False where the parent has no inverse.
bool FindParentMotion(const Matrix4& parent, const ParentRest& rest, ParentMotion* motion) noexcept;

// a b
void FindProduct(const Matrix4& a, const Matrix4& b, Matrix4* product) noexcept;
// before (parent^-1 handle)
void FindWaitingFrame(const Matrix4& before, const Matrix4& parent, const Matrix4& handle,
                      Matrix4* frame) noexcept;

}  // namespace kpsa::engine
