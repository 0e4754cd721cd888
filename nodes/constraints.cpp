// Maya's constraints of a transform by weighted targets: point, orient, parent, scale, aim.
#include <utility>

#include "nodes/constraint_node.h"
#include "nodes/deformer.h"
#include "nodes/kernels/constraint_math.h"
#include "nodes/kernels/matrix_parts.h"
#include "nodes/node_file.h"

namespace kpsa::engine {
namespace {

// What is maintained: by target, what takes it (as its constraint sees it) to the constrained at rest.
template <typename Offset>
struct ConstraintKernel {
  ConstraintRest rest;
  RotationMean::Mode mode = RotationMean::Mode::kShortest;
  std::vector<Offset> offsets;
};

// `offset_of(target, rest, &offset)` says false where the target has none.
template <typename Offset, typename F>
Result<ConstraintKernel<Offset>> BindOffsets(const Structural& s, Offset none, const F& offset_of) {
  Result<ConstraintRest> rest = ConstraintRest::Bind(s);
  if (!rest.ok()) return rest.status();
  ConstraintKernel<Offset> kernel{std::move(*rest), RotationMean::Mode::kShortest, {}};
  const std::span<const Matrix4> targets = kernel.rest.targets();
  for (std::size_t i = 0; i < targets.size(); ++i) {
    kernel.offsets.push_back(none);
    if (kernel.rest.maintain() && !offset_of(targets[i], kernel.rest, &kernel.offsets.back())) {
      return Status::Invalid(
          "targetMatrix[{}] is scaled to nothing at rest, so that no offset can be "
          "maintained",
          i);
    }
  }
  return kernel;
}

template <typename Kernel>
Result<BoundKernel> MakeBoundOr(Result<Kernel> kernel) {
  if (!kernel.ok()) return kernel.status();
  return MakeBound(std::move(*kernel), 0);
}

RotationMean::Mode InterpType(const Structural& s) { return s.choice<RotationMean::Mode>("interpType"); }

// Constrain(kernel, context, parent_inverse, total_weight, local) changes what it owns of the local matrix,
// which comes in as inMatrix.
template <typename Kernel,
          void (*Constrain)(const Kernel&, ConstraintInputs, const Matrix4&, double, Matrix4*)>
void ComputeConstraint(ConstraintContext<> c) {
  const auto& kernel = c.kernel_as<Kernel>();
  const Matrix4& in = c.get<"inMatrix">();
  const double blend = c.get<"blend">(), total = TotalWeight(c);
  if (blend == 0 || !(total > 0) || kernel.rest.Holds(c)) {
    c.out<"outMatrix">() = in;
    return;
  }
  Matrix4 local = in;
  Constrain(kernel, c, InverseOrIdentity(c.get<"parentMatrix">()), total, &local);
  c.out<"outMatrix">() = BlendMatrices(in, local, blend);
}

// The sum of of(target, i), each by its share of the weights.
template <typename Of>
Double3 WeightedMean(ConstraintInputs c, double total, Of of) {
  const ArrayView<Matrix4> targets = c.get<"targetMatrix">();
  Double3 sum;
  for (std::uint32_t i = 0; i < targets.size(); ++i)
    sum = sum + of(targets[i], i) * (TargetWeight(c, i) / total);
  return sum;
}

// point: the offset is in the axes of the constrained's parent.
using PointKernel = ConstraintKernel<Double3>;

Result<BoundKernel> BindPoint(const Binding& binding) {
  return MakeBoundOr(BindOffsets(binding.structural(), Double3(),
                                 [](const Matrix4& target, const ConstraintRest& rest, Double3* offset) {
                                   *offset = PlaceOf(rest.in()) -
                                             TransformPoint(rest.parent_inverse(), PlaceOf(target));
                                   return true;
                                 }));
}

void ConstrainPoint(const PointKernel& k, ConstraintInputs c, const Matrix4& parent_inverse, double total,
                    Matrix4* local) {
  const Double3 sum = WeightedMean(c, total, [&](const Matrix4& target, std::uint32_t i) {
    return TransformPoint(parent_inverse, PlaceOf(target)) + k.offsets[i];
  });
  (*local)(0, 3) = sum.x, (*local)(1, 3) = sum.y, (*local)(2, 3) = sum.z;
}

// orient: the offset comes after the target's rotation.
using OrientKernel = ConstraintKernel<Quaternion>;

Result<BoundKernel> BindOrient(const Binding& binding) {
  Result<OrientKernel> kernel =
      BindOffsets(binding.structural(), Quaternion(),
                  [](const Matrix4& target, const ConstraintRest& rest, Quaternion* offset) {
                    *offset = Normalized(Conjugate(TakeApart(rest.parent_inverse() * target).rotation) *
                                         TakeApart(rest.in()).rotation);
                    return true;
                  });
  if (kernel.ok()) kernel->mode = InterpType(binding.structural());
  return MakeBoundOr(std::move(kernel));
}

void ConstrainOrient(const OrientKernel& k, ConstraintInputs c, const Matrix4& parent_inverse, double,
                     Matrix4* local) {
  const ArrayView<Matrix4> targets = c.get<"targetMatrix">();
  RotationMean mean(k.mode);
  for (std::uint32_t i = 0; i < targets.size(); ++i)
    mean.Add(TakeApart(parent_inverse * targets[i]).rotation * k.offsets[i], TargetWeight(c, i));
  MatrixParts parts = TakeApart(*local);
  parts.rotation = mean.Get();
  *local = PutTogether(parts);
}

// parent: the constrained in the target's space.
using ParentKernel = ConstraintKernel<Matrix4>;

Result<BoundKernel> BindParent(const Binding& binding) {
  Result<ParentKernel> kernel =
      BindOffsets(binding.structural(), Matrix4(),
                  [](const Matrix4& target, const ConstraintRest& rest, Matrix4* offset) {
                    Matrix4 inverse;
                    if (!Invert(target, &inverse)) return false;
                    *offset = inverse * (rest.parent() * rest.in());
                    return true;
                  });
  if (kernel.ok()) kernel->mode = InterpType(binding.structural());
  return MakeBoundOr(std::move(kernel));
}

void ConstrainParent(const ParentKernel& k, ConstraintInputs c, const Matrix4& parent_inverse, double total,
                     Matrix4* local) {
  const ArrayView<Matrix4> targets = c.get<"targetMatrix">();
  RotationMean mean(k.mode);
  Double3 sum;
  for (std::uint32_t i = 0; i < targets.size(); ++i) {
    const double weight = TargetWeight(c, i);
    if (!(weight > 0)) continue;
    const MatrixParts goal = TakeApart(parent_inverse * (targets[i] * k.offsets[i]));
    sum = sum + goal.translation * (weight / total);
    mean.Add(goal.rotation, weight);
  }
  MatrixParts parts = TakeApart(*local);
  parts.translation = sum, parts.rotation = mean.Get();
  *local = PutTogether(parts);
}

// scale: the offset is a factor by axis.
using ScaleKernel = ConstraintKernel<Double3>;

Result<BoundKernel> BindScale(const Binding& binding) {
  return MakeBoundOr(BindOffsets(binding.structural(), Double3{1, 1, 1},
                                 [](const Matrix4& target, const ConstraintRest& rest, Double3* offset) {
                                   const Double3 own = TakeApart(rest.in()).scale,
                                                 of = TakeApart(rest.parent_inverse() * target).scale;
                                   if (of.x == 0 || of.y == 0 || of.z == 0) return false;
                                   *offset = {own.x / of.x, own.y / of.y, own.z / of.z};
                                   return true;
                                 }));
}

void ConstrainScale(const ScaleKernel& k, ConstraintInputs c, const Matrix4& parent_inverse, double total,
                    Matrix4* local) {
  MatrixParts parts = TakeApart(*local);
  parts.scale = WeightedMean(c, total, [&](const Matrix4& target, std::uint32_t i) {
    const Double3 s = TakeApart(parent_inverse * target).scale, &offset = k.offsets[i];
    return Double3{s.x * offset.x, s.y * offset.y, s.z * offset.z};
  });
  *local = PutTogether(parts);
}

// aim
enum class WorldUp { kScene, kObject, kObjectRotation, kVector, kNone };

struct AimKernel {
  ConstraintRest rest;
  Double3 aim, up;
  WorldUp world_up = WorldUp::kVector;
  Double3 target_rest, up_vector_rest;
  Matrix4 up_matrix_rest;
  Quaternion offset;
};

// The weighted mean of the targets' places; false where the weights say nothing.
template <typename Targets, typename Weight>
bool MeanPlace(std::size_t count, const Targets& targets, const Weight& weight, Double3* place) {
  Double3 sum;
  double total = 0;
  for (std::size_t i = 0; i < count; ++i) {
    sum = sum + PlaceOf(targets[static_cast<std::uint32_t>(i)]) * weight(i);
    total += weight(i);
  }
  if (!(total > 0)) return false;
  *place = sum * (1 / total);
  return true;
}

// The local rotation that aims; what the pose says where nothing can be aimed at.
Quaternion AimLocal(const AimKernel& k, const Matrix4& parent, const MatrixParts& in, Double3 target,
                    Double3 up_vector, const Matrix4& up_matrix) {
  const Double3 place = TransformPoint(parent, in.translation);
  const Quaternion parent_turn = TakeApart(parent).rotation, world = parent_turn * in.rotation;
  Double3 direction, aim;
  if (!Direction(target - place, 0, &direction)) return in.rotation;
  Double3 up = up_vector;
  if (k.world_up == WorldUp::kScene) up = {0, 1, 0};
  if (k.world_up == WorldUp::kObject) up = PlaceOf(up_matrix) - place;
  if (k.world_up == WorldUp::kObjectRotation) up = Rotate(TakeApart(up_matrix).rotation, up_vector);
  Quaternion turn;
  if (k.world_up == WorldUp::kNone || !AimRotation(k.aim, k.up, direction, up, &turn)) {
    if (!Direction(Rotate(world, k.aim), 0, &aim)) return in.rotation;
    turn = ShortestArc(aim, direction, Rotate(world, k.up)) * world;
  }
  return Normalized(Conjugate(parent_turn) * turn);
}

Result<BoundKernel> BindAim(const Binding& binding) {
  const Structural& s = binding.structural();
  Result<ConstraintRest> rest = ConstraintRest::Bind(s);
  if (!rest.ok()) return rest.status();
  AimKernel k{std::move(*rest),
              s.value("aimVector").get<Double3>(),
              s.value("upVector").get<Double3>(),
              s.choice<WorldUp>("worldUpType"),
              {},
              {},
              {},
              {}};
  Double3 unit;
  if (!Direction(k.aim, 0, &unit)) return Status::Invalid("aimVector has no direction");
  if (k.world_up != WorldUp::kNone && !Direction(Cross(unit, k.up), 1e-12 * Length(k.up), &unit))
    return Status::Invalid("upVector is parallel to aimVector, or has no direction");
  Result<Matrix4> up_matrix = RestMatrix(s, "worldUpMatrix");
  if (!up_matrix.ok()) return up_matrix.status();
  const Value* up_vector = s.rest("worldUpVector");
  if (up_vector == nullptr || up_vector->get_if<Double3>() == nullptr)
    return Status::Invalid("worldUpVector has no value at rest");
  k.up_matrix_rest = *up_matrix, k.up_vector_rest = up_vector->get<Double3>();
  if (!k.rest.maintain()) return MakeBound(std::move(k), 0);
  const std::span<const Matrix4> targets = k.rest.targets();
  const auto weight = [&](std::size_t i) {
    const int element = static_cast<int>(i);
    const Value* set = element < s.array_size("targetWeight") ? s.rest("targetWeight", element) : nullptr;
    return set == nullptr ? 1.0 : set->AsDouble();
  };
  if (MeanPlace(targets.size(), targets, weight, &k.target_rest)) {
    const MatrixParts in = TakeApart(k.rest.in());
    const Quaternion aimed =
        AimLocal(k, k.rest.parent(), in, k.target_rest, k.up_vector_rest, k.up_matrix_rest);
    k.offset = Normalized(Conjugate(aimed) * in.rotation);
  }
  return MakeBound(std::move(k), 0);
}

void ComputeAim(ConstraintContext<In<"worldUpVector", Double3>, In<"worldUpMatrix", Matrix4>> c) {
  const auto& k = c.kernel_as<AimKernel>();
  const Matrix4& in = c.get<"inMatrix">();
  const Double3& up_vector = c.get<"worldUpVector">();
  const Matrix4& up_matrix = c.get<"worldUpMatrix">();
  const double blend = c.get<"blend">();
  const ArrayView<Matrix4> targets = c.get<"targetMatrix">();
  c.out<"outMatrix">() = in;
  Double3 target;
  if (blend == 0 ||
      !MeanPlace(
          targets.size(), targets,
          [&](std::size_t i) { return TargetWeight(c, static_cast<std::uint32_t>(i)); }, &target))
    return;
  if (k.rest.Holds(c) && target == k.target_rest && up_vector == k.up_vector_rest &&
      up_matrix == k.up_matrix_rest)
    return;
  MatrixParts parts = TakeApart(in);
  parts.rotation = AimLocal(k, c.get<"parentMatrix">(), parts, target, up_vector, up_matrix) * k.offset;
  c.out<"outMatrix">() = BlendMatrices(in, PutTogether(parts), blend);
}

const char* const kOutDoc = "local, for the constrained transform's offsetParentMatrix";

NodeBuilder& AddInterpType(NodeBuilder& b) {
  return b.enumeration<RotationMean::Mode>(
      "interpType", {{"shortest", RotationMean::Mode::kShortest}, {"average", RotationMean::Mode::kAverage}},
      true,
      "how rotations of several targets are mixed: spherically on the shortest way, one "
      "after the other, or as the mean of quaternions");
}

}  // namespace

KPSA_NODES(constraints, registry) {
  NodeBuilder point = AddConstraint(registry, "pointConstraint", "Moves a transform to its targets' place.");
  point.out("outMatrix", Type::kMatrix, kOutDoc)
      .compute<ComputeConstraint<PointKernel, ConstrainPoint>>()
      .bind(BindPoint)
      .cost(200, 0);
  NodeBuilder orient = AddConstraint(registry, "orientConstraint", "Turns a transform as its targets.");
  AddInterpType(orient)
      .out("outMatrix", Type::kMatrix, kOutDoc)
      .compute<ComputeConstraint<OrientKernel, ConstrainOrient>>()
      .bind(BindOrient)
      .cost(300, 0);
  NodeBuilder parent = AddConstraint(registry, "parentConstraint",
                                     "Moves and turns a transform as if it hung under its targets.");
  AddInterpType(parent)
      .out("outMatrix", Type::kMatrix, kOutDoc)
      .compute<ComputeConstraint<ParentKernel, ConstrainParent>>()
      .bind(BindParent)
      .cost(300, 0);
  NodeBuilder scale = AddConstraint(registry, "scaleConstraint", "Scales a transform as its targets.");
  scale.out("outMatrix", Type::kMatrix, kOutDoc)
      .compute<ComputeConstraint<ScaleKernel, ConstrainScale>>()
      .bind(BindScale)
      .cost(300, 0);
  NodeBuilder aim = AddConstraint(registry, "aimConstraint", "Points an axis of a transform at its targets.");
  aim.in("worldUpVector", Double3{0, 1, 0}, {.doc = "world space; objectrotation: in worldUpMatrix's axes"})
      .in("worldUpMatrix", Matrix4(), {.doc = "worldMatrix of the up object"})
      .structural("aimVector", Double3{1, 0, 0}, {.doc = "own axis that points at the target"})
      .structural("upVector", Double3{0, 1, 0}, {.doc = "own axis that is turned towards the world's up"})
      .enumeration<WorldUp>(
          "worldUpType",
          {{"scene", WorldUp::kScene},
           {"object", WorldUp::kObject},
           {"objectrotation", WorldUp::kObjectRotation},
           {"vector", WorldUp::kVector},
           {"none", WorldUp::kNone}},
          true,
          "what is up: world y, the place of an object, its axes, worldUpVector, or nothing (the "
          "smallest turn from inMatrix)",
          WorldUp::kVector)
      .out("outMatrix", Type::kMatrix, kOutDoc)
      .compute<ComputeAim>()
      .bind(BindAim)
      .cost(500, 0);
}

}  // namespace kpsa::engine
