// A last step (graph/last_step.h) of some points of a mesh, where only these need one: what is reconstructed of all other
// points are the points as they come out. Its inner points are, tile after tile, the points of the tile as they come out,
// or of those points the step's own inner points, and then the other inner points that the step reads about them; what is
// left of a tile repeats its first point (kpsa/stepped_points.h).
//
// Moving and turning works as for the step itself; so does what its errors, threads and allocations are.
#pragma once

#include "graph/last_step.h"
#include "kpsa/stepped_points.h"

namespace kpsa::engine {

// As many points in each tile as there is room for beside what the step reads about them. points: of the step's mesh,
// ascending, at least one.
SteppedPoints LayOut(const LastStep& step, std::vector<Index> points);

// stepped: fits the step's mesh. Null where what the step reads has no room there.
std::shared_ptr<const LastStep> MakePartialStep(std::shared_ptr<const LastStep> step,
                                                const SteppedPoints& stepped);

}  // namespace kpsa::engine
