// What fuzzers do with a character or a rig that was read: compile all meshes, and evaluate them.
#pragma once

#include "graph/graph.h"
#include "graph/node_registry.h"
#include "rig/character/character_graph.h"

namespace kpsa::engine {

// The standard nodes.
const NodeRegistry& FuzzedRegistry();

// Compiles and evaluates the meshes of at most 20,000 points, at some times. Errors are fine; what comes out without
// one has as many points as the mesh.
void PlayMeshes(const Graph& graph, const CharacterGraph& scene, std::vector<PlugRef> varying);

}  // namespace kpsa::engine
