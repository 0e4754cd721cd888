// Inside of the rig builder: from a rig file and its character to a rig (rig_builder.cpp). Nothing outside rig/build
// includes this.
#pragma once

#include "rig/build/rig_builder.h"
#include "rig/character/rest_pose.h"
#include "rig/file/rig_file.h"

namespace kpsa::engine {

// Adds to a rig that has its character, its scene and its references what the file says of them. Names in *file are
// resolved in place, and connections that are not ours to make go to RigFile::returned. Errors are collected; with
// any, *rig is not to be used.
void BuildRig(RigFile* file, RestPose* rest, Rig* rig, YamlErrors* errors);

}  // namespace kpsa::engine
