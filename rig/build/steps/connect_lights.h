// A step of rig_builder.cpp. What an illumination sees: `meshes`, `carried`, `camera` and `lights` of a rig's node, by
// their names.
// Reads: those keys, the last stages of meshes. Writes: values and connections in the graph.
#pragma once

#include "rig/build/made_nodes.h"

namespace kpsa::engine {

void ConnectLights(const BuildInput& in, const MadeNodes& nodes, Graph* graph);

}  // namespace kpsa::engine
