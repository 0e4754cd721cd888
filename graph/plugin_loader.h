// Loads libraries of nodes (graph/plugin.h) into a registry. One loader a registry, by any thread; libraries stay
// loaded until the program ends.
#pragma once

#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "base/status.h"
#include "graph/node_registry.h"

namespace kpsa::engine {

class PluginLoader {
 public:
  explicit PluginLoader(NodeRegistry* registry) : registry_(registry) {}

  // Adds the node types of the library at `path`; relative paths start at the current folder. A library that
  // was loaded before is passed over. Errors, after which the registry is as it was: no such file, one that
  // the system cannot load (its words are in the message), one that does not export kpsa_plugin_abi and
  // kpsa_register, another ABI version, a node type without a name or a name that exists, an exception.
  Status Load(const std::string& path);
  // From here on libraries that were not loaded before are refused, with that reason.
  void RefuseOthers(std::string reason);
  // Adds types that the program itself has made, all or none. Errors: what is wrong with their declarations, a
  // name that exists.
  Status Add(NodeRegistry&& added);

 private:
  // `of`: whose the types are, as messages begin with it; "" for the program's own.
  Status Add(NodeRegistry&& added, const std::string& of);

  NodeRegistry* registry_;
  std::mutex mutex_;                           // of what follows, and of adding
  std::vector<std::string> loaded_;            // canonical paths
  std::string refusal_;                        // of all others; "" where they are loaded
  std::map<std::string, std::string> origin_;  // node type -> the library that brought it, or ""
};

}  // namespace kpsa::engine
