// A step of rig_builder.cpp. Meshes that their skin moves, and after it a wrap whose driver the same joints move: what
// the joints do happens twice. A wrap with a `parent` is none of these: it knows what carries its points.
// Reads: `deform`, stages of meshes, connections of the graph. Writes: notes.
#pragma once

#include <string>
#include <vector>

#include "rig/build/made_nodes.h"

namespace kpsa::engine {

void NoteDoubleMoves(const BuildInput& in, const MadeNodes& nodes, std::vector<std::string>* notes);

}  // namespace kpsa::engine
