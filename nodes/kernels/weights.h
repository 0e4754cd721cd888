// What all deformer kernels share: per-point weights, sets of points, and the conventions of bound kernels.
//
// A *bound kernel* is an immutable object that was built from a mesh's constants for a sorted list of output
// points (all points: the full evaluation). Its Run is const, noexcept and allocates nothing; scratch of
// ScratchFloats() floats, 64-byte aligned, is passed in. Views are dense: entry i of `out` is mesh point
// out_points[i]. Local kernels read `in` at the same entries and may work in place (in.x == out.x). The
// result of a point has the same bits whatever the binding, the SIMD target and the split over threads;
// per-point sums run in the full mesh's order. Wherever a kernel takes `point_weights`, there is one weight
// for each output point, in the order of out_points; an empty span means 1 everywhere. The weight of a point
// is point_weights[i] * envelope, in float; a point of weight 0 comes out as it came in, bit for bit.
#pragma once

#include <span>
#include <vector>

#include "base/points.h"
#include "base/status.h"

namespace kpsa::engine {

// 0, 1, .., count - 1: the list of all points.
std::vector<Index> AllPoints(std::size_t count);
// True if strictly ascending and below `limit`.
bool IsSortedSet(std::span<const Index> points, std::size_t limit);
// Where each of `wanted` lies in `points`; both sorted, wanted a subset of points (checked).
std::vector<Index> PositionsIn(std::span<const Index> points, std::span<const Index> wanted);

// A weight for every mesh point from a sparse map: `fallback` where no index names the point.
// Errors: lengths that differ, an index out of range or twice, a weight that is not finite.
Result<std::vector<float>> WeightsFromMap(std::size_t point_count, std::span<const Index> indices,
                                          std::span<const float> values, float fallback);
// Full-mesh weights at the output points; empty stays empty.
std::vector<float> GatherWeights(std::span<const float> full, std::span<const Index> out_points);
// a * b point by point, either may be empty (1 everywhere).
std::vector<float> MultiplyWeights(std::span<const float> a, std::span<const float> b);
// Aligned, padded with zeros to PaddedCount(count); all ones (and padding zero) if `weights` is empty.
AlignedFloats PaddedWeights(std::span<const float> weights, std::size_t count);

// out[i] = in[positions[i]].
void GatherPoints(ConstPointsView in, std::span<const Index> positions, PointsView out);

}  // namespace kpsa::engine
