// A step of rig_builder.cpp. Curves through vertices of meshes, or through places.
// Reads: keys of curve nodes, the points of meshes at rest. Writes: curves in the graph, and their cvs at rest.
#pragma once

#include "rig/build/rest_places.h"

namespace kpsa::engine {

void AddCurves(const BuildInput& in, const MadeNodes& nodes, const RestPlaces& places, RestCurves* curves,
               Graph* graph);

}  // namespace kpsa::engine
