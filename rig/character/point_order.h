// In which order points of a mesh stand in memory: cut into halves again and again, where they lie or follow joints
// farthest apart, down to kOrderTogether points in a row, which then lie together and follow few joints. What moves alike
// is reconstructed by few numbers (kpsa/tiles.h takes as many points together).
#pragma once

#include <vector>

#include "gltf/import.h"

namespace kpsa::engine {

inline constexpr std::size_t kOrderTogether = 128;

// Sorts some vertices of the mesh, by positions and skin weights; of a mesh with morph targets along a Morton curve through
// the positions alone. O(V log V); the same order on every machine, whatever order they come in.
void SortPoints(const gltf::Mesh& mesh, std::vector<Index>* vertices);

}  // namespace kpsa::engine
