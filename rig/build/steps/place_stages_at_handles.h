// A step of rig_builder.cpp. Where a deformer before the skin has a handle or a curve, its stage lies as the skin
// carries the points that are nearest to it: a handle at a vertex then moves that vertex fully, wherever the rest pose
// has taken it.
// Reads: handles, curves, the rest pose. Writes: world_from_stage of the nodes' geometries, geometryMatrix in the
// graph.
#pragma once

#include "rig/build/rest_places.h"

namespace kpsa::engine {

void PlaceStagesAtHandles(const BuildInput& in, RestPlaces* places, RestPose* rest, MadeNodes* nodes,
                          Graph* graph);

}  // namespace kpsa::engine
