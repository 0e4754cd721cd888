// Graph::Absorb: one graph into another.
#include "base/check.h"
#include "graph/graph.h"

namespace kpsa::engine {

Result<Index> Graph::Absorb(Graph other, std::string_view prefix) {
  KPSA_CHECK(other.registry_ == registry_);
  const std::string begin(prefix);
  for (const Node& node : other.nodes_) {
    const std::string name = begin + node.name;
    if (node.def != nullptr && (by_name_.count(name) != 0 || by_alias_.count(name) != 0))
      return Status::Invalid("a node named \"{}\" exists already", name);
  }
  const auto offset = static_cast<Index>(nodes_.size());
  const auto move = [&](Connection* connection) {
    connection->source.node.index += offset;
    connection->destination.node.index += offset;
  };
  nodes_.reserve(nodes_.size() + other.nodes_.size());
  for (Node& node : other.nodes_) {
    const auto index = static_cast<Index>(nodes_.size());
    for (Connection& connection : node.inputs) move(&connection);
    for (Connection& connection : node.outputs) move(&connection);
    for (SetValue& set : node.values) set.plug.node.index += offset;
    for (auto* kept : {&node.unposed, &node.written}) {
      for (auto& [attribute, values] : *kept) {
        for (SetValue& set : values) set.plug.node.index += offset;
      }
    }
    for (NodeId& delegate : node.delegates) delegate.index += offset;
    if (node.def != nullptr) {
      node.name.insert(0, begin);
      by_name_.emplace(node.name, index);
      for (std::string& alias : node.aliases) {
        alias.insert(0, begin);
        by_alias_[alias].push_back(index);
      }
    }
    nodes_.push_back(std::move(node));
  }
  return offset;
}

}  // namespace kpsa::engine
