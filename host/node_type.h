// Node types that functions of the program compute (kpsa/node_type.h), as the engine declares them.
#pragma once

#include <span>
#include <string>

#include "base/status.h"
#include "graph/graph.h"
#include "graph/node_registry.h"
#include "kpsa/node_type.h"

namespace kpsa::engine {

// The first node of a graph that is of such a type; "" if none.
std::string PrototypeNodeOf(const Graph& graph);
// The same of the nodes that these plugs come from.
std::string PrototypeNodeAbove(const Graph& graph, std::span<const PlugRef> plugs);

// Adds it to a registry of its own. Errors: no function, no output, a default of another size.
Status DeclareNode(const NodeType& type, NodeRegistry* registry);

}  // namespace kpsa::engine
