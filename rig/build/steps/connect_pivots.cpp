#include "rig/build/steps/connect_pivots.h"

#include <vector>

#include "base/matrix.h"
#include "rig/graph_editor.h"

namespace kpsa::engine {
namespace {

// The deepest glTF node above all joints that move the deformer's meshes (and above meshes without a skin),
// that is not scaled to nothing at rest.
std::optional<NodeId> CommonAncestor(const BuildInput& in, const RestPose& rest, const MadeNode& made) {
  const gltf::Character& character = *in.rig.character;
  std::vector<bool> carries(character.nodes.size(), false);
  for (const DeformedGeometry& geometry : made.geometries) {
    if (!geometry.mesh.has_value()) continue;
    const CharacterMesh& mesh = in.rig.scene.meshes[*geometry.mesh];
    if (mesh.influences == nullptr) {
      carries[mesh.gltf_node] = true;
      continue;
    }
    for (std::size_t i = 0; i < mesh.influences->joints().size(); ++i) {
      if (mesh.influences->weights()[i] > 0)
        carries[in.names.GltfNode(mesh.influence_nodes[mesh.influences->joints()[i]])] = true;
    }
  }
  std::vector<std::size_t> below(carries.size(), 0);  // carriers at a node and below it
  std::size_t total = 0;
  for (auto it = character.order.rbegin(); it != character.order.rend(); ++it) {  // children first
    if (carries[*it]) ++below[*it], ++total;
    const Index parent = character.nodes[*it].parent;
    if (parent != kNoIndex) below[parent] += below[*it];
  }
  std::optional<NodeId> deepest;
  for (Index node : character.order) {  // parents first: the last one is the deepest
    Matrix4 inverse;
    if (total > 0 && below[node] == total && Invert(rest.NodeWorld(node), &inverse))
      deepest = in.rig.scene.transforms[node];
  }
  return deepest;
}

}  // namespace

void ConnectPivots(const BuildInput& in, const RestPose& rest, const MadeNodes& nodes, Graph* graph) {
  for (const MadeNode& made : nodes) {
    const std::string& type = graph->def(made.id).name;
    if ((type != "deltaMush" && type != "tension") || !made.world || made.geometries.empty()) continue;
    GraphEditor edit(graph);
    const PlugRef parent = edit.Plug(made.id, "parentMatrix");
    if (!edit.ok() || graph->FindValue(parent) != nullptr || graph->FindConnection(parent) != nullptr)
      continue;
    const std::optional<NodeId> ancestor = CommonAncestor(in, rest, made);
    // A transform that depends on the points cannot carry them
    if (ancestor.has_value()) (void)graph->Connect(edit.Plug(*ancestor, "worldMatrix"), parent).ok();
  }
}

}  // namespace kpsa::engine
