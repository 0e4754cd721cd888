// A step of rig_builder.cpp. Deformer stacks of meshes: points flow stage by stage. Before those of points attributes,
// as the box of a lattice, whose points may be deformed themselves, depends on its members.
// Reads: `deform` with `meshes`, and the file's own stages. Writes: stages of meshes in the scene, skins at rest
// (`restSkin`), connections and geometryMatrix in the graph, geometries of the nodes, notes.
#pragma once

#include <string>
#include <vector>

#include "rig/build/made_nodes.h"
#include "rig/character/rest_pose.h"

namespace kpsa::engine {

void BuildMeshStacks(const BuildInput& in, const RestPose& rest, MadeNodes* nodes, CharacterGraph* scene,
                     Graph* graph, std::vector<std::string>* notes);

}  // namespace kpsa::engine
