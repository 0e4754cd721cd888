// Tiles of two maps in one, and which tiles two maps share. Internal to training.
#pragma once

#include <span>
#include <vector>

#include "kpsa/tiles.h"

namespace kpsa::engine {

// Of the same points, with as many inputs: the tiles that are taken (a flag each) from `others`, the rest as
// `map` has them, byte for byte.
TileMap SpliceTiles(const TileMap& map, const TileMap& others, std::span<const char> taken);

// By tile: whether both maps store it by the same bytes, and in the same joint. What the rows of y are called
// is not compared: rows that nobody reads any more leave the others with new numbers.
std::vector<char> SameTiles(const TileMap& a, const TileMap& b);

}  // namespace kpsa::engine
