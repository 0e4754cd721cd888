// A step of rig_builder.cpp. The targets of each mesh that a blend shape of the rig deforms; one that a mesh lacks
// moves none of its points.
// Reads: what `targets` are, geometries of the nodes. Writes: targets in the graph, notes.
#pragma once

#include "rig/build/target_shapes.h"

namespace kpsa::engine {

void SetTargets(const BuildInput& in, const MadeNodes& nodes, const TargetShapes& shapes, Graph* graph,
                std::vector<std::string>* notes);

}  // namespace kpsa::engine
