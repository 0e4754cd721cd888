// Inside of the rig builder: where the points of a lattice are at rest. Nothing outside rig/build includes this.
#pragma once

#include "rig/build/made_nodes.h"
#include "rig/character/rest_pose.h"

namespace kpsa::engine {

// The lattice's box at rest, in the axes of its stage. Where the rig does not set it, it is set here to what the
// members fill. False after an error.
bool BoxOfMembers(const BuildInput& in, const SourceLocation& where, RestPose* rest, MadeNode* lattice,
                  Graph* graph, Matrix4* world_from_box);

// The control points of a lattice at rest, in the coordinates of its box; null after an error.
PointBufferPtr RegularGrid(const BuildInput& in, const PlugRef& plug, const RigString& name);

}  // namespace kpsa::engine
