#include "host/graph_part.h"

#include <algorithm>
#include <charconv>
#include <set>

namespace kpsa::engine {
namespace {

constexpr int kMostSteps = 1000;

// The middle of a neighbourhood and its radius. A node's own name may hold a colon.
Status ReadAround(const Graph& graph, const std::string& text, NodeId* node, int* steps) {
  *steps = 1;
  Result<NodeId> whole = graph.FindNode(text);
  const std::size_t colon = text.rfind(':');
  if (whole.ok() || colon == std::string::npos) {
    if (whole.ok()) *node = *whole;
    return whole.status();
  }
  const char* const end = text.data() + text.size();
  const auto [last, error] = std::from_chars(text.data() + colon + 1, end, *steps);
  if (error != std::errc() || last != end) return whole.status();  // a colon of the name
  if (*steps < 0 || *steps > kMostSteps)
    return Status::Usage("expected 0 to {} steps, found {}", kMostSteps, *steps);
  const Result<NodeId> before = graph.FindNode(text.substr(0, colon));
  if (before.ok()) *node = *before;
  return before.status();
}

Status Hide(const Rig& rig, const std::string& kind, std::vector<bool>* hidden) {
  const Graph& graph = *rig.graph;
  const gltf::Character& character = *rig.character;
  if (kind == "joints") {
    for (const gltf::Skin& skin : character.skins) {
      for (Index joint : skin.joints) (*hidden)[rig.scene.transforms[joint].index] = true;
    }
    return Status();
  }
  if (kind == "clips") {
    for (NodeId node : rig.scene.clip_nodes) (*hidden)[node.index] = true;
    return Status();
  }
  const std::string type = kind == "transforms" ? "transform" : kind;
  std::set<std::string> types;
  for (NodeId node : graph.Nodes()) {
    types.insert(graph.def(node).name);
    if (graph.def(node).name == type) (*hidden)[node.index] = true;
  }
  if (types.count(type) != 0 || type == "transform" || graph.registry().Find(type) != nullptr)
    return Status();
  std::vector<std::string> kinds = {"joints", "transforms", "clips"};
  kinds.insert(kinds.end(), types.begin(), types.end());
  return Status::Usage("\"{}\": expected joints, transforms, clips or a node type{}", kind,
                       DidYouMean(kind, kinds));
}

}  // namespace

Result<std::vector<bool>> HiddenNodes(const Rig& rig, const GraphPart& part) {
  const Graph& graph = *rig.graph;
  std::vector<bool> hidden(graph.node_capacity());
  for (const std::string& kind : part.hide) KPSA_RETURN_IF_ERROR(Hide(rig, kind, &hidden).At({"hide"}));
  if (!part.around.has_value()) return hidden;
  NodeId middle;
  int steps = 1;
  KPSA_RETURN_IF_ERROR(ReadAround(graph, *part.around, &middle, &steps).At({"around"}));
  std::vector<bool> reached(hidden.size());
  reached[middle.index] = true;
  hidden[middle.index] = false;
  std::vector<NodeId> rim = {middle};
  for (int step = 0; step < steps && !rim.empty(); ++step) {
    std::vector<NodeId> next;
    const auto reach = [&](NodeId node) {
      if (reached[node.index] || hidden[node.index]) return;
      reached[node.index] = true;
      next.push_back(node);
    };
    for (NodeId node : rim) {
      for (const Connection& c : graph.Inputs(node)) reach(c.source.node);
      for (const Connection& c : graph.Outputs(node)) reach(c.destination.node);
    }
    rim = std::move(next);
  }
  for (std::size_t i = 0; i < hidden.size(); ++i) hidden[i] = !reached[i];
  return hidden;
}

}  // namespace kpsa::engine
