// A step of rig_builder.cpp. Deformer stacks of points attributes, as those of lattices and curves.
// Reads: `deform` with `points`, cvs at rest, weights of meshes (SetWeights) and their points at rest, for the boxes of
// lattices, and their world_from_stage. Writes: values and connections in the
// graph, geometries of the nodes; *stacked: the attributes that a stack drives.
#pragma once

#include "rig/build/lattice_box.h"
#include "rig/build/plug_keys.h"

namespace kpsa::engine {

void BuildPointStacks(const BuildInput& in, const RestCurves& curves, RestPose* rest, MadeNodes* nodes,
                      PlugKeys* stacked, Graph* graph);

}  // namespace kpsa::engine
