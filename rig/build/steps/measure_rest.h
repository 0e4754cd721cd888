// A step of rig_builder.cpp. How large the character is.
// Reads: the points of all meshes at rest.
#pragma once

#include "rig/character/rest_pose.h"

namespace kpsa::engine {

// The diagonal of the bounding box, metres; 0 without points.
double RestDiagonal(const CharacterGraph& scene, RestPose* rest);

}  // namespace kpsa::engine
