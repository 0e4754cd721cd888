#include "nodes/kernels/weights.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>

#include "base/check.h"

namespace kpsa::engine {

std::vector<Index> AllPoints(std::size_t count) {
  std::vector<Index> points(count);
  std::iota(points.begin(), points.end(), Index{0});
  return points;
}

bool IsSortedSet(std::span<const Index> points, std::size_t limit) {
  for (std::size_t i = 1; i < points.size(); ++i) {
    if (points[i] <= points[i - 1]) return false;
  }
  return points.empty() || points.back() < limit;
}

std::vector<Index> PositionsIn(std::span<const Index> points, std::span<const Index> wanted) {
  std::vector<Index> positions;
  positions.reserve(wanted.size());
  std::size_t at = 0;
  for (Index p : wanted) {
    while (at < points.size() && points[at] < p) ++at;
    KPSA_CHECK(at < points.size() && points[at] == p);
    positions.push_back(static_cast<Index>(at));
  }
  return positions;
}

Result<std::vector<float>> WeightsFromMap(std::size_t point_count, std::span<const Index> indices,
                                          std::span<const float> values, float fallback) {
  if (indices.size() != values.size()) {
    return Status::Invalid("a weight map of {} indices and {} values, expected as many", indices.size(),
                           values.size());
  }
  if (!std::isfinite(fallback)) return Status::Invalid("the default of a weight map is not a finite number");
  std::vector<float> weights(point_count, fallback);
  std::vector<bool> named(point_count, false);
  for (std::size_t i = 0; i < indices.size(); ++i) {
    const Index p = indices[i];
    if (p >= point_count) {
      return Status::Invalid("entry {} of a weight map names point {}, expected an index below {}", i, p,
                             point_count);
    }
    if (named[p]) return Status::Invalid("a weight map names point {} twice", p);
    if (!std::isfinite(values[i])) return Status::Invalid("the weight of point {} is not a finite number", p);
    named[p] = true;
    weights[p] = values[i];
  }
  return weights;
}

std::vector<float> GatherWeights(std::span<const float> full, std::span<const Index> out_points) {
  std::vector<float> weights;
  if (full.empty()) return weights;
  weights.reserve(out_points.size());
  for (Index p : out_points) {
    KPSA_CHECK_LT(p, full.size());
    weights.push_back(full[p]);
  }
  return weights;
}

std::vector<float> MultiplyWeights(std::span<const float> a, std::span<const float> b) {
  if (a.empty()) return {b.begin(), b.end()};
  std::vector<float> product(a.begin(), a.end());
  if (b.empty()) return product;
  KPSA_CHECK_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < b.size(); ++i) product[i] *= b[i];
  return product;
}

AlignedFloats PaddedWeights(std::span<const float> weights, std::size_t count) {
  AlignedFloats padded(PaddedCount(count));
  if (weights.empty()) {
    std::fill_n(padded.data(), count, 1.0f);
  } else {
    KPSA_CHECK_EQ(weights.size(), count);
    std::copy(weights.begin(), weights.end(), padded.data());
  }
  return padded;
}

void GatherPoints(ConstPointsView in, std::span<const Index> positions, PointsView out) {
  for (std::size_t i = 0; i < positions.size(); ++i) out.x[i] = in.x[positions[i]];
  if (out.y == nullptr) return;
  for (std::size_t i = 0; i < positions.size(); ++i) out.y[i] = in.y[positions[i]];
  for (std::size_t i = 0; i < positions.size(); ++i) out.z[i] = in.z[positions[i]];
}

}  // namespace kpsa::engine
