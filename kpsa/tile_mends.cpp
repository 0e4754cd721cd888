#include "kpsa/tile_mends.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "base/check.h"
#include "kpsa/rigid_points.h"
#include "kpsa/scratch_points.h"

namespace kpsa::engine {
namespace {

bool CountsUp(std::span<const Index> numbers) {
  return std::ranges::adjacent_find(numbers, std::greater_equal()) == numbers.end();
}
bool AllFinite(std::span<const float> values) {
  return std::ranges::all_of(values, [](float value) { return std::isfinite(value); });
}

constexpr std::size_t kTogether = 16;

// Some rows of the map, each in the order of the cues.
template <std::size_t kRows>
void Sum(const TileMend& mend, std::span<const std::uint32_t> cues, const float* y, std::size_t first,
         float* to) {
  float sum[kRows];
  std::copy_n(mend.mean.data() + first, kRows, sum);
  const float* map = mend.map.data() + first;
  for (const std::uint32_t cue : cues) {
    const float value = y[cue];
    for (std::size_t r = 0; r < kRows; ++r) sum[r] += value * map[r];
    map += mend.mean.size();
  }
  std::copy_n(sum, kRows, to);
}

}  // namespace

Status CheckMends(std::span<const TileMend> mends, std::span<const TileMap> tiles) {
  if (mends.size() > kMaxMends)
    return Status::Invalid("{} tiles are mended, expected at most {}", mends.size(), kMaxMends);
  for (const TileMend& mend : mends) {
    if (mend.output >= tiles.size() || mend.tile >= tiles[mend.output].tiles())
      return Status::Invalid("tile {} of output {} is mended, which there is not", mend.tile, mend.output);
    const TileMap& of = tiles[mend.output];
    const std::size_t first = mend.tile * kTilePoints, end = std::min(of.points(), first + kTilePoints);
    if (mend.points.empty() || !CountsUp(mend.points) || mend.points.front() < first ||
        mend.points.back() >= end || !CountsUp(mend.inner) || of.data().components != 3)
      return Status::Invalid(
          "the {} mended points of tile {}, or the {} points before them, do not count up in it",
          mend.points.size(), mend.tile, mend.inner.size());
    const std::size_t rows = 3 * mend.inner.size();
    if (mend.mean.size() != rows || mend.map.size() != rows * of.data().counts[mend.tile] ||
        !AllFinite(mend.mean) || !AllFinite(mend.map))
      return Status::Invalid(
          "the map of the mended points of tile {} has {} and {} numbers, or some are not finite", mend.tile,
          mend.mean.size(), mend.map.size());
  }
  return {};
}

BoundMends::BoundMends(std::span<const TileMend> mends, const TileMap& tiles, Index output,
                       const PointSet& wanted, const LastStep& step)
    : inner_points_(step.inner_points()) {
  KPSA_CHECK_EQ(tiles.points(), step.points());
  for (const TileMend& mend : mends) {
    if (mend.output != output) continue;
    Part part{&mend, nullptr, {}};
    std::vector<Index> points;
    for (const Index point : mend.points) {
      if (wanted.Contains(point)) points.push_back(point);
    }
    if (points.empty()) continue;
    const PointSet some = PointSet::Of(points, wanted.total());
    part.places = wanted.PositionsOf(some);
    part.step = step.Bind(some);
    KPSA_CHECK(std::ranges::includes(mend.inner, part.step->inner()));
    scratch_ = std::max(scratch_, FloatsOf(mend.inner.size()) + FloatsOf(inner_points_) +
                                      FloatsOf(points.size()) + part.step->scratch_floats());
    parts_.push_back(std::move(part));
  }
}

void BoundMends::Run(const TileMap& tiles, const float* y, const Matrix4* world_from_space, PointsView out,
                     std::span<float> scratch) const {
  for (const Part& part : parts_) {
    const TileMend& mend = *part.mend;
    const std::size_t count = mend.inner.size(), rows = 3 * count;
    float* const packed = scratch.data();  // [3 inner], then as a view
    const std::span<const std::uint32_t> cues = tiles.CuesOf(mend.tile);
    std::size_t first = 0;
    for (; first + kTogether <= rows; first += kTogether)
      Sum<kTogether>(mend, cues, y, first, packed + first);
    for (; first < rows; ++first) Sum<1>(mend, cues, y, first, packed + first);
    std::span<float> rest = scratch.subspan(FloatsOf(count));
    const PointsView inner = ViewOf(rest, inner_points_);
    rest = rest.subspan(FloatsOf(inner_points_));
    Matrix4 joint;
    const bool moved = tiles.JointOf(mend.tile, y, &joint);
    const FloatMatrix m = ToFloats(joint);
    for (std::size_t i = 0; i < count; ++i) {
      float p[3] = {packed[i], packed[count + i], packed[2 * count + i]};
      if (moved) {
        const float x = p[0], v = p[1], z = p[2];
        for (std::size_t a = 0; a < 3; ++a) p[a] = m[a] * x + (m[3 + a] * v + (m[6 + a] * z + m[9 + a]));
      }
      inner.x[mend.inner[i]] = p[0], inner.y[mend.inner[i]] = p[1], inner.z[mend.inner[i]] = p[2];
    }
    const PointsView made = ViewOf(rest, part.places.size());
    part.step->Run(inner, made, rest.subspan(FloatsOf(made.count)));
    if (world_from_space != nullptr) TransformPoints(ToFloats(*world_from_space), made);
    for (std::size_t k = 0; k < made.count; ++k) {
      const Index at = part.places[k];
      out.x[at] = made.x[k], out.y[at] = made.y[k], out.z[at] = made.z[k];
    }
  }
}

}  // namespace kpsa::engine
