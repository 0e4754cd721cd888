// The node types that every rig may use: those of the files in this folder (nodes/node_file.h). `kpsa nodes` lists
// them.
#pragma once

#include "graph/node_registry.h"

namespace kpsa::engine {

// Written by cmake/StandardNodes.cmake when the library is built.
void AddStandardNodes(NodeRegistry& registry);

}  // namespace kpsa::engine
