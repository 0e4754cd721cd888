// Inside of the rig builder: from a file's shape to displacements of a mesh's points. Nothing outside rig/build
// includes this.
#pragma once

#include <string>
#include <vector>

#include "rig/build/target_shapes.h"

namespace kpsa::engine {

struct PointShape {
  std::vector<Index> points;       // ascending; those that move
  std::vector<float> deltas;       // xyz, 3 a point; mesh space, metres
  std::vector<std::string> notes;  // what may surprise
};

// A shape has a number for each vertex of the mesh in its file, or one for each point: of the vertices that are welded,
// the first alone. Positions are taken from the mesh's rest positions; differences of up to a millionth of its
// bounding box's diagonal are rounding, and none. A point takes the mean of its vertices. Errors: another number of
// vertices, displacements that are too large for a float.
Result<PointShape> ShapeOfPoints(const TargetSource& source, const CharacterMesh& mesh);

}  // namespace kpsa::engine
