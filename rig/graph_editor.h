// Edits of a graph by attribute name, several in a row; the first error stops the rest and is kept.
#pragma once

#include <string>
#include <string_view>
#include <utility>

#include "graph/graph.h"

namespace kpsa::engine {

class GraphEditor {
 public:
  explicit GraphEditor(Graph* graph) : graph_(graph) {}

  bool ok() const { return status_.ok(); }
  Status Take() { return std::move(status_); }
  bool Check(Status status) {
    if (ok() && !status.ok()) status_ = std::move(status);
    return ok();
  }

  // An invalid id after an error.
  NodeId Add(std::string_view type, std::string_view name) {
    if (!ok()) return NodeId();
    Result<NodeId> id = graph_->AddNode(type, name);
    Check(id.status());
    return id.ok() ? *id : NodeId();
  }
  // As Add; a name that is taken is made free by appending `suffix` once, then '#' as often as it takes.
  NodeId AddFresh(std::string_view type, std::string name, std::string_view suffix = "#") {
    if (!ok()) return NodeId();
    if (graph_->registry().Find(type) == nullptr) return Add(type, name);
    for (int tries = 0; tries < kMaxTries; ++tries) {
      Result<NodeId> id = graph_->AddNode(type, name);
      if (id.ok()) return *id;
      name += tries == 0 ? suffix : "#";
    }
    return Add(type, name);
  }
  bool Has(NodeId node, std::string_view attribute) const {
    return graph_->def(node).FindAttribute(attribute) >= 0;
  }
  // `element` is dropped where the attribute is no array.
  PlugRef Plug(NodeId node, std::string_view attribute, int element = -1, int component = -1) {
    if (!ok()) return PlugRef();
    const NodeDef& def = graph_->def(node);
    const int number = def.FindAttribute(attribute);
    if (number < 0) {
      Check(Status::Invalid("node type \"{}\" has no attribute \"{}\"", def.name, attribute));
      return PlugRef();
    }
    const AttributeDef& a = def.attributes[static_cast<std::size_t>(number)];
    return {node, number, a.array || IsPointType(a.type) ? element : -1, component};
  }
  void Set(NodeId node, std::string_view attribute, int element, Value value) {
    const PlugRef plug = Plug(node, attribute, element);
    if (ok()) Check(graph_->Set(plug, std::move(value)));
  }
  void Set(NodeId node, std::string_view attribute, Value value) {
    Set(node, attribute, -1, std::move(value));
  }
  void Connect(const PlugRef& source, const PlugRef& destination) {
    if (ok()) Check(graph_->Connect(source, destination));
  }

 private:
  static constexpr int kMaxTries = 1000;
  Graph* graph_;
  Status status_;
};

}  // namespace kpsa::engine
