// A step of rig_builder.cpp. What no chosen variant sets exists all the same.
// Reads: `variants`, the graph. Writes: errors only.
#pragma once

#include "rig/build/made_nodes.h"

namespace kpsa::engine {

void CheckVariants(const BuildInput& in, const MadeNodes& nodes);

}  // namespace kpsa::engine
