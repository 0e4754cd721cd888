// What the clips of an `accelerate:` entry move that the rig has no control for.
#pragma once

#include <vector>

#include "kpsa/training/poses.h"
#include "rig/build/rig_builder.h"

namespace kpsa::engine {

// The morph weights and the rotations, translations and scales of transforms that the entry's training clips move and
// nothing else drives, each with the range that it has there (kpsa init would name these as controls).
std::vector<ControlRange> ControlsOfClips(const Rig& rig, const AccelerateEntry& entry);

}  // namespace kpsa::engine
