#include "nodes/kernels/blend_shape.h"

#include "graph/geometry.h"
#include "nodes/deformer.h"
#include "nodes/standard_nodes.h"

namespace kpsa {
namespace {

Result<BoundKernel> BindBlendShape(const Binding& binding) {
  const auto* asset = binding.structural().asset<MorphTargets>("targets");
  if (asset == nullptr) return Status::Invalid("targets are not set");
  const PointSet& out = binding.output("outPoints");
  if (asset->point_count() != out.total()) {
    return Status::Invalid("its targets are for {} points, the geometry has {}", asset->point_count(),
                           out.total());
  }
  std::vector<BlendTarget> targets;
  for (const MorphTargets::Target& target : asset->targets())
    targets.push_back({target.points, target.deltas});
  const BlendShapeTargets all{out.total(), targets};
  KPSA_RETURN_IF_ERROR(all.Validate());
  BlendShapeKernel kernel(all, out.ToVector(), BoundWeights(binding));
  const std::size_t weights = (2 * kernel.target_count() + 15) / 16 * 16;
  const std::size_t scratch = weights + kernel.ScratchFloats();
  return MakeBound(std::move(kernel), scratch);
}

void ComputeBlendShape(ComputeContext& c) {
  const auto& kernel = c.kernel_as<BlendShapeKernel>();
  const ArrayView<double> weight = c.array<double>(kFirstOwnInput);
  const std::span<double> weights(reinterpret_cast<double*>(c.scratch), kernel.target_count());
  for (std::uint32_t i = 0; i < weights.size(); ++i) weights[i] = i < weight.size() ? weight[i] : 0.0;
  const Parallel parallel = HostParallel(c);
  const std::size_t used = (2 * weights.size() + 15) / 16 * 16;
  kernel.Run({weights, c.get<double>(kEnvelope)}, c.points(kInPoints), c.out_points(0),
             {c.scratch + used, kernel.ScratchFloats()}, &parallel);
}

}  // namespace

void AddBlendShapeNode(NodeRegistry& registry) {
  NodeBuilder b = AddDeformer(registry, "blendShape",
                              "Adds weighted displacements towards target shapes (morph targets).");
  b.structural("targets", Type::kAsset, {.doc = "the target shapes"}).per_geometry();
  b.in("weight", 0.0, {.doc = "one for each target; weight[name] works, too"}).array();
  FinishDeformer(b, &ComputeBlendShape, BindBlendShape).cost(100, 3);
}

}  // namespace kpsa
