// Which part of a rig's graph is looked at, as users name it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "rig/build/rig_builder.h"

namespace kpsa::engine {

struct GraphPart {
  // Kinds of nodes that are left out: joints, transforms (joints are some), clips, or a type (unitConversion).
  std::vector<std::string> hide;
  std::optional<std::string>
      around;  // "NODE" or "NODE:N": what is within N connections of it (1), whatever their way
};

// By node index: what is not shown. What is hidden is no way to others either. Errors: a name that is none of these
// (the nearest one is named), a number of steps that is none.
Result<std::vector<bool>> HiddenNodes(const Rig& rig, const GraphPart& part);

}  // namespace kpsa::engine
