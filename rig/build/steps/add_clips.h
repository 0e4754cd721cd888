// A step of rig_builder.cpp. Clips of the rig's own.
// Reads: `clips`, and the character's clips and nodes, by name. Writes: scene clips and layered.
#pragma once

#include "rig/build/build_input.h"

namespace kpsa::engine {

void AddClips(const BuildInput& in, CharacterGraph* scene);

}  // namespace kpsa::engine
