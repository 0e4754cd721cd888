#include "rig/build/steps/note_double_moves.h"

#include <algorithm>

namespace kpsa::engine {
namespace {

// By node of the graph: whether the driver's points depend on it.
std::vector<bool> UpstreamOfDriver(const Graph& graph, NodeId wrap) {
  std::vector<bool> upstream(graph.node_capacity(), false);
  std::vector<NodeId> open;
  const auto add = [&](const Connection& connection) {
    const NodeId source = connection.source.node;
    if (!upstream[source.index]) open.push_back(source);
    upstream[source.index] = true;
  };
  for (const Connection& driver : graph.Inputs(wrap, graph.def(wrap).FindAttribute("driverPoints")))
    add(driver);
  while (!open.empty()) {
    const NodeId node = open.back();
    open.pop_back();
    for (const Connection& input : graph.Inputs(node)) add(input);
  }
  return upstream;
}

bool Follows(const NodeDef& def) { return def.name == "wrap" || def.name == "proximityWrap"; }

}  // namespace

void NoteDoubleMoves(const BuildInput& in, const MadeNodes& nodes, std::vector<std::string>* notes) {
  if (!in.errors->ok()) return;
  for (const RigDeform& deform : in.file.deform) {
    const auto skin = std::find_if(deform.stack.begin(), deform.stack.end(), [](const RigString& item) {
      return item.text == "skin" || item.text == "gltf";
    });
    for (auto item = skin; item != deform.stack.end(); ++item) {
      const MadeNode* made = nodes.Find(item->text);
      if (made == nullptr || !Follows(in.graph().def(made->id)) || made->Find("parent") != nullptr) continue;
      const std::vector<bool> upstream = UpstreamOfDriver(in.graph(), made->id);
      for (const RigString& name : deform.meshes) {
        const std::optional<std::size_t> index = in.names.FindMesh(name.text, name.where);
        if (!index.has_value()) continue;
        const CharacterMesh& mesh = in.rig.scene.meshes[*index];
        const bool twice = std::any_of(mesh.influence_nodes.begin(), mesh.influence_nodes.end(),
                                       [&](NodeId joint) { return upstream[joint.index]; });
        if (!twice) continue;
        notes->push_back(fmt::format(
            "{}: the joints of \"{}\" move it twice: by its {}, and by \"{}\" ({}), whose driver they "
            "move, too. Write restSkin instead, or put \"{}\" before the skin and let it follow a stage "
            "of its driver before that one's skin (driver: \"MESH@STAGE\"), or name what carries both as its "
            "parent",
            skin->where.ToString(), mesh.name, skin->text, made->from->name, made->from->where.ToString(),
            made->from->name));
      }
    }
  }
}

}  // namespace kpsa::engine
