// A step of rig_builder.cpp. What animators and training may move.
// Reads: `controls`, what drives plugs in the graph. Writes: the rig's controls, after those of references.
#pragma once

#include <vector>

#include "rig/build/build_input.h"

namespace kpsa::engine {

void AddControls(const BuildInput& in, std::vector<Control>* controls);

}  // namespace kpsa::engine
