// Which points of a mesh go through a last step (kpsa/partial_step.h), where only some do, and in which order what is
// reconstructed stands: the points of a tile, and behind them the inner points that the step reads about them besides, so
// that a tile is of one place of the mesh.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "base/types.h"

namespace kpsa::engine {

struct SteppedPoints {
  std::vector<Index> points;  // ascending; empty: there is no choice
  // By tile, its first point. A tile has the points up to the next one's, a multiple of kStartsAt of them, and what is left
  // of it (kTilePoints) is for inner points. Empty, as in files of versions 12 to 15: points are those of whole tiles, and
  // inner points stand behind all points.
  std::vector<Index> starts;

  static constexpr std::size_t kStartsAt = 16;
  bool empty() const { return points.empty(); }
  bool Has(Index point) const;
  // Whether they count up, and starts are such, in a mesh of so many points.
  bool Fit(std::size_t points_of_mesh) const;
  std::size_t TileOf(Index point) const;
  // The points that a tile has, [begin, end).
  struct Range {
    Index begin, end;
  };
  Range PointsOf(std::size_t tile, std::size_t points_of_mesh) const;
  friend bool operator==(const SteppedPoints&, const SteppedPoints&) = default;
};

// The points of some tiles (kTilePoints) of a mesh, ascending as the tiles are. Tiles beyond the mesh have none.
std::vector<Index> PointsOfTiles(std::span<const Index> tiles, std::size_t points);
// The tiles that these points, ascending, are all points of; none where they are all points of none.
std::vector<Index> WholeTiles(std::span<const Index> points_of_tiles, std::size_t points);

}  // namespace kpsa::engine
