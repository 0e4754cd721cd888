// A step of rig_builder.cpp. A wire's `curve: lips` or `curves: [upper, lower]`: the rest curves as assets, and what
// moves them.
// Reads: those keys, and curves in the graph. Writes: values and connections in the graph.
#pragma once

#include "rig/build/made_nodes.h"

namespace kpsa::engine {

void ConnectCurves(const BuildInput& in, const MadeNodes& nodes, Graph* graph);

}  // namespace kpsa::engine
