#include <algorithm>
#include <optional>

#include "graph/geometry.h"
#include "nodes/deformer.h"
#include "nodes/kernels/dual_quaternion.h"
#include "nodes/kernels/skin.h"
#include "nodes/kernels/weights.h"
#include "nodes/node_file.h"

namespace kpsa::engine {
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

// The share of the dual quaternions at the output points; 0, Maya's default, where the rig names no map.
Result<std::vector<float>> BoundBlendWeights(const Binding& binding) {
  const PointSet& out = binding.output("outPoints");
  std::vector<float> shares(out.size(), 0.0f);
  const auto* map = binding.structural().asset<WeightMap>("blendWeights");
  if (map == nullptr) return shares;
  if (map->weights().size() != out.total()) {
    return Status::Invalid("blendWeights are for {} points, the geometry has {}", map->weights().size(),
                           out.total());
  }
  for (Index i = 0; i < out.size(); ++i) {
    shares[i] = map->weights()[out[i]];
    if (!(shares[i] >= 0 && shares[i] <= 1))
      return Status::Invalid("blendWeights of point {}: {} is outside of 0 to 1", out[i], shares[i]);
  }
  return shares;
}

enum class SkinningMethod { kClassicLinear, kDualQuaternion, kWeightBlended };

struct SkinBound {
  std::optional<SkinKernel> linear;          // of classicLinear and weightBlended
  std::optional<DualQuaternionKernel> dual;  // of dualQuaternion and weightBlended
  Index joint_count = 0;
  std::size_t joint_floats = 0;
};

Result<BoundKernel> BindSkin(const Binding& binding) {
  const Structural& s = binding.structural();
  const auto* influences = s.asset<Influences>("influences");
  if (influences == nullptr) return Status::Invalid("influences are not set");
  const PointSet& out = binding.output("outPoints");
  SkinWeights weights{influences->offsets(), influences->joints(), influences->weights(),
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
  weights.joint_from_bind = joint_from_bind;
  SkinBound bound;
  bound.joint_count = influences->joint_count();
  bound.joint_floats = PaddedCount(bound.joint_count * sizeof(const Matrix4*) / sizeof(float));
  std::size_t scratch = bound.joint_floats;
  const auto method = s.choice<SkinningMethod>("skinningMethod");
  const std::vector<Index> points = out.ToVector();
  if (method != SkinningMethod::kDualQuaternion) {
    bound.linear.emplace(weights, points, BoundWeights(binding));
    scratch += bound.linear->ScratchFloats();
  }
  if (method != SkinningMethod::kClassicLinear) {
    std::vector<float> blend;
    if (method == SkinningMethod::kWeightBlended) {
      Result<std::vector<float>> shares = BoundBlendWeights(binding);
      if (!shares.ok()) return shares.status();
      blend = std::move(*shares);
      scratch += 3 * PaddedCount(points.size());
    }
    std::vector<Double3> centers;  // the joints at bind, mesh space
    for (const Matrix4& bind : joint_from_bind)
      centers.push_back(TransformPoint(InverseOrIdentity(bind), {}));
    bound.dual.emplace(weights, centers, points, BoundWeights(binding), blend);
    scratch += bound.dual->ScratchFloats();
  }
  return MakeBound(std::move(bound), scratch);
}

using SkinContext = DeformerContext<In<"matrix", ArrayView<Matrix4>>, In<"offset", Double3>>;

void ComputeSkin(SkinContext c) {
  const auto& bound = c.kernel_as<SkinBound>();
  const ArrayView<Matrix4> matrix = c.get<"matrix">();
  // The places of those that no point needs stay as they are: nobody reads them
  auto* world = reinterpret_cast<const Matrix4**>(c.scratch());
  static constexpr Matrix4 kUnmoved;
  const auto follow = [&](Index j) { world[j] = j < matrix.size() ? &matrix[j] : &kUnmoved; };
  follow(0);
  for (Index j : bound.linear.has_value() ? bound.linear->joints() : bound.dual->joints()) follow(j);
  const SkinJoints joints{{world, bound.joint_count}, c.get<"offset">()};
  const Parallel parallel = HostParallel(c);
  const double envelope = c.get<"envelope">();
  const ConstPointsView& in = c.get<"inPoints">();
  const PointsView& out = c.out<"outPoints">();
  float* scratch = c.scratch() + bound.joint_floats;
  if (!bound.dual.has_value()) {
    bound.linear->Run({joints, envelope}, in, out, {scratch, bound.linear->ScratchFloats()}, &parallel);
    return;
  }
  ConstPointsView linear;
  if (bound.linear.has_value()) {  // the output may be the input: the linear result waits beside it
    const std::size_t row = PaddedCount(in.count);
    const PointsView apart{scratch, scratch + row, scratch + 2 * row, in.count};
    scratch += 3 * row;
    bound.linear->Run({joints, envelope}, in, apart, {scratch, bound.linear->ScratchFloats()}, &parallel);
    scratch += bound.linear->ScratchFloats();
    linear = apart;
  }
  bound.dual->Run({joints, envelope, linear}, in, out, {scratch, bound.dual->ScratchFloats()}, &parallel);
}

void DeclareSkin(NodeBuilder& b) {
  b.structural("influences", Type::kAsset, {.doc = "joints and weights of every point"}).per_geometry();
  b.in("matrix", Matrix4(), {.doc = "the joints' world matrices"}).array();
  b.in("offset", Double3(), {.unit = Unit::kLength, .doc = "moves all joints, in double"});
  b.structural("bindPreMatrix", Matrix4(), {.doc = "the joints' inverse bind matrices"}).array();
  b.enumeration<SkinningMethod>(
      "skinningMethod",
      {{"classicLinear", SkinningMethod::kClassicLinear},
       {"dualQuaternion", SkinningMethod::kDualQuaternion},
       {"weightBlended", SkinningMethod::kWeightBlended}},
      true,
      "how influences are blended: as matrices, as rigid motions (dual quaternions), or between "
      "the two by blendWeights");
  b.structural("blendWeights", Type::kAsset,
               {.doc = "of weightBlended: 0 takes classicLinear, 1 dualQuaternion; 0 where unset"})
      .per_geometry();
}

}  // namespace

KPSA_NODES(skin_cluster, registry) {
  AddDeformer<ComputeSkin>(
      registry,
      {.name = "skinCluster",
       .doc =
           "Moves points with joints, any number of influences. Takes points in mesh space to world space.",
       .own = DeclareSkin,
       .bind = BindSkin,
       .demand = DemandSkin})
      .cost(70, 2.5f);
}

}  // namespace kpsa::engine
