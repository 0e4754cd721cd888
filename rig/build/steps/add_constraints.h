// A step of rig_builder.cpp. Constraints and IK of a rig file: `constrained`, `targets`, `start`, `mid`, `end`.
// Reads: those keys, parents in the graph. Writes: connections and values (parents, inMatrix) in
// the graph, through `plugs` what these take over.
#pragma once

#include "rig/build/constrained_plugs.h"

namespace kpsa::engine {

void AddConstraints(const BuildInput& in, const MadeNodes& nodes, ConstrainedPlugs* plugs, Graph* graph);

}  // namespace kpsa::engine
