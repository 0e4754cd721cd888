#include "kpsa/point_blocks.h"

#include <algorithm>
#include <cmath>

#include "base/matrix.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kpsa/point_blocks.cpp"
#include "hwy/foreach_target.h"

#include "base/simd-inl.h"

HWY_BEFORE_NAMESPACE();
namespace kpsa::engine {
namespace HWY_NAMESPACE {

constexpr std::size_t kVectors = 2;  // of points at once

// Makes `least` the smallest of itself and the squared distances of points x, y, z to those of some blocks. apart: of
// distances above 0.
template <bool kApart>
void NearestOfVectors(const double* HWY_RESTRICT x, const double* HWY_RESTRICT y,
                      const double* HWY_RESTRICT z, std::span<const std::uint32_t> blocks, std::size_t first,
                      double* HWY_RESTRICT least) {
  const hn::CappedTag<double, PointBlocks::kSize / kVectors> d;
  const auto zero = hn::Zero(d), far = hn::Set(d, PointBox::kFar);
  using V = hn::Vec<decltype(d)>;
  V at_x[kVectors], at_y[kVectors], at_z[kVectors], nearest[kVectors];
#pragma GCC unroll 4
  for (std::size_t v = 0; v < kVectors; ++v) {
    const std::size_t i = v * hn::Lanes(d);
    at_x[v] = hn::LoadU(d, x + first + i), at_y[v] = hn::LoadU(d, y + first + i);
    at_z[v] = hn::LoadU(d, z + first + i), nearest[v] = hn::LoadU(d, least + i);
  }
  for (const std::size_t block : blocks) {
    for (std::size_t j = block * PointBlocks::kSize; j < (block + 1) * PointBlocks::kSize; ++j) {
      const V of_x = hn::Set(d, x[j]), of_y = hn::Set(d, y[j]), of_z = hn::Set(d, z[j]);
#pragma GCC unroll 4
      for (std::size_t v = 0; v < kVectors; ++v) {
        const V dx = hn::Sub(at_x[v], of_x), dy = hn::Sub(at_y[v], of_y), dz = hn::Sub(at_z[v], of_z);
        V squared = hn::Add(hn::Add(hn::Mul(dx, dx), hn::Mul(dy, dy)), hn::Mul(dz, dz));
        if constexpr (kApart) squared = hn::IfThenElse(hn::Gt(squared, zero), squared, far);
        nearest[v] = hn::Min(squared, nearest[v]);
      }
    }
  }
#pragma GCC unroll 4
  for (std::size_t v = 0; v < kVectors; ++v) hn::StoreU(nearest[v], d, least + v * hn::Lanes(d));
}

// Of the points of a block, `least` [kSize].
void NearestOfBlock(const double* x, const double* y, const double* z, std::span<const std::uint32_t> blocks,
                    std::size_t block, bool apart, double* least) {
  const hn::CappedTag<double, PointBlocks::kSize / kVectors> d;
  for (std::size_t i = 0; i < PointBlocks::kSize; i += kVectors * hn::Lanes(d)) {
    const std::size_t first = block * PointBlocks::kSize + i;
    if (apart) {
      NearestOfVectors<true>(x, y, z, blocks, first, least + i);
    } else {
      NearestOfVectors<false>(x, y, z, blocks, first, least + i);
    }
  }
}

// Of boxes, six lists one after the other, to one.
void SquaredDistances(const double* HWY_RESTRICT boxes, std::size_t stride, std::size_t first,
                      std::size_t count, const PointBox& box, double* HWY_RESTRICT squared) {
  const hn::CappedTag<double, 8> d;
  const double lo[3] = {box.lo.x, box.lo.y, box.lo.z}, hi[3] = {box.hi.x, box.hi.y, box.hi.z};
  for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
    auto sum = hn::Zero(d);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double* const of = boxes + 2 * axis * stride + first + i;
      const auto below = hn::Sub(hn::LoadU(d, of), hn::Set(d, hi[axis])),
                 above = hn::Sub(hn::Set(d, lo[axis]), hn::LoadU(d, of + stride));
      const auto apart = hn::Max(hn::Max(below, above), hn::Zero(d));
      sum = hn::Add(sum, hn::Mul(apart, apart));
    }
    hn::StoreU(sum, d, squared + i);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace kpsa::engine
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace kpsa::engine {

HWY_EXPORT(NearestOfBlock);
HWY_EXPORT(SquaredDistances);

void PointBox::Add(const PointBox& other) {
  lo = {std::min(lo.x, other.lo.x), std::min(lo.y, other.lo.y), std::min(lo.z, other.lo.z)};
  hi = {std::max(hi.x, other.hi.x), std::max(hi.y, other.hi.y), std::max(hi.z, other.hi.z)};
}

PointBlocks::PointBlocks(std::span<const Double3> points) : boxes_((points.size() + kSize - 1) / kSize) {
  for (auto* of : {&x_, &y_, &z_}) of->assign(size() * kSize, PointBox::kFar);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Double3& p = points[i];
    if (!std::isfinite(Dot(p, p))) continue;
    x_[i] = p.x, y_[i] = p.y, z_[i] = p.z;
    boxes_[i / kSize].Add({p, p});
  }
  stride_ = size() + kMostLanes;
  bounds_.assign(6 * stride_, PointBox::kFar);
  for (std::size_t b = 0; b < size(); ++b) {
    const PointBox& box = boxes_[b];
    const double bounds[6] = {box.lo.x, box.hi.x, box.lo.y, box.hi.y, box.lo.z, box.hi.z};
    for (std::size_t i = 0; i < 6; ++i) bounds_[i * stride_ + b] = bounds[i];
  }
}

void PointBlocks::FindNear(const PointBox& box, std::size_t first, std::size_t count, double squared,
                           std::vector<std::uint32_t>* near) {
  squared_.resize(count + kMostLanes);
  HWY_DYNAMIC_DISPATCH(SquaredDistances)(bounds_.data(), stride_, first, count, box, squared_.data());
  near->resize(count);
  std::size_t found = 0;  // without a branch that no processor foresees
  for (std::size_t i = 0; i < count; ++i) {
    (*near)[found] = static_cast<std::uint32_t>(first + i);
    found += squared_[i] < squared ? 1 : 0;
  }
  near->resize(found);
}

void PointBlocks::Nearest(std::span<const std::uint32_t> blocks, std::size_t block, Distances* least) const {
  HWY_DYNAMIC_DISPATCH(NearestOfBlock)(x_.data(), y_.data(), z_.data(), blocks, block, false, least->data());
}

void PointBlocks::NearestApart(std::span<const std::uint32_t> blocks, std::size_t block,
                               Distances* least) const {
  HWY_DYNAMIC_DISPATCH(NearestOfBlock)(x_.data(), y_.data(), z_.data(), blocks, block, true, least->data());
}

}  // namespace kpsa::engine
#endif  // HWY_ONCE
