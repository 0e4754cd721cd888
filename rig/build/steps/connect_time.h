// A step of rig_builder.cpp. What remembers its previous frame follows the scene's time, unless the rig gives it
// another one.
// Reads: values and connections that are set. Writes: connections in the graph.
#pragma once

#include "rig/build/made_nodes.h"

namespace kpsa::engine {

void ConnectTime(const BuildInput& in, const MadeNodes& nodes, Graph* graph);

}  // namespace kpsa::engine
