#include "rig/build/steps/connect_parents.h"

#include "rig/graph_editor.h"

namespace kpsa::engine {

void ConnectParents(const BuildInput& in, const MadeNodes& nodes, Graph* graph) {
  for (const MadeNode& made : nodes) {
    const RigAttribute* key = made.Find("parent");
    if (key == nullptr || in.errors->full()) continue;
    std::string name;
    if (!ReadString(key->value, "parent", &name, in.errors)) continue;
    const std::optional<NodeId> parent = in.names.FindTransform(name, key->value.where());
    if (!parent.has_value()) continue;
    GraphEditor edit(graph);
    edit.Connect(edit.Plug(*parent, "worldMatrix"), edit.Plug(made.id, "parentMatrix"));
    in.Fail(key->value.where(), edit.Take());
  }
}

}  // namespace kpsa::engine
