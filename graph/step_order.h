// The compiler's third pass: which steps run in place as one unit, and in what order. Internal to graph/.
#pragma once

#include <vector>

#include "graph/plan_draft.h"

namespace kpsa::engine {

struct StepOrder {
  struct Unit {
    std::vector<Index> steps;  // draft steps, in the order in which they run
    Index level = 0;           // within its segment
  };
  // By segment: units by level. Levels ascend from 0.
  std::vector<std::vector<Unit>> segments;
  std::vector<Index>
      overwrites;  // by draft step: the draft step whose buffer its first output takes over, or kNoIndex
};

// Chains of deformers that nobody else reads become units that share one buffer. Small copies for other
// readers (gathers) run between their members, before the buffer is overwritten.
StepOrder OrderSteps(const InstanceTable& table, const PlanDraft& draft);

}  // namespace kpsa::engine
