// Keys of a node in a rig file that its definition does not declare, but that mean something for its kind.
#pragma once

#include <string_view>
#include <vector>

#include "graph/node_def.h"

namespace kpsa::engine {

struct RigWord {
  const char* name;
  const char* doc;
};

// Those that a node of the type may have.
std::vector<RigWord> RigWordsOf(const NodeDef& def);
bool IsRigWord(const NodeDef& def, std::string_view key);
// Whether it deforms geometries: stacks may name it.
bool IsDeformer(const NodeDef& def);

}  // namespace kpsa::engine
