// Inside of the rig builder: what nodes and overrides write for single plugs. Nothing outside rig/build includes this.
#pragma once

#include <map>
#include <vector>

#include "rig/build/build_input.h"
#include "rig/build/made_nodes.h"
#include "rig/build/plug_keys.h"

namespace kpsa::engine {

// Refers to its arguments. Values are set in the graph at once (others may depend on them, as lattice points on
// divisions); connections wait.
class PlugReader {
 public:
  // *returned: connections of overrides to what only the file knows that references this one.
  PlugReader(const BuildInput& in, std::vector<RigOverride>* returned, Graph* graph)
      : in_(in), returned_(returned), graph_(graph) {}

  // An attribute of a node, by any name of a plug; a list for a whole array is one value an element.
  void ReadAttribute(const MadeNode& made, const RigAttribute& attribute);
  // Sets the value, or notes the connection, that is written for one plug.
  void ReadPlug(const PlugRef& plug, const YamlNode& value, int source, bool overrides);
  // Notes that an override says what the plug holds, by a value or by a connection.
  void Override(const PlugRef& plug, bool by_value) {
    overridden_.plugs.emplace_back(plug, by_value);
    overridden_.keys.insert(KeyOf(plug));
  }

  // What was read: connections in the order of the file, and what overrides set or connect.
  const std::vector<PendingConnection>& pending() const { return pending_; }
  const OverriddenPlugs& overridden() const { return overridden_; }

 private:
  const BuildInput& in_;
  std::vector<RigOverride>* returned_;
  Graph* graph_;
  std::vector<PendingConnection> pending_;
  OverriddenPlugs overridden_;
  std::map<PlugKey, SourceLocation> written_[2];  // by nodes, by overrides: a plug has several spellings
  PlugKeys connected_;                            // of those, the ones that name another plug
};

}  // namespace kpsa::engine
