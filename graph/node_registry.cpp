#include "graph/node_registry.h"

#include "base/check.h"

namespace kpsa {

NodeRegistry::NodeRegistry(Duplicates duplicates) : on_duplicates_(duplicates) {}

NodeBuilder NodeRegistry::add(std::string name, std::string doc) {
  auto def = std::make_unique<NodeDef>();
  def->name = name;
  def->doc = std::move(doc);
  NodeDef* raw = def.get();
  if (defs_.find(name) != defs_.end()) {
    KPSA_CHECK(on_duplicates_ == Duplicates::kCollect);
    duplicates_.push_back(std::move(name));
    refused_.push_back(std::move(def));
    return NodeBuilder(raw);
  }
  defs_.emplace(std::move(name), std::move(def));
  return NodeBuilder(raw);
}

void NodeRegistry::Take(NodeRegistry&& other) {
  for (const auto& [name, def] : other.defs_) KPSA_CHECK(defs_.find(name) == defs_.end());
  defs_.merge(other.defs_);
}

const NodeDef* NodeRegistry::Find(std::string_view name) const {
  const auto it = defs_.find(name);
  return it == defs_.end() ? nullptr : it->second.get();
}

std::vector<std::string> NodeRegistry::Names() const {
  std::vector<std::string> names;
  for (const auto& [name, def] : defs_) names.push_back(name);
  return names;
}

}  // namespace kpsa
