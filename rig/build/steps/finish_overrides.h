// A step of rig_builder.cpp. An overriding value also ends what drives the plug; a stack or a constraint takes it as
// its input.
// Reads: what is overridden, what stacks and constraints drive. Writes: connections in the graph, plugs that clips
// leave alone.
#pragma once

#include <vector>

#include "rig/build/build_input.h"
#include "rig/build/plug_keys.h"

namespace kpsa::engine {

void FinishOverrides(const BuildInput& in, const OverriddenPlugs& overridden, const PlugKeys& stacked,
                     std::vector<PlugRef>* pinned, Graph* graph);

}  // namespace kpsa::engine
