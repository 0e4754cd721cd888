// Inside of the rig builder: plugs by what they are and not by how they are written, and what the file says of them.
// Nothing outside rig/build includes this.
#pragma once

#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "files/yaml_document.h"
#include "graph/graph.h"

namespace kpsa::engine {

using PlugKey = std::tuple<Index, int, int, int>;  // node, attribute, element, component
inline PlugKey KeyOf(const PlugRef& plug) {
  return {plug.node.index, plug.attribute, plug.element, plug.component};
}
using PlugKeys = std::set<PlugKey>;

// A connection to make when all nodes exist.
struct PendingConnection {
  std::string from;
  PlugRef to;
  SourceLocation where;
  int source;
  bool overrides = false;  // comes from overrides:
};

// What `overrides:` sets or connects.
struct OverriddenPlugs {
  std::vector<std::pair<PlugRef, bool>> plugs;  // plug; whether by a value
  PlugKeys keys;                                // the same

  // Whether an override sets or connects the plug, or what it is a part of.
  bool Contains(const PlugRef& plug) const {
    for (const int element : {plug.element, -1}) {
      for (const int component : {plug.component, -1}) {
        if (keys.count({plug.node.index, plug.attribute, element, component}) != 0) return true;
      }
    }
    return false;
  }
};

}  // namespace kpsa::engine
