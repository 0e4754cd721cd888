#include "rig/build/steps/add_nodes.h"

#include <algorithm>

#include "rig/build/type_names.h"

namespace kpsa::engine {
namespace {

// Words of stacks: no node may be called so.
constexpr const char* kStackWords[] = {"gltf", "morph", "skin", "restSkin", "transform"};

}  // namespace

void AddNodes(const BuildInput& in, MadeNodes* nodes, std::map<std::string, SourceLocation>* places,
              Graph* graph) {
  for (const RigNode& node : in.file.nodes) {
    if (in.errors->full()) return;
    if (std::find(std::begin(kStackWords), std::end(kStackWords), node.name) != std::end(kStackWords)) {
      in.Fail(node.where,
              Status::Invalid("\"{}\" is a word of stacks: give the node another name", node.name));
      continue;
    }
    if (graph->registry().Find(node.type) == nullptr) {
      in.errors->Add(node.type_node, "unknown node type \"{}\"{}", node.type,
                     SuggestType(node.type, graph->registry()));
      continue;
    }
    Result<NodeId> id = graph->AddNode(node.type, node.name);
    if (!in.Fail(node.where, id.status())) continue;
    nodes->Add(node, *id);
    (*places)[node.name] = node.where;
  }
}

}  // namespace kpsa::engine
