// Which vertices of a glTF mesh share a normal: where the file shades an edge hard, it has two vertices at one
// place with normals of their own.
#pragma once

#include <vector>

#include "gltf/import.h"
#include "graph/geometry.h"

namespace kpsa::engine {

// [V] the first of the vertices that a vertex shares its normal with: those of its point whose normals are within
// one degree of the first one's. A vertex whose normal has no direction goes with the first of its point.
// kNoIndex where the primitive has no normals at all: its triangles are flat (glTF 2.0, 3.7.2.1).
std::vector<Index> SmoothVertices(const gltf::Mesh& file, const std::vector<Index>& vertex_to_point);

}  // namespace kpsa::engine
