#include "kpsa/patches.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "base/median.h"
#include "kpsa/point_blocks.h"
#include "kpsa/stepped_points.h"
#include "kpsa/tiles.h"

namespace kpsa::engine {
namespace {

constexpr double kBorder = 3;              // typical distances of neighbours
constexpr std::size_t kFewestOfLevel = 3;  // regions; fewer would be most of an output each

constexpr std::size_t kBlocksOfTile = kTilePoints / PointBlocks::kSize;
static_assert(kTilePoints % PointBlocks::kSize == 0 && SteppedPoints::kStartsAt % PointBlocks::kSize == 0,
              "a block is of one tile");

// The median distance of points of some blocks to the nearest other one of these.
double TypicalDistance(const PointBlocks& blocks, std::size_t first, std::size_t end) {
  std::vector<std::uint32_t> all(end - first);
  std::iota(all.begin(), all.end(), static_cast<std::uint32_t>(first));
  std::vector<double> nearest;  // squared
  for (std::size_t block = first; block < end; ++block) {
    PointBlocks::Distances least;
    least.fill(PointBox::kFar);
    blocks.NearestApart(all, block, &least);
    for (std::size_t i = 0; i < PointBlocks::kSize; ++i) {
      if (blocks.IsSomewhere(block * PointBlocks::kSize + i) && least[i] < PointBox::kFar)
        nearest.push_back(least[i]);
    }
  }
  return nearest.empty() ? 0 : std::sqrt(UpperMedian(std::move(nearest)));
}

// Makes a patch of some blocks in a row, of an output of `total` points.
class PatchMaker {
 public:
  PatchMaker(PointBlocks* blocks, std::size_t total) : blocks_(*blocks), total_(total) {}

  // In other blocks points take the less, the farther they are from those of the patch, and nothing beyond the border.
  void Make(std::size_t first, std::size_t count, double border, PatchPoints* patch) {
    PointBox own;
    for (std::size_t b = first; b < first + count; ++b) own.Add(blocks_.box(b));
    blocks_.FindNear(own, 0, blocks_.size(), border * border, &around_);
    std::size_t next = 0;
    const auto add_others = [&](std::size_t end) {
      for (; next < around_.size() && around_[next] < end; ++next) {
        blocks_.FindNear(blocks_.box(around_[next]), first, count, border * border, &near_);
        if (!near_.empty()) AddNear(around_[next], border, patch);
      }
    };
    add_others(first);
    for (std::size_t i = first * PointBlocks::kSize; i < EndOf(first + count - 1); ++i) Add(i, 1, patch);
    while (next < around_.size() && around_[next] < first + count) ++next;
    add_others(blocks_.size());
  }

 private:
  std::size_t EndOf(std::size_t block) const { return std::min((block + 1) * PointBlocks::kSize, total_); }
  static void Add(std::size_t point, double weight, PatchPoints* patch) {
    patch->points.push_back(static_cast<Index>(point));
    patch->weights.push_back(static_cast<float>(weight));
  }
  void AddNear(std::size_t block, double border, PatchPoints* patch) {
    const double beyond = border * border;
    PointBlocks::Distances least;  // squared
    least.fill(beyond);
    blocks_.Nearest(near_, block, &least);
    const std::size_t begin = block * PointBlocks::kSize;
    for (std::size_t i = begin; i < EndOf(block); ++i) {
      if (!(least[i - begin] < beyond && blocks_.IsSomewhere(i))) continue;
      const double weight = 1 - Smoothstep(std::sqrt(least[i - begin]) / border);
      if (weight > 0) Add(i, weight, patch);
    }
  }

  PointBlocks& blocks_;
  std::size_t total_;
  std::vector<std::uint32_t> around_, near_;
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

std::vector<PatchPoints> MakePatches(std::span<const PlacedOutput> outputs, std::size_t tiles_of_patch) {
  std::vector<PatchPoints> patches;
  for (std::size_t m = 0; m < outputs.size(); ++m) {
    const std::span<const Index> starts = outputs[m].starts;
    const std::size_t points = outputs[m].positions.size();
    PointBlocks blocks(outputs[m].positions);
    PatchMaker maker(&blocks, points);
    const std::size_t tiles = starts.empty() ? (points + kTilePoints - 1) / kTilePoints : starts.size();
    const auto first_of = [&](std::size_t tile) {
      return tile >= tiles    ? blocks.size()
             : starts.empty() ? tile * kBlocksOfTile
                              : starts[tile] / PointBlocks::kSize;
    };
    for (std::size_t tile = 0; tile < tiles; tile += tiles_of_patch) {
      const std::size_t end = std::min(tile + tiles_of_patch, tiles);
      double border = 0;
      for (std::size_t t = tile; t < end; ++t)
        border = std::max(border, kBorder * TypicalDistance(blocks, first_of(t), first_of(t + 1)));
      patches.emplace_back().output = static_cast<Index>(m);
      maker.Make(first_of(tile), first_of(end) - first_of(tile), border, &patches.back());
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
