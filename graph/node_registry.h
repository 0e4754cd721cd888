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
  NodeRegistry();
  NodeRegistry(const NodeRegistry&) = delete;
  NodeRegistry& operator=(const NodeRegistry&) = delete;
  // Starts a new type; complete it through the builder. A name that exists is a programmer's error.
  NodeBuilder add(std::string name, std::string doc);
  const NodeDef* Find(std::string_view name) const;  // null if there is none
  std::vector<std::string> Names() const;            // sorted

 private:
  std::map<std::string, std::unique_ptr<NodeDef>, std::less<>> defs_;
};

}  // namespace kpsa
