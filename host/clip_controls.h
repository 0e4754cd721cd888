// What the clips of a character move that its rig has no control for.
#pragma once

#include <vector>

#include "kpsa/training/poses.h"
#include "rig/build/rig_builder.h"

namespace kpsa::engine {

// The morph weights and the rotations, translations and scales of transforms that the character's clips move and nothing
// else drives, each with the range that it has in all of them (kpsa init would name these as controls).
std::vector<ControlRange> ControlsOfClips(const Rig& rig);

}  // namespace kpsa::engine
