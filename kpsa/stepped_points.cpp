#include "kpsa/stepped_points.h"

#include <algorithm>
#include <functional>

#include "kpsa/tiles.h"

namespace kpsa::engine {

bool SteppedPoints::Has(Index point) const { return std::ranges::binary_search(points, point); }

bool SteppedPoints::Fit(std::size_t points_of_mesh) const {
  const auto counts_up = [&](const std::vector<Index>& list) {
    return std::ranges::adjacent_find(list, std::greater_equal()) == list.end() &&
           (list.empty() || list.back() < points_of_mesh);
  };
  if (!counts_up(points) || !counts_up(starts) || (points.empty() && !starts.empty())) return false;
  if (starts.empty()) return points.empty() || !WholeTiles(points, points_of_mesh).empty();
  for (std::size_t t = 0; t < starts.size(); ++t) {
    const Range of = PointsOf(t, points_of_mesh);
    if (of.begin % kStartsAt != 0 || of.end <= of.begin || of.end - of.begin > kTilePoints) return false;
  }
  return starts[0] == 0;
}

std::size_t SteppedPoints::TileOf(Index point) const {
  if (starts.empty()) return point / kTilePoints;
  return static_cast<std::size_t>(std::ranges::upper_bound(starts, point) - starts.begin()) - 1;
}

SteppedPoints::Range SteppedPoints::PointsOf(std::size_t tile, std::size_t points_of_mesh) const {
  const auto all = static_cast<Index>(points_of_mesh);
  if (!starts.empty()) return {starts[tile], tile + 1 < starts.size() ? starts[tile + 1] : all};
  const auto begin = static_cast<Index>(tile * kTilePoints);
  return {std::min(begin, all), std::min(begin + static_cast<Index>(kTilePoints), all)};
}

std::vector<Index> PointsOfTiles(std::span<const Index> tiles, std::size_t points) {
  std::vector<Index> found;
  for (const Index tile : tiles) {
    const std::size_t first = std::size_t{tile} * kTilePoints, end = std::min(points, first + kTilePoints);
    for (std::size_t i = first; i < end; ++i) found.push_back(static_cast<Index>(i));
  }
  return found;
}

std::vector<Index> WholeTiles(std::span<const Index> points_of_tiles, std::size_t points) {
  std::vector<Index> tiles;
  for (const Index point : points_of_tiles) {
    const auto tile = static_cast<Index>(point / kTilePoints);
    if (tiles.empty() || tiles.back() != tile) tiles.push_back(tile);
  }
  if (!std::ranges::equal(PointsOfTiles(tiles, points), points_of_tiles)) tiles.clear();
  return tiles;
}

}  // namespace kpsa::engine
