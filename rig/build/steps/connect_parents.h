// A step of rig_builder.cpp. `parent` of the rig's own nodes.
// Reads: that key. Writes: connections in the graph.
#pragma once

#include "rig/build/made_nodes.h"

namespace kpsa::engine {

void ConnectParents(const BuildInput& in, const MadeNodes& nodes, Graph* graph);

}  // namespace kpsa::engine
