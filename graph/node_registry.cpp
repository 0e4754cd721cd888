#include "graph/node_registry.h"

#include "base/check.h"

namespace kpsa {

NodeRegistry::NodeRegistry() = default;

NodeBuilder NodeRegistry::add(std::string name, std::string doc) {
  KPSA_CHECK(defs_.find(name) == defs_.end());
  auto def = std::make_unique<NodeDef>();
  def->name = name;
  def->doc = std::move(doc);
  NodeDef* raw = def.get();
  defs_.emplace(std::move(name), std::move(def));
  return NodeBuilder(raw);
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
