// A step of rig_builder.cpp. The nodes of the file.
// Reads: `nodes`. Writes: the nodes in the graph, without values, and where they are written.
#pragma once

#include <map>
#include <string>

#include "rig/build/made_nodes.h"

namespace kpsa::engine {

void AddNodes(const BuildInput& in, MadeNodes* nodes, std::map<std::string, SourceLocation>* places,
              Graph* graph);

}  // namespace kpsa::engine
