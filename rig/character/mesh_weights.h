// Weights of a mesh's vertices as weight files: those of a deformer, and those of the skin, which has a map
// for each joint, named as the joint.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "base/status.h"
#include "rig/character/character_graph.h"
#include "files/weights_json.h"

namespace kpsa::engine {

// Whether a file names this mesh: as outputs do, as plugs do, or as the character does.
bool NamesMesh(const WeightFile& file, const gltf::Character& character, const Graph& graph,
               const CharacterMesh& mesh);

// One weight a point as a map of the mesh's vertices; what most of them have, 0 or 1, is the default.
WeightFile VertexWeights(const CharacterMesh& mesh, std::string map, const std::vector<float>& by_point);

// By joint of the mesh's influences, as plugs name them; primitives without influences follow the mesh node.
// An error where two joints have one name.
Result<std::vector<std::string>> InfluenceNames(const CharacterMesh& mesh, const Graph& graph);

// Influences of the mesh's points; joints that move nothing have no map.
Result<WeightFile> SkinWeights(const CharacterMesh& mesh, const Influences& influences, const Graph& graph);

// The influences that such a file gives the mesh's points. A welded point takes its vertices' mean; weights
// that do not sum up to 1 are divided by their sum. Within a point, joints that it had keep their order, so
// that a file as it was written gives the same bits. Errors (collected, at most 20): maps that are no joints,
// negative weights, vertices that no joint moves. The file is for this mesh and its number of vertices.
Result<std::shared_ptr<const Influences>> InfluencesFrom(const WeightFile& file, const CharacterMesh& mesh,
                                                         const Graph& graph);

}  // namespace kpsa::engine
