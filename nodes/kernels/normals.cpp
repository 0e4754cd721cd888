#include "nodes/kernels/normals.h"

#include <algorithm>

#include "base/check.h"
#include "nodes/kernels/weights.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nodes/kernels/normals.cpp"
#include "hwy/foreach_target.h"

#include "nodes/kernels/xyzw-inl.h"

#ifndef KPSA_NODES_KERNELS_NORMALS_BLOCK_
#define KPSA_NODES_KERNELS_NORMALS_BLOCK_
namespace kpsa::engine {
// Points between two passes: the gathering stores of a block have left the store buffer before
// the wider loads read them.
inline constexpr std::size_t kNormalsBlock = 64;
inline constexpr std::size_t kNormalsGrain = 512;  // points between two lots of triangles
}  // namespace kpsa::engine
#endif

HWY_BEFORE_NAMESPACE();
namespace kpsa::engine {
namespace HWY_NAMESPACE {

void PackPoints(ConstPointsView in, std::size_t begin, std::size_t end, float* xyzw) {
  PackXyzw(in.x, in.y, in.z, begin, end, 0.0f, xyzw);
}

// (b - a) x (c - a) of the triangles [begin, end), xyzw.
void CrossTriangles(const Index* triangles, std::size_t begin, std::size_t end, const float* points,
                    float* HWY_RESTRICT crosses) {
  for (std::size_t t = begin; t < end; ++t) {
    const Index* corner = triangles + 3 * t;
    const F4 a = Load4(points + corner[0]);
    Store4(Cross4(Sub4(Load4(points + corner[1]), a), Sub4(Load4(points + corner[2]), a)), crosses + 4 * t);
  }
}

void SumNormals(const std::uint8_t* lanes, const Index* offsets, const Index* around, std::size_t begin,
                std::size_t end, const float* crosses, PointsView normals) {
  const DLanes d;
  alignas(64) float sums[4 * kNormalsBlock] = {};
  for (std::size_t block = begin; block < end; block += kNormalsBlock) {
    const std::size_t size = HWY_MIN(kNormalsBlock, end - block);
    for (std::size_t k = 0; k < size; ++k) {
      F4 sum = Zero4();
      const Index last = offsets[block + k + 1];
      for (Index e = offsets[block + k]; e < last; ++e) sum = Add4(sum, Load4(crosses + around[e]));
      Store4(sum, sums + 4 * lanes[block + k]);
    }
    for (std::size_t k = 0; k < size; k += hn::Lanes(d)) {
      VLanes x, y, z, spare;
      hn::LoadInterleaved4(d, sums + 4 * k, x, y, z, spare);
      const VLanes square = Fma(x, x, Fma(y, y, hn::Mul(z, z)));
      const auto none = hn::Eq(square, hn::Zero(d));
      const VLanes scale = hn::IfThenZeroElse(none, hn::Div(hn::Set(d, 1.0f), hn::Sqrt(square)));
      hn::Store(hn::Mul(x, scale), d, normals.x + block + k);
      hn::Store(hn::Mul(y, scale), d, normals.y + block + k);
      hn::Store(hn::Mul(z, scale), d, normals.z + block + k);
    }
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace kpsa::engine
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace kpsa::engine {

HWY_EXPORT(PackPoints);
HWY_EXPORT(CrossTriangles);
HWY_EXPORT(SumNormals);

namespace {

std::vector<Index> TrianglesAround(const Topology& topology, std::span<const Index> points) {
  std::vector<Index> triangles;
  for (Index p : points) {
    const auto row = topology.point_triangles().row(p);
    triangles.insert(triangles.end(), row.begin(), row.end());
  }
  std::sort(triangles.begin(), triangles.end());
  triangles.erase(std::unique(triangles.begin(), triangles.end()), triangles.end());
  return triangles;
}

}  // namespace

std::vector<Index> NormalsDemand(const Topology& topology, std::span<const Index> out_points) {
  std::vector<Index> points;
  for (Index t : TrianglesAround(topology, out_points)) {
    for (std::size_t c = 0; c < 3; ++c) points.push_back(topology.triangles()[3 * t + c]);
  }
  std::sort(points.begin(), points.end());
  points.erase(std::unique(points.begin(), points.end()), points.end());
  return points;
}

NormalsKernel::NormalsKernel(const Topology& topology, std::span<const Index> out_points,
                             std::span<const Index> in_points)
    : count_(out_points.size()), in_count_(in_points.size()) {
  KPSA_CHECK(IsSortedSet(out_points, topology.point_count()));
  KPSA_CHECK(IsSortedSet(in_points, topology.point_count()));
  constexpr std::size_t kLimit = std::size_t{1} << 29;  // indices are stored times 4
  KPSA_CHECK(topology.point_count() < kLimit && topology.triangle_count() < kLimit);
  const std::vector<Index> needed = TrianglesAround(topology, out_points);
  for (Index t : needed) {
    for (std::size_t c = 0; c < 3; ++c) {
      const Index p = topology.triangles()[3 * t + c];
      const auto at = std::lower_bound(in_points.begin(), in_points.end(), p);
      KPSA_CHECK(at != in_points.end() && *at == p);
      triangles_.push_back(static_cast<Index>(4 * (at - in_points.begin())));
    }
  }
  const auto triangles_of = [&](std::size_t i) { return topology.point_triangles().row(out_points[i]); };
  for (std::size_t i = 0; i < count_; ++i) lanes_.push_back(static_cast<std::uint8_t>(i % kNormalsBlock));
  for (std::size_t begin = 0; begin < count_; begin += kNormalsBlock) {
    const auto first = lanes_.begin() + static_cast<std::ptrdiff_t>(begin);
    std::stable_sort(first, first + static_cast<std::ptrdiff_t>(std::min(kNormalsBlock, count_ - begin)),
                     [&](std::uint8_t a, std::uint8_t b) {
                       return triangles_of(begin + a).size() < triangles_of(begin + b).size();
                     });
  }
  offsets_.push_back(0);
  for (std::size_t k = 0; k < count_; ++k) {
    for (Index t : triangles_of(k / kNormalsBlock * kNormalsBlock + lanes_[k])) {
      const auto at = std::lower_bound(needed.begin(), needed.end(), t);
      around_.push_back(static_cast<Index>(4 * (at - needed.begin())));
    }
    offsets_.push_back(static_cast<Index>(around_.size()));
  }
  std::size_t ready = 0;
  for (std::size_t begin = 0; begin < count_; begin += kNormalsGrain) {
    const std::size_t end = std::min(begin + kNormalsGrain, count_);
    for (Index e = offsets_[begin]; e < offsets_[end]; ++e) {
      ready = std::max<std::size_t>(ready, around_[e] / 4 + 1);
    }
    ready_.push_back(static_cast<Index>(ready));
  }
}

void NormalsKernel::Run(ConstPointsView in, PointsView normals, std::span<float> scratch,
                        const Parallel* parallel) const noexcept {
  KPSA_CHECK_EQ(in.count, in_count_);
  KPSA_CHECK_EQ(normals.count, count_);
  KPSA_CHECK_LE(ScratchFloats(), scratch.size());
  float *points = scratch.data(), *crosses = points + 4 * PaddedCount(in_count_);
  ForRanges(parallel, in_count_, 8192, [&](std::size_t begin, std::size_t end) {
    HWY_DYNAMIC_DISPATCH(PackPoints)(in, begin, end, points);
  });
  const auto cross = [&](std::size_t begin, std::size_t end) {
    HWY_DYNAMIC_DISPATCH(CrossTriangles)(triangles_.data(), begin, end, points, crosses);
  };
  const auto sum = [&](std::size_t begin, std::size_t end) {
    HWY_DYNAMIC_DISPATCH(SumNormals)
    (lanes_.data(), offsets_.data(), around_.data(), begin, end, crosses, normals);
  };
  if (parallel == nullptr) {  // triangles just before the points that need them: they are still in the cache
    for (std::size_t done = 0, begin = 0; begin < count_; begin += kNormalsGrain) {
      const std::size_t ready = ready_[begin / kNormalsGrain];
      if (ready > done) cross(done, ready), done = ready;
      sum(begin, std::min(begin + kNormalsGrain, count_));
    }
    return;
  }
  ForRanges(parallel, triangles_.size() / 3, 2048, cross);
  ForRanges(parallel, count_, 2048, sum);
}

}  // namespace kpsa::engine
#endif  // HWY_ONCE
