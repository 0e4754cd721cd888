// How a file of node types becomes one of the standard ones. In nodes/sculpt.cpp, in kpsa::engine and at the
// beginning of a line:
//
//   KPSA_NODES(sculpt, registry) {
//     registry.add("sculpt", "...")...
//   }
//
// It says the name of its own file; another one does not link. The list of these files is made when the
// library is built (cmake/StandardNodes.cmake): no other file names them.
#pragma once

#include "graph/node_registry.h"

#define KPSA_NODES(file, registry) void AddNodesOf_##file(::kpsa::engine::NodeRegistry& registry)
