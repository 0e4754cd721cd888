#include "kpsa/patches.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "base/median.h"
#include "kpsa/tiles.h"

namespace kpsa::engine {
namespace {

constexpr double kBorder = 3;              // typical distances of neighbours
constexpr std::size_t kFewestOfLevel = 3;  // regions; fewer would be most of an output each

// The median distance of points to the nearest other one of the same tile. Of neighbours by x only those are looked
// at that may be nearer.
double TypicalDistance(std::span<const Double3> tile) {
  std::vector<Double3> by_x(tile.begin(), tile.end());
  std::erase_if(by_x, [](const Double3& p) { return !std::isfinite(Dot(p, p)); });
  std::ranges::sort(by_x, {}, &Double3::x);
  std::vector<double> nearest;
  for (std::size_t i = 0; i < by_x.size(); ++i) {
    double least = std::numeric_limits<double>::infinity();
    const auto is_beyond = [&](const Double3& other) {
      const Double3 d = by_x[i] - other;
      if (d.x * d.x > least) return true;
      if (Dot(d, d) > 0) least = std::min(least, Dot(d, d));
      return false;
    };
    for (std::size_t j = i + 1; j < by_x.size() && !is_beyond(by_x[j]);) ++j;
    for (std::size_t j = i; j-- > 0 && !is_beyond(by_x[j]);) {
    }
    if (std::isfinite(least)) nearest.push_back(std::sqrt(least));
  }
  if (nearest.empty()) return 0;
  return UpperMedian(std::move(nearest));
}

// Points by their x and the box around them, so that near ones are found without looking at all of them.
struct ByX {
  std::vector<std::pair<double, Index>> points;
  Double3 lo, hi;
  ByX(std::span<const Double3> positions, Index first, Index count) {
    for (Index i = first; i < first + count; ++i) {
      const Double3& p = positions[i];
      if (!std::isfinite(Dot(p, p))) continue;
      if (points.empty()) lo = hi = p;
      lo = {std::min(lo.x, p.x), std::min(lo.y, p.y), std::min(lo.z, p.z)};
      hi = {std::max(hi.x, p.x), std::max(hi.y, p.y), std::max(hi.z, p.z)};
      points.emplace_back(p.x, i);
    }
    std::sort(points.begin(), points.end());
  }
  // False where no point can be nearer than that; also for what is no number.
  bool MayBeNear(const Double3& at, double within) const {
    return !points.empty() && at.x > lo.x - within && at.x < hi.x + within && at.y > lo.y - within &&
           at.y < hi.y + within && at.z > lo.z - within && at.z < hi.z + within;
  }
  // Distance to the nearest one, at most `within`.
  double Nearest(std::span<const Double3> positions, const Double3& at, double within) const {
    double least = within * within;
    const auto is_beyond = [&](const std::pair<double, Index>& point) {
      const Double3 d = positions[point.second] - at;
      if (d.x * d.x > least) return true;
      least = std::min(least, Dot(d, d));
      return false;
    };
    const auto from = std::lower_bound(points.begin(), points.end(), std::pair(at.x, Index{0}));
    for (auto it = from; it != points.end() && !is_beyond(*it);) ++it;
    for (auto it = from; it != points.begin() && !is_beyond(*std::prev(it));) --it;
    return std::sqrt(least);
  }
};

}  // namespace

PatchLayout MakePatchLayout(std::span<const std::size_t> tiles_of_outputs) {
  PatchLayout layout;
  std::size_t all = 0;
  for (const std::size_t tiles : tiles_of_outputs) all += tiles;
  if (all < kFewestTiles || tiles_of_outputs.size() > kMaxPatches) return layout;
  do {
    ++layout.tiles;
    layout.regions.clear();
    layout.patches = 0;
    for (std::size_t m = 0; m < tiles_of_outputs.size(); ++m) {
      std::size_t count = (tiles_of_outputs[m] + layout.tiles - 1) / layout.tiles;
      const auto output = static_cast<Index>(m), first = static_cast<Index>(layout.patches);
      layout.patches += count;
      const auto end = static_cast<Index>(layout.patches);
      for (Index p = first; p < end; ++p) layout.regions.push_back({output, p, 1, 0, kNoIndex, 0});
      for (Index level = 1, below = static_cast<Index>(layout.regions.size() - count);; ++level) {
        const Index belows = static_cast<Index>(count);
        count = (count + 1) / 2;
        if (count < kFewestOfLevel || layout.regions.size() > kMaxRegions) break;
        const Index next = static_cast<Index>(layout.regions.size());
        for (Index r = 0; r < count; ++r) {
          const Index begin = first + (r << level), of = std::min<Index>(2, belows - 2 * r);
          layout.regions.push_back(
              {output, begin, std::min<Index>(Index{1} << level, end - begin), level, below + 2 * r, of});
        }
        below = next;
      }
      for (std::size_t r = layout.regions.size(); r-- > 0 && layout.regions[r].output == output;)
        layout.regions[r].top = layout.regions[r].level == layout.regions.back().level;
    }
  } while (layout.regions.size() > kMaxRegions);
  return layout;
}

std::vector<PatchPoints> MakePatches(std::span<const std::vector<Double3>> positions,
                                     std::size_t tiles_of_patch) {
  std::vector<PatchPoints> patches;
  for (std::size_t m = 0; m < positions.size(); ++m) {
    const std::span<const Double3> of(positions[m]);
    const auto total = static_cast<Index>(of.size()), size = static_cast<Index>(tiles_of_patch * kTilePoints);
    for (Index first = 0; first < total; first += size) {
      PatchPoints& patch = patches.emplace_back();
      patch.output = static_cast<Index>(m);
      const Index count = std::min(size, total - first);
      double border = 0;
      for (Index tile = first; tile < first + count; tile += kTilePoints)
        border = std::max(border, kBorder * TypicalDistance(of.subspan(
                                                tile, std::min<Index>(kTilePoints, first + count - tile))));
      const ByX own(of, first, count);
      for (Index i = 0; i < total; ++i) {
        double weight = i >= first && i < first + count ? 1 : 0;
        if (weight == 0 && border > 0 && own.MayBeNear(of[i], border))
          weight = 1 - Smoothstep(own.Nearest(of, of[i], border) / border);
        if (!(weight > 0)) continue;
        patch.points.push_back(i);
        patch.weights.push_back(static_cast<float>(weight));
      }
    }
  }
  return patches;
}

std::vector<Index> PointsOfRegion(const PatchRegion& region, std::span<const PatchPoints> patches) {
  std::vector<Index> points;
  for (const PatchPoints& patch : patches.subspan(region.first, region.count))
    points.insert(points.end(), patch.points.begin(), patch.points.end());
  std::sort(points.begin(), points.end());
  points.erase(std::unique(points.begin(), points.end()), points.end());
  return points;
}

void ChooseRegions(const PatchLayout& layout, double all, PatchChoice* choice) {
  double sum = 0;
  std::array<double, kMaxRegions> least;         // what the patches of a region cost
  std::array<std::uint64_t, kMaxRegions> cover;  // and by which regions
  choice->cost = 0;
  choice->regions = 0;
  for (std::size_t r = 0; r < layout.regions.size(); ++r) {
    const PatchRegion& region = layout.regions[r];
    if (region.level == 0) {
      const float weight = choice->weights[region.first];
      sum += static_cast<double>(weight);
      least[r] = weight > 0 ? layout.costs[r] : 0;
      cover[r] = weight > 0 ? std::uint64_t{1} << r : 0;
    } else {
      least[r] = 0, cover[r] = 0;
      for (Index i = region.below; i < region.below + region.belows; ++i) {
        least[r] += least[i], cover[r] |= cover[i];
      }
      if (least[r] > layout.costs[r]) least[r] = layout.costs[r], cover[r] = std::uint64_t{1} << r;
    }
    if (region.top) choice->cost += least[r], choice->regions |= cover[r];
  }
  choice->mean = layout.patches == 0 ? 0 : sum / static_cast<double>(layout.patches);
  choice->all = std::max(all, WholeWeight(choice->mean));
  choice->full = choice->all > 0 || choice->cost > kMostOfFull;
  if (choice->full) choice->cost = 1, choice->regions = 0;
}

}  // namespace kpsa::engine
