// Inside of the rig builder: how a constraint takes over a plug. Nothing outside rig/build includes this.
#pragma once

#include <map>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "rig/build/made_nodes.h"
#include "rig/build/plug_keys.h"

namespace kpsa::engine {

// What the constraints of a rig own. A constraint owns the offsetParentMatrix of what it constrains; what drove that
// before, clips included, becomes its input. Refers to its arguments; all functions return false after an error.
class ConstrainedPlugs {
 public:
  struct Written {
    std::unordered_map<Index, PlugRef>*
        clip_inputs;               // of the scene: by transform, where clips drive it from now on
    PlugKeys* stacked;             // what constraints drive
    std::vector<PlugRef>* pinned;  // inputs of constraints that clips leave alone
    Graph* graph;
  };
  ConstrainedPlugs(const BuildInput& in, const OverriddenPlugs& overridden, Written to)
      : in_(in), overridden_(overridden), to_(to) {}

  // `by` takes over what drives or holds `plug`.
  bool TakeOver(const PlugRef& plug, const MadeNode& by, const PlugRef& in, const PlugRef& out,
                const SourceLocation& where);
  // The same of a transform; `element` is one of the constraint's arrays.
  bool Constrain(NodeId transform, const MadeNode& by, const char* in_name, const char* out_name, int element,
                 const SourceLocation& where);
  // The parent of what is constrained; of chains, of their first joint.
  bool ConnectParentOf(NodeId transform, const MadeNode& by, const SourceLocation& where) const;

 private:
  bool IsUnwritten(const PlugRef& plug) const;

  const BuildInput& in_;
  const OverriddenPlugs& overridden_;
  Written to_;
  std::map<PlugKey, std::pair<std::string, SourceLocation>> constrained_;  // which constraint does so where
};

}  // namespace kpsa::engine
