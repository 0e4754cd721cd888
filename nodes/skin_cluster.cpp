#include <algorithm>

#include "graph/geometry.h"
#include "nodes/deformer.h"
#include "nodes/kernels/skin.h"
#include "nodes/kernels/weights.h"
#include "nodes/standard_nodes.h"

namespace kpsa {
namespace {

// The joints that move none of the points need no world matrix, but for the first one: the kernel computes
// about its place, whatever the binding.
void DemandSkin(Demand& demand) {
  const PointSet& out = demand.output("outPoints");
  demand.Require("inPoints", 0, out);
  const auto* influences = demand.structural().asset<Influences>("influences");
  if (influences == nullptr || influences->offsets().size() != std::size_t{out.total()} + 1)
    return;  // bind reports it
  std::vector<bool> moves(influences->joint_count(), false);
  for (Index i = 0; i < out.size(); ++i) {
    const std::size_t end =
        std::min<std::size_t>(influences->offsets()[out[i] + 1], influences->joints().size());
    for (std::size_t e = influences->offsets()[out[i]]; e < end; ++e) {
      if (influences->joints()[e] < moves.size()) moves[influences->joints()[e]] = true;
    }
  }
  for (std::size_t j = 1; j < moves.size(); ++j) {
    if (!moves[j]) demand.Skip("matrix", static_cast<int>(j));
  }
}

// The matrices of the palette that no point needs stay as they are: nobody reads them.
struct SkinBound {
  SkinKernel kernel;
  std::vector<Matrix4> joint_from_bind;
  std::size_t palette_floats;
};

Result<BoundKernel> BindSkin(const Binding& binding) {
  const Structural& s = binding.structural();
  const auto* influences = s.asset<Influences>("influences");
  if (influences == nullptr) return Status::Invalid("influences are not set");
  const PointSet& out = binding.output("outPoints");
  const SkinWeights weights{influences->offsets(), influences->joints(), influences->weights(),
                            influences->joint_count()};
  if (weights.point_count() != out.total()) {
    return Status::Invalid("its influences are for {} points, the geometry has {}", weights.point_count(),
                           out.total());
  }
  KPSA_RETURN_IF_ERROR(weights.Validate());
  if (s.array_size("matrix") > static_cast<int>(influences->joint_count())) {
    return Status::Invalid("matrix has {} elements, its influences name {} joints", s.array_size("matrix"),
                           influences->joint_count());
  }
  std::vector<Matrix4> joint_from_bind;
  for (Index j = 0; j < influences->joint_count(); ++j) {
    const Value& bind = s.value("bindPreMatrix", static_cast<int>(j));
    joint_from_bind.push_back(bind.get_if<Matrix4>() != nullptr ? bind.get<Matrix4>() : Matrix4());
  }
  SkinBound bound{SkinKernel(weights, out.ToVector(), BoundWeights(binding)), std::move(joint_from_bind), 0};
  bound.palette_floats = bound.joint_from_bind.size() * sizeof(Matrix4) / sizeof(float);
  const std::size_t scratch = bound.palette_floats + bound.kernel.ScratchFloats();
  return MakeBound(std::move(bound), scratch);
}

void ComputeSkin(ComputeContext& c) {
  const auto& bound = c.kernel_as<SkinBound>();
  const ArrayView<Matrix4> matrix = c.array<Matrix4>(kFirstOwnInput);
  auto* palette = reinterpret_cast<Matrix4*>(c.scratch);
  const auto follow = [&](Index j) {
    palette[j] = j < matrix.size() ? matrix[j] * bound.joint_from_bind[j] : bound.joint_from_bind[j];
  };
  if (!bound.joint_from_bind.empty()) follow(0);
  for (Index j : bound.kernel.joints()) follow(j);
  const Parallel parallel = HostParallel(c);
  bound.kernel.Run({{palette, bound.joint_from_bind.size()}, c.get<double>(kEnvelope), Matrix4()},
                   c.points(kInPoints), c.out_points(0),
                   {c.scratch + bound.palette_floats, bound.kernel.ScratchFloats()}, &parallel);
}

void ComputeTransformGeometry(ComputeContext& c) {
  const Matrix4& m = c.get<Matrix4>(kFirstOwnInput);
  const ConstPointsView& in = c.points(kInPoints);
  const PointsView& out = c.out_points(0);
  c.host->For(in.count, 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Double3 p = TransformPoint(m, {in.x[i], in.y[i], in.z[i]});
      out.x[i] = static_cast<float>(p.x);
      out.y[i] = static_cast<float>(p.y);
      out.z[i] = static_cast<float>(p.z);
    }
  });
}

}  // namespace

void AddSkinClusterNode(NodeRegistry& registry) {
  NodeBuilder b = AddDeformer(registry, "skinCluster",
                              "Moves points with joints: linear blend skinning, any number of influences. "
                              "Takes points in mesh space to world space.");
  b.structural("influences", Type::kAsset, {.doc = "joints and weights of every point"}).per_geometry();
  b.in("matrix", Matrix4(), {.doc = "the joints' world matrices"}).array();
  b.structural("bindPreMatrix", Matrix4(), {.doc = "the joints' inverse bind matrices"}).array();
  FinishDeformer(b, &ComputeSkin, BindSkin, DemandSkin).cost(1000, 8);
}

void AddTransformGeometryNode(NodeRegistry& registry) {
  NodeBuilder b =
      AddDeformer(registry, "transformGeometry", "Takes the points of a mesh without a skin to world space.");
  b.in("matrix", Matrix4(), {.doc = "the mesh node's world matrix"});
  FinishDeformer(b, &ComputeTransformGeometry, nullptr).cost(20, 2);
}

}  // namespace kpsa
