// A step of rig_builder.cpp. Where the points of a stage in mesh space are, for falloff nodes, once that is known.
// Reads: what falloffs measure, world_from_stage. Writes: geometryMatrix of falloffs in the graph.
#pragma once

#include <vector>

#include "rig/build/steps/connect_falloffs.h"

namespace kpsa::engine {

void PlaceFalloffs(const BuildInput& in, const std::vector<FalloffUse>& uses, const MadeNodes& nodes,
                   Graph* graph);

}  // namespace kpsa::engine
