// A step of rig_builder.cpp. `driver` of deformers that follow another mesh at a stage of its stack, and of
// poseInterpolators.
// Reads: `driver` and `poses`, stages of meshes, the rest pose. Writes: values and connections in the graph.
#pragma once

#include "rig/build/rest_places.h"

namespace kpsa::engine {

void ConnectDrivers(const BuildInput& in, const MadeNodes& nodes, RestPose* rest, Graph* graph);

}  // namespace kpsa::engine
