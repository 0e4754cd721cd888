// Wavefront .obj files as shapes of meshes: their vertices, in the file's order. Faces, normals, texture coordinates
// and materials are passed over; libraries that read .obj files number vertices through all objects, or split them.
#pragma once

#include <string>
#include <vector>

#include "base/status.h"

namespace kpsa::engine {

struct ObjShape {
  std::string name;
  std::vector<float> positions;  // xyz, as the file has them
};

// In the file's order. An `o` line begins a shape of that name; in a file without any, so does a vertex after the faces
// of a group (`g`), and shapes are named as the group of their first faces. A file's only shape is named as the file,
// without its folder and suffix. Colours and the fourth number of a vertex are ignored. Errors, at their line: a vertex of fewer
// than three numbers or of numbers that are not finite, statements that .obj files do not have, no vertices, two shapes
// of one name.
Result<std::vector<ObjShape>> ReadObj(const std::string& path);

}  // namespace kpsa::engine
