// A step of rig_builder.cpp. What is to be accelerated.
// Reads: `accelerate`, stages of meshes, controls, clips, the size of the rig at rest. Writes: the rig's accelerate entries, after those of
// references; makes their meshes visible; notes of entries that have one file.
#pragma once

#include <string>
#include <vector>

#include "rig/build/build_input.h"

namespace kpsa::engine {

void AddAccelerateEntries(const BuildInput& in, CharacterGraph* scene, std::vector<AccelerateEntry>* entries,
                          std::vector<std::string>* notes);

}  // namespace kpsa::engine
