// Name -> NodeDef. Passed around, never global. Filled at start by the standard nodes, and by plugins whenever
// they come in. Safe to share between threads: types may be added while others look theirs up; a type that is
// completed by a builder is looked up after that. Plans and evaluators never come here.
#pragma once

#include <map>
#include <memory>
#include <shared_mutex>
#include <string>
#include <string_view>
#include <vector>

#include "graph/node_builder.h"
#include "graph/node_def.h"

namespace kpsa::engine {

class NodeRegistry {
 public:
  NodeRegistry() = default;
  NodeRegistry(const NodeRegistry&) = delete;
  NodeRegistry& operator=(const NodeRegistry&) = delete;
  // Starts a new type; complete it through the builder. A name that is taken is a problem, see status().
  NodeBuilder add(std::string name, std::string doc);
  const NodeDef* Find(std::string_view name) const;  // null if there is none
  std::vector<std::string> Names() const;            // sorted
  // What is wrong with the declarations of all types, each problem an error. While it is not ok, no graph
  // takes nodes of this registry: a wrong declaration would be read as memory of another type.
  Status status() const;
  // Moves all types of another registry here, with what is wrong with them; a name that is in both is a
  // problem. Pointers to definitions stay valid.
  void Take(NodeRegistry&& other);

 private:
  mutable std::shared_mutex mutex_;  // of what follows
  std::map<std::string, std::unique_ptr<NodeDef>, std::less<>> defs_;
  std::vector<std::unique_ptr<NodeDef>> duplicates_;  // of names that were taken
};

}  // namespace kpsa::engine
