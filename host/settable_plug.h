// Plugs that a scene or a page sets while a rig plays.
#pragma once

#include "base/status.h"
#include "graph/graph.h"

namespace kpsa::engine {

// What drives the plug, a part of it, or what it is a part of; null if nothing does.
const Connection* DriverOf(const Graph& graph, const PlugRef& plug);
// Errors: an output, what is read when a rig is loaded, what is more than one number, what is driven.
Status CheckSettable(const Graph& graph, const PlugRef& plug);
// A number in runtime units as the plug takes it: a whole one where it takes no other. Errors: a number that it does not take.
Result<Value> ValueOf(const Graph& graph, const PlugRef& plug, double number);

}  // namespace kpsa::engine
