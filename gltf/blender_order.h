// The order of vertices that Blender's glTF import ends up with: caches for its modifiers are written in it.
#pragma once

#include <vector>

#include "base/types.h"
#include "gltf/import.h"

namespace kpsa::engine {

// The vertices that Blender's glTF import makes of a mesh: of each primitive those that its triangles use,
// ascending.
std::vector<Index> BlenderVertexOrder(const gltf::Mesh& mesh);

}  // namespace kpsa::engine
