#include "graph/node_registry.h"

#include <mutex>

namespace kpsa::engine {

NodeBuilder NodeRegistry::add(std::string name, std::string doc) {
  auto def = std::make_unique<NodeDef>();
  def->name = name;
  def->doc = std::move(doc);
  NodeDef* raw = def.get();
  const std::unique_lock<std::shared_mutex> lock(mutex_);
  if (const auto [at, added] = defs_.try_emplace(std::move(name), nullptr); added) {
    at->second = std::move(def);
  } else {
    duplicates_.push_back(std::move(def));
  }
  return NodeBuilder(raw);
}

Status NodeRegistry::status() const {
  Status status;
  const std::shared_lock<std::shared_mutex> lock(mutex_);
  for (const auto& [name, def] : defs_) {
    for (const std::string& problem : def->Problems()) status.Append(Status::Invalid("{}", problem));
  }
  for (const auto& def : duplicates_)
    status.Append(
        Status::Invalid("node type \"{}\" is registered twice; expected each name once", def->name));
  return status;
}

void NodeRegistry::Take(NodeRegistry&& other) {
  const std::unique_lock<std::shared_mutex> lock(mutex_);
  defs_.merge(other.defs_);
  for (auto& [name, def] : other.defs_)
    duplicates_.push_back(std::move(def));  // the names that stayed behind
  for (auto& def : other.duplicates_) duplicates_.push_back(std::move(def));
  other.defs_.clear();
  other.duplicates_.clear();
}

const NodeDef* NodeRegistry::Find(std::string_view name) const {
  const std::shared_lock<std::shared_mutex> lock(mutex_);
  const auto it = defs_.find(name);
  return it == defs_.end() ? nullptr : it->second.get();
}

std::vector<std::string> NodeRegistry::Names() const {
  std::vector<std::string> names;
  const std::shared_lock<std::shared_mutex> lock(mutex_);
  for (const auto& [name, def] : defs_) names.push_back(name);
  return names;
}

}  // namespace kpsa::engine
