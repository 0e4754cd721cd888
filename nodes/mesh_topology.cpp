#include "nodes/mesh_topology.h"

namespace kpsa::engine {

const Topology* TopologyOf(const Mesh* mesh, Status* error) {
  if (mesh == nullptr) {
    *error = Status::Invalid("mesh is not set");
    return nullptr;
  }
  const auto& built = mesh->Derived<Result<Topology>>(
      [&] { return Topology::Build(mesh->point_count(), mesh->data().triangles); });
  if (!built.ok()) {
    *error = built.status();
    return nullptr;
  }
  return &*built;
}

}  // namespace kpsa::engine
