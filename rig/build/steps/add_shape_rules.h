// A step of rig_builder.cpp. Combinations and in-betweens of blend shapes, on the rig's own nodes and on the file's.
// Reads: `combinations` and `inbetweens` of both, and the names of their targets. Writes: nodes and connections in the
// graph.
#pragma once

#include "rig/build/made_nodes.h"

namespace kpsa::engine {

void AddShapeRules(const BuildInput& in, const MadeNodes& nodes, const OwnDeformers& own, Graph* graph);

}  // namespace kpsa::engine
