#include "graph/geometry.h"
#include "nodes/deformer.h"
#include "nodes/kernels/weights.h"
#include "nodes/node_file.h"

namespace kpsa::engine {
namespace {

struct MeshKernel {
  PointBuffer points;  // at the output points
};

Result<BoundKernel> BindMesh(const Binding& binding) {
  const auto* mesh = binding.structural().asset<Mesh>("mesh");
  if (mesh == nullptr) return Status::Invalid("mesh is not set");
  const PointSet& out = binding.output("points");
  MeshKernel kernel{PointBuffer(out.size())};
  GatherPoints(mesh->data().rest.view(), out.ToVector(), kernel.points.view());
  return MakeBound(std::move(kernel), 0);
}

void ComputeMesh(NodeContext<Out<"points", PointsView>> c) {
  CopyPoints(c.kernel_as<MeshKernel>().points.view(), c.out<"points">());
}

}  // namespace

KPSA_NODES(mesh, registry) {
  registry.add("mesh", "A mesh of the character: its rest points.")
      .category("geometry")
      .structural("mesh", Type::kMesh)
      .out("points", Type::kPoints, "mesh space")
      .compute<ComputeMesh>()
      .bind(BindMesh)
      .point_count([](const Structural& s, std::string_view, int) -> Result<Index> {
        const auto* mesh = s.asset<Mesh>("mesh");
        if (mesh == nullptr) return Status::Invalid("mesh is not set");
        return mesh->point_count();
      });
}

}  // namespace kpsa::engine
