// A last step (graph/last_step.h) of some tiles of a mesh, where only these need one: what is reconstructed of all other
// points are the points as they come out. Inner point i of a mesh of N points is point i, or of those tiles the step's
// own inner point i; behind these N stand the other inner points that the step reads for them, ascending.
//
// Moving and turning works as for the step itself; so does what its errors, threads and allocations are.
#pragma once

#include "graph/last_step.h"

namespace kpsa::engine {

// The points of some tiles (kTilePoints) of a mesh, ascending as the tiles are. Tiles beyond the mesh have none.
std::vector<Index> PointsOfTiles(std::span<const Index> tiles, std::size_t points);

// tiles: ascending, at least one, each with points of the step's mesh.
std::shared_ptr<const LastStep> MakePartialStep(std::shared_ptr<const LastStep> step,
                                                std::span<const Index> tiles);

}  // namespace kpsa::engine
