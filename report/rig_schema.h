// A JSON Schema (draft 2020-12) of rig files, for editors and checkers: the sections of the format, and of
// every node type in the registry the attributes and words that may be written, with types, ranges, choices
// and docs. What it accepts is a little more than the reader does (names and plugs are only strings).
#pragma once

#include <string>

#include "graph/node_registry.h"

namespace kpsa::engine {

std::string RigSchema(const NodeRegistry& registry);

}  // namespace kpsa::engine
