// A step of rig_builder.cpp. The frame of a deltaMush or tension in world space says only about which place it
// computes and how large the character is; where the rig names none, it is that which carries the mesh.
// Reads: geometries of the nodes, influences. Writes: connections in the graph.
#pragma once

#include "rig/build/made_nodes.h"
#include "rig/character/rest_pose.h"

namespace kpsa::engine {

void ConnectPivots(const BuildInput& in, const RestPose& rest, const MadeNodes& nodes, Graph* graph);

}  // namespace kpsa::engine
