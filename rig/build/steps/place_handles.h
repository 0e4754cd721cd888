// A step of rig_builder.cpp. Handles that are placed `at` something; not where the rig has errors already.
// Reads: `at`, and where everything is at rest. Writes: offsetParentMatrix,
// parentMatrix and restMatrix in the graph.
#pragma once

#include "rig/build/rest_places.h"

namespace kpsa::engine {

void PlaceHandles(const BuildInput& in, RestPlaces* places, MadeNodes* nodes, Graph* graph);

}  // namespace kpsa::engine
