// From a mesh's points to the vertices of its file.
#pragma once

#include "base/points.h"
#include "graph/geometry.h"

namespace kpsa::engine {

// x y z of the vertices [first, first + count), in the file's order, to `xyz`.
void Interleave(const Mesh& mesh, ConstPointsView points, Index first, Index count, float* xyz);

}  // namespace kpsa::engine
