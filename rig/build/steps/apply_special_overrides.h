// A step of rig_builder.cpp. Overrides of words that are no attributes replace them in the node before anything is
// read: `wire1.weights`, `lips.vertices`.
// Reads: `overrides`, and the deformers of the character's file. Writes: the attributes of the file's nodes, the keys
// of the character's own deformers; takes out of `overrides` what it applied.
#pragma once

#include "rig/build/made_nodes.h"

namespace kpsa::engine {

void ApplySpecialOverrides(const BuildInput& in, RigFile* file, OwnDeformers* own);

}  // namespace kpsa::engine
