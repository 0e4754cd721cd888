#include "gltf/blender_order.h"

namespace kpsa::engine {

std::vector<Index> BlenderVertexOrder(const gltf::Mesh& mesh) {
  std::vector<Index> order;
  for (const gltf::Primitive& primitive : mesh.primitives) {
    std::vector<bool> used(primitive.vertex_count, false);
    for (const Index vertex : primitive.triangles) used[vertex - primitive.first_vertex] = true;
    for (Index i = 0; i < primitive.vertex_count; ++i) {
      if (used[i]) order.push_back(primitive.first_vertex + i);
    }
  }
  return order;
}

}  // namespace kpsa::engine
