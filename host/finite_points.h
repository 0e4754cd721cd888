// Points that are no numbers, found before they leave: who made them, and where.
#pragma once

#include <span>

#include "base/points.h"
#include "base/status.h"
#include "rig/build/rig_builder.h"

namespace kpsa::engine {

// Refuses final points of a mesh that are not finite. kEvaluation, with the time, the first such vertex (of the mesh,
// in the order of the glTF file), its position, and the first node of the mesh's stack behind which a point is not
// finite. That node is looked for by evaluating the stages anew: of nodes that need their past, at that time alone.
Status CheckFinite(const Rig& rig, const CharacterMesh& mesh, ConstPointsView points, double seconds);

}  // namespace kpsa::engine
