// The nodes that a rig's points need, and what acceleration makes of each.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "graph/graph.h"
#include "graph/plan.h"
#include "host/acceleration.h"

namespace kpsa::engine {

struct OutlinedNode {
  enum class State {
    kKept,         // runs on a hit
    kCuesOnly,     // runs on a hit, for points that cues need alone
    kNeverRun,     // only a miss needs it
    kSwitchedOff,  // an envelope or a condition keeps it from running
  };
  std::string name, type;
  State state = State::kKept;
  Index points = 0;  // of a full evaluation; 0 for nodes without points
  std::vector<std::size_t>
      inputs;          // indices into the outline, ascending; nodes that are not listed are passed by
  std::string reason;  // in words
};
const char* StateName(OutlinedNode::State state);  // "kept", "cues only", "never run", "switched off"

// Those of the plan; of `accelerated`, where there is one, and those of `full` that it has not. Constant nodes and
// those that nothing needs are left out. No node is upstream of itself by `inputs`. `graph`: of the rig with the
// subspaces in place, or the rig itself.
std::vector<OutlinedNode> OutlineNodes(const Graph& graph, const Plan& full, const Plan* accelerated,
                                       const std::vector<AppliedSubspace>& applied);

}  // namespace kpsa::engine
