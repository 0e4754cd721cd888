// A step of rig_builder.cpp. What is to be accelerated.
// Reads: `accelerate`, stages of meshes, controls, clips, the size of the rig at rest. Writes: the rig's accelerate entries, after those of
// references; makes their meshes visible.
#pragma once

#include <vector>

#include "rig/build/build_input.h"

namespace kpsa::engine {

void AddAccelerations(const BuildInput& in, CharacterGraph* scene, std::vector<Acceleration>* entries);

}  // namespace kpsa::engine
