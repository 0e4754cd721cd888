#include "host/vertex_points.h"

namespace kpsa::engine {

void Interleave(const Mesh& mesh, ConstPointsView points, Index first, Index count, float* xyz) {
  const Index* point = mesh.data().vertex_to_point.data() + first;
  for (Index v = 0; v < count; ++v) {
    xyz[3 * v] = points.x[point[v]];
    xyz[3 * v + 1] = points.y[point[v]];
    xyz[3 * v + 2] = points.z[point[v]];
  }
}

}  // namespace kpsa::engine
