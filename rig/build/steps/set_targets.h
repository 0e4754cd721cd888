// A step of rig_builder.cpp. The targets of each mesh that a blend shape of the rig deforms; one that a mesh lacks
// moves none of its points.
// Reads: `targets`, geometries of the nodes. Writes: targets in the graph.
#pragma once

#include "rig/build/made_nodes.h"

namespace kpsa::engine {

void SetTargets(const BuildInput& in, const MadeNodes& nodes, Graph* graph);

}  // namespace kpsa::engine
