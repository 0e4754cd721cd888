// A matrix as Maya takes it apart: M = T . R . Sh . S for column vectors, with the shears xy, xz, yz above
// the diagonal of Sh. Double, pure, any thread.
#pragma once

#include "base/matrix.h"

namespace kpsa::engine {

struct MatrixParts {
  Double3 translation;
  Quaternion rotation;
  Double3 scale{1, 1, 1};  // a reflection is in x
  Double3 shear;           // xy, xz, yz; 0 for an axis that is scaled to nothing
};

MatrixParts TakeApart(const Matrix4& m);
Matrix4 PutTogether(const MatrixParts& parts);

// How much of each part comes from `b`, 0 to 1.
struct PartWeights {
  double translate = 1, rotate = 1, scale = 1, shear = 1;
  friend bool operator==(const PartWeights&, const PartWeights&) = default;
};
// From `a` to `b`, part by part: rotations by slerp, all else linearly. Where all weights are 0 or all are 1
// it is `a` or `b`, bit for bit.
Matrix4 BlendMatrices(const Matrix4& a, const Matrix4& b, const PartWeights& weights);
inline Matrix4 BlendMatrices(const Matrix4& a, const Matrix4& b, double weight) {
  return BlendMatrices(a, b, {weight, weight, weight, weight});
}

}  // namespace kpsa::engine
