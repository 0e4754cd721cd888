// A step of rig_builder.cpp. How stages before a skin lie in the world at rest. Their points are in mesh space, their
// handles, curves and boxes in the world: world_from_stage says what is where, as the skin carries the deformer's
// members at rest.
// Reads: the weights that are set, the rest pose. Writes: world_from_stage of the nodes' geometries, geometryMatrix in
// the graph.
#pragma once

#include "rig/build/made_nodes.h"
#include "rig/character/rest_pose.h"

namespace kpsa::engine {

void PlaceStages(const BuildInput& in, RestPose* rest, MadeNodes* nodes, Graph* graph);

}  // namespace kpsa::engine
