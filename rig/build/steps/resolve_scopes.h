// A step of rig_builder.cpp. Names within templates: what a template's own lines call `hand` is the node `arm_L:hand`
// (rig/file/templates.h).
// Reads: the scopes of the file's sources, and which nodes it writes. Writes: the texts of nodes, connections, stacks
// and controls.
#pragma once

#include "rig/build/rig_names.h"

namespace kpsa::engine {

void ResolveScopes(const RigNames& names, const NodeRegistry& registry, RigFile* file);

}  // namespace kpsa::engine
