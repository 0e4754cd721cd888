// What a plug has to be to be posed: as a control of a rig, or by training where clips alone move it.
#pragma once

#include "graph/graph.h"
#include "rig/character/character_graph.h"

namespace kpsa::engine {

// The value of a number, or of a component, that a rig set or its attribute has.
double RestValueOf(const Graph& graph, const PlugRef& plug);
// What drives the plug, or all three of it, and is no clip; null where nothing does.
const Connection* DriverBesidesClips(const CharacterGraph& scene, const Graph& graph, const PlugRef& plug);

}  // namespace kpsa::engine
