// The adjacency of a mesh, built once per mesh and kept beside it.
#pragma once

#include "base/status.h"
#include "graph/geometry.h"
#include "nodes/kernels/topology.h"

namespace kpsa::engine {

// Null (with *error set) where the mesh has none: unset, or triangles out of range.
const Topology* TopologyOf(const Mesh* mesh, Status* error);

}  // namespace kpsa::engine
