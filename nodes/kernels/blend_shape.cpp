#include "nodes/kernels/blend_shape.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "base/check.h"
#include "nodes/kernels/weights.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nodes/kernels/blend_shape.cpp"
#include "hwy/foreach_target.h"

#include "nodes/kernels/xyzw-inl.h"

HWY_BEFORE_NAMESPACE();
namespace kpsa::engine {
namespace HWY_NAMESPACE {

// out += weight * deltas, in the lanes that a tile has
void AddTiles(const BlendShapeKernel::Tile* tiles, const float* deltas, std::size_t count, float weight,
              PointsView out) {
  const DLanes d;
  const VLanes w = hn::Set(d, weight);
  for (std::size_t t = 0; t < count; ++t, deltas += 48) {
    for (std::size_t i = 0; i < 16; i += hn::Lanes(d)) {
      const std::uint64_t bits = tiles[t].lanes >> i;
      std::uint8_t bytes[8];
      std::memcpy(bytes, &bits, 8);
      const auto has = hn::LoadMaskBits(d, bytes);
      const std::size_t p = tiles[t].first_point + i;
      const VLanes x = hn::Load(d, out.x + p), y = hn::Load(d, out.y + p), z = hn::Load(d, out.z + p);
      hn::Store(hn::IfThenElse(has, Fma(w, hn::Load(d, deltas + i), x), x), d, out.x + p);
      hn::Store(hn::IfThenElse(has, Fma(w, hn::Load(d, deltas + 16 + i), y), y), d, out.y + p);
      hn::Store(hn::IfThenElse(has, Fma(w, hn::Load(d, deltas + 32 + i), z), z), d, out.z + p);
    }
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace kpsa::engine
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace kpsa::engine {

HWY_EXPORT(AddTiles);

Status BlendShapeTargets::Validate() const {
  for (std::size_t k = 0; k < targets.size(); ++k) {
    const BlendTarget& target = targets[k];
    if (target.deltas.size() != 3 * target.points.size()) {
      return Status::Invalid("blend shape target {} has {} points and {} delta numbers, expected 3 a point",
                             k, target.points.size(), target.deltas.size());
    }
    if (!IsSortedSet(target.points, point_count)) {
      return Status::Invalid("blend shape target {}: expected ascending points below {}", k, point_count);
    }
    for (std::size_t i = 0; i < target.deltas.size(); ++i) {
      if (!std::isfinite(target.deltas[i])) {
        return Status::Invalid("blend shape target {}: the delta of point {} is not a finite number", k,
                               target.points[i / 3]);
      }
    }
  }
  return {};
}

BlendShapeKernel::BlendShapeKernel(const BlendShapeTargets& targets, std::span<const Index> out_points,
                                   std::span<const float> point_weights)
    : count_(out_points.size()) {
  KPSA_CHECK(IsSortedSet(out_points, targets.point_count));
  KPSA_CHECK(point_weights.empty() || point_weights.size() == count_);
  std::vector<float> deltas;
  for (const BlendTarget& target : targets.targets) {
    first_tile_.push_back(static_cast<Index>(tiles_.size()));
    // Walk both sorted lists at once; a short list of outputs searches in the target instead of reading all
    // of it
    const bool search = out_points.size() * 16 < target.points.size();
    std::size_t at = 0;
    for (std::size_t i = 0; i < count_; ++i) {
      if (search) {
        at =
            static_cast<std::size_t>(std::lower_bound(target.points.begin() + static_cast<std::ptrdiff_t>(at),
                                                      target.points.end(), out_points[i]) -
                                     target.points.begin());
      } else {
        while (at < target.points.size() && target.points[at] < out_points[i]) ++at;
      }
      if (at == target.points.size()) break;
      if (target.points[at] != out_points[i]) continue;
      const float w = point_weights.empty() ? 1.0f : point_weights[i];
      const float delta[3] = {w * target.deltas[3 * at], w * target.deltas[3 * at + 1],
                              w * target.deltas[3 * at + 2]};
      if (delta[0] == 0 && delta[1] == 0 && delta[2] == 0) continue;
      const Index first_point = static_cast<Index>(i / kTile * kTile);
      if (tiles_.size() == first_tile_.back() || tiles_.back().first_point != first_point) {
        tiles_.push_back({first_point, 0});
        deltas.resize(deltas.size() + 3 * kTile, 0.0f);
      }
      tiles_.back().lanes |= 1u << (i - first_point);
      float* to = deltas.data() + 3 * kTile * (tiles_.size() - 1) + (i - first_point);
      for (std::size_t c = 0; c < 3; ++c) to[kTile * c] = delta[c];
    }
  }
  first_tile_.push_back(static_cast<Index>(tiles_.size()));
  deltas_ = AlignedFloats(deltas.size());
  std::copy(deltas.begin(), deltas.end(), deltas_.data());

  const std::size_t blocks = (count_ + kBlock - 1) / kBlock;
  for (std::size_t k = 0; k < target_count(); ++k) {
    Index tile = first_tile_[k];
    for (std::size_t b = 0; b <= blocks; ++b) {
      while (tile < first_tile_[k + 1] && tiles_[tile].first_point < b * kBlock) ++tile;
      block_tiles_.push_back(tile);
    }
  }
}

void BlendShapeKernel::Run(const Inputs& inputs, ConstPointsView in, PointsView out, std::span<float> scratch,
                           const Parallel* parallel) const noexcept {
  KPSA_CHECK_EQ(inputs.weights.size(), target_count());
  KPSA_CHECK_EQ(in.count, count_);
  KPSA_CHECK_EQ(out.count, count_);
  KPSA_CHECK_LE(ScratchFloats(), scratch.size());
  for (std::size_t k = 0; k < target_count(); ++k) {
    scratch[k] = static_cast<float>(inputs.weights[k] * inputs.envelope);
  }
  const std::size_t blocks = (count_ + kBlock - 1) / kBlock;
  ForRanges(parallel, blocks, 4, [&](std::size_t first, std::size_t last) {
    const auto add_tiles = HWY_DYNAMIC_DISPATCH(AddTiles);
    for (std::size_t b = first; b < last; ++b) {
      const std::size_t begin = b * kBlock, size = std::min(kBlock, count_ - begin);
      CopyPoints({in.x + begin, in.y + begin, in.z + begin, size},
                 {out.x + begin, out.y + begin, out.z + begin, size});
      for (std::size_t k = 0; k < target_count(); ++k) {
        if (scratch[k] == 0) continue;
        const Index* tile = block_tiles_.data() + k * (blocks + 1) + b;
        if (tile[0] == tile[1]) continue;
        add_tiles(tiles_.data() + tile[0], deltas_.data() + 3 * kTile * tile[0], tile[1] - tile[0],
                  scratch[k], out);
      }
    }
  });
}

}  // namespace kpsa::engine
#endif  // HWY_ONCE
