// What a step of a plan reads and writes, by position, so that computes which do so by position can be held against
// it, and told by name what they asked for wrongly. Internal to graph/.
#pragma once

#include <stdexcept>
#include <string>
#include <vector>

#include "graph/node_def.h"

namespace kpsa::engine {

struct StepShape {
  struct Slot {
    std::string name;
    Type type = Type::kDouble;
    bool array = false;  // for one step
  };
  std::vector<Slot> inputs, outputs;

  static StepShape Of(const NodeDef& def, const ComputeGroup& group);
  // Throws a std::logic_error that says what a compute asked for, and what there is.
  void Check(const SlotAccess& access) const;
};

// An element that an array of a step has not; `table` is where its slots stand.
struct NoElement : std::out_of_range {
  NoElement(const std::uint32_t* where, std::uint32_t asked);
  const std::uint32_t* table;
  std::uint32_t element;
};

// ThrownText of what a step's function threw, with the name of the array whose element there is not. In a catch block
// only; `shape`: null where the step is of no node.
std::string ThrownByStep(const StepShape* shape, const ComputeContext& context);

}  // namespace kpsa::engine
