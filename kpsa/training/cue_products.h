// Products of scalars as cues. A skinned, sculpted mesh is nearly linear in the entries of the
// world matrices relative to the space, in weights and in values; what is left is mostly a product of two of
// them (a shape that acts before the skin, a combination), or begins where one passes a knot (an in-between,
// a clamp). Measured as cues of their own, they take the place of points, which cost a part of the stack.
#pragma once

#include <algorithm>
#include <span>
#include <vector>

#include "kpsa/subspace.h"
#include "kpsa/training/pose_matrix.h"

namespace kpsa::engine {

// Of the scalars of a layout.
struct CueProduct {
  Index a = 0, b = kNoIndex;  // b may be missing: a alone
  ProductCurve of_a, of_b;
  double lo = 0, hi = 0;  // trained range of the product
};
double ValueOf(const CueProduct& product, std::span<const float> scalars);

struct CueProductOptions {
  std::vector<Index> factors;     // scalars that may be multiplied
  std::vector<Index> regressors;  // those that explain what they can before
  std::vector<double> still;      // [scalars] deviations that count as none
  double tolerance = 1e-4;        // scene units
  std::size_t most = 160;
  bool hinges = true;  // of one factor, with a knot; else products of two alone
};
// Those that explain most of what a linear regression on the regressors leaves of the outputs, greedily, as
// long as they tell clearly more than a column of noise would, and more than is seen. poses: not centred,
// without products. Only products that many poses carry: (sum p^2)^2 / sum p^4 >= 30; of fewer than 1,000
// poses none, nor where there are far more regressors than poses.
std::vector<CueProduct> ChooseCueProducts(const PoseMatrix& poses, const CueProductOptions& options);

// Puts their values into the scalars that a layout reserves for them.
void StoreProducts(std::span<const CueProduct> products, const PoseLayout& layout, std::span<float> row);

}  // namespace kpsa::engine
