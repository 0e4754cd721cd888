// Name -> NodeDef. Passed around, never global. Filled at start by the standard nodes and by plugins;
// read-only and safe to share between threads afterwards.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "graph/node_builder.h"
#include "graph/node_def.h"

namespace kpsa {

class NodeRegistry {
 public:
  // Of a name that is added twice: a programmer's error, or noted in duplicates().
  enum class Duplicates { kRefuse, kCollect };
  explicit NodeRegistry(Duplicates duplicates = Duplicates::kRefuse);
  NodeRegistry(const NodeRegistry&) = delete;
  NodeRegistry& operator=(const NodeRegistry&) = delete;
  // Starts a new type; complete it through the builder.
  NodeBuilder add(std::string name, std::string doc);
  const NodeDef* Find(std::string_view name) const;  // null if there is none
  std::vector<std::string> Names() const;            // sorted
  const std::vector<std::string>& duplicates() const { return duplicates_; }
  // Moves all types of another registry here; no name may be in both. Pointers to definitions stay valid.
  void Take(NodeRegistry&& other);

 private:
  Duplicates on_duplicates_;
  std::map<std::string, std::unique_ptr<NodeDef>, std::less<>> defs_;
  std::vector<std::string> duplicates_;
  std::vector<std::unique_ptr<NodeDef>> refused_;  // what builders of duplicates write to
};

}  // namespace kpsa
