// A step of rig_builder.cpp. Meshes of which a clip moves the file's own morph targets, and whose stack has a blendShape of
// the rig in their place that nothing drives: the clip moves nothing then.
// Reads: stages of meshes, connections of the graph, who is driven by clips. Writes: notes.
#pragma once

#include <string>
#include <vector>

#include "graph/graph.h"
#include "rig/character/character_graph.h"

namespace kpsa::engine {

void NoteLostWeights(const CharacterGraph& scene, const Graph& graph, std::vector<std::string>* notes);

}  // namespace kpsa::engine
