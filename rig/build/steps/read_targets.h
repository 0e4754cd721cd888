// A step of rig_builder.cpp. `targets` of the rig's blend shapes, before anything names one of their weights.
// Reads: `targets`, and the files of shapes that they name. Writes: what the targets are, names of the weights in the
// graph, through `shapes` the files that the rig names.
#pragma once

#include "rig/build/target_shapes.h"

namespace kpsa::engine {

void ReadTargets(const BuildInput& in, const MadeNodes& nodes, TargetShapes* shapes, Graph* graph);

}  // namespace kpsa::engine
