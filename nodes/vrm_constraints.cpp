// The node constraints of VRM (VRMC_node_constraint 1.0): roll, aim, rotation. They turn a transform away
// from its rest rotation, whatever a clip says of its rotation; its place and its size stay those of
// inMatrix.
#include "nodes/choices.h"
#include "nodes/deformer.h"
#include "nodes/kernels/constraint_math.h"
#include "nodes/kernels/matrix_parts.h"
#include "nodes/node_file.h"

namespace kpsa::engine {
namespace {

using VrmInputs = NodeContext<In<"sourceMatrix", Matrix4>, In<"inMatrix", Matrix4>, In<"weight", double>>;
using VrmAimInputs = NodeContext<In<"sourceMatrix", Matrix4>, In<"inMatrix", Matrix4>, In<"weight", double>,
                                 In<"parentMatrix", Matrix4>>;

struct VrmKernel {
  Quaternion rest, source_rest;
  Matrix4 rest_matrix, source_rest_matrix;
  Double3 axis;
};

Quaternion TurnOf(const Matrix4& m) { return TakeApart(m).rotation; }

enum class AimAxis { kPositiveX, kNegativeX, kPositiveY, kNegativeY, kPositiveZ, kNegativeZ };

Double3 UnitVector(AimAxis axis) {
  switch (axis) {
    case AimAxis::kPositiveX:
      return {1, 0, 0};
    case AimAxis::kNegativeX:
      return {-1, 0, 0};
    case AimAxis::kPositiveY:
      return {0, 1, 0};
    case AimAxis::kNegativeY:
      return {0, -1, 0};
    case AimAxis::kPositiveZ:
      return {0, 0, 1};
    case AimAxis::kNegativeZ:
      break;
  }
  return {0, 0, -1};
}

Result<BoundKernel> BindVrm(const Binding& binding, Double3 axis, bool has_source_rest) {
  const Structural& s = binding.structural();
  VrmKernel k;
  k.rest_matrix = s.value("restMatrix").get<Matrix4>();
  k.rest = TurnOf(k.rest_matrix);
  if (has_source_rest) {
    k.source_rest_matrix = s.value("sourceRestMatrix").get<Matrix4>();
    k.source_rest = TurnOf(k.source_rest_matrix);
  }
  k.axis = axis;
  return MakeBound(k, 0);
}
Result<BoundKernel> BindVrmRoll(const Binding& binding) {
  return BindVrm(binding, UnitVector(binding.structural().choice<Axis>("rollAxis")), true);
}
Result<BoundKernel> BindVrmAim(const Binding& binding) {
  return BindVrm(binding, UnitVector(binding.structural().choice<AimAxis>("aimAxis")), false);
}
Result<BoundKernel> BindVrmRotation(const Binding& binding) { return BindVrm(binding, {}, true); }

// The turn that is the roll of `turn` about the axis: what is left after the smallest turn that takes the
// axis to where `turn` takes it.
Quaternion RollOf(Quaternion turn, Double3 axis) {
  return Conjugate(ShortestArc(axis, Rotate(turn, axis), Perpendicular(axis, {0, 1, 0}))) * turn;
}

Quaternion RollTarget(const VrmKernel& k, VrmInputs c) {
  // The source's turn in its parent's axes, seen in the constrained's own
  const Quaternion in_parent = TurnOf(c.get<"sourceMatrix">()) * Conjugate(k.source_rest);
  return k.rest * RollOf(Normalized(Conjugate(k.rest) * in_parent * k.rest), k.axis);
}

Quaternion RotationTarget(const VrmKernel& k, VrmInputs c) {
  return k.rest * (Conjugate(k.source_rest) * TurnOf(c.get<"sourceMatrix">()));
}

Quaternion AimTarget(const VrmKernel& k, VrmAimInputs c) {
  const Matrix4 &parent = c.get<"parentMatrix">(), &in = c.get<"inMatrix">();
  const Double3 place = TransformPoint(parent, {in(0, 3), in(1, 3), in(2, 3)});
  const Matrix4& source = c.get<"sourceMatrix">();
  const Quaternion turned = TurnOf(parent), world = Normalized(turned * k.rest);
  const Double3 from = Rotate(world, k.axis);
  Double3 to;
  if (!Direction(Double3{source(0, 3), source(1, 3), source(2, 3)} - place, 0, &to)) return k.rest;
  const Quaternion arc = ShortestArc(from, to, Rotate(world, Perpendicular(k.axis, {0, 1, 0})));
  return Conjugate(turned) * arc * world;
}

// target() is only asked where the constraint has a weight.
template <typename Target>
void ComputeVrm(VrmInputs c, bool from_rest, Matrix4* out, Target target) {
  const auto& k = c.kernel_as<VrmKernel>();
  const Matrix4& in = c.get<"inMatrix">();
  if (from_rest && in == k.rest_matrix && c.get<"sourceMatrix">() == k.source_rest_matrix) {
    *out = in;  // bit for bit
    return;
  }
  const double weight = c.get<"weight">();
  MatrixParts parts = TakeApart(in);
  parts.rotation = weight > 0 ? Normalized(target(k, c)) : k.rest;
  if (weight > 0 && weight < 1) parts.rotation = Slerp(k.rest, parts.rotation, weight);
  *out = PutTogether(parts);
}
template <Quaternion (*kTarget)(const VrmKernel&, VrmInputs)>
void ComputeVrmTurn(NodeContext<In<"sourceMatrix", Matrix4>, In<"inMatrix", Matrix4>, In<"weight", double>,
                                Out<"outMatrix", Matrix4>>
                        c) {
  ComputeVrm(c, true, &c.out<"outMatrix">(), kTarget);
}
void ComputeVrmAim(NodeContext<In<"sourceMatrix", Matrix4>, In<"inMatrix", Matrix4>, In<"weight", double>,
                               In<"parentMatrix", Matrix4>, Out<"outMatrix", Matrix4>>
                       c) {
  ComputeVrm(c, false, &c.out<"outMatrix">(), [&](const VrmKernel& k, VrmInputs) { return AimTarget(k, c); });
}

NodeBuilder AddVrm(NodeRegistry& registry, const char* name, const char* doc, const char* source_doc) {
  NodeBuilder b = registry.add(name, doc);
  b.category("constraint")
      .in("sourceMatrix", Matrix4(), {.doc = source_doc})
      .in("inMatrix", Matrix4(), {.doc = "the local matrix below: its rotation gives way to the rest pose's"})
      .in("weight", 1.0, {.min = 0, .max = 1, .doc = "0: the rest rotation, 1: the constraint's"})
      .structural("restMatrix", Matrix4(), {.doc = "the constrained transform's local matrix at rest"});
  return b;
}
const char* const kVrmRestDoc = "the source's local matrix at rest";
const char* const kVrmOutDoc = "local, for the constrained transform's offsetParentMatrix";

}  // namespace

KPSA_NODES(vrm_constraints, registry) {
  NodeBuilder roll = AddVrm(registry, "vrmRollConstraint",
                            "Rolls a transform about one of its axes as its source has turned since rest.",
                            "the source's matrix");
  roll.structural("sourceRestMatrix", Matrix4(), {.doc = kVrmRestDoc})
      .enumeration<Axis>("rollAxis", kAxes, true, "own axis")
      .out("outMatrix", Type::kMatrix, kVrmOutDoc)
      .compute<ComputeVrmTurn<RollTarget>>()
      .bind(BindVrmRoll)
      .cost(400, 0);
  NodeBuilder aim = AddVrm(registry, "vrmAimConstraint",
                           "Points an axis of a transform at its source, by the smallest turn from rest.",
                           "the source's worldMatrix");
  aim.in("parentMatrix", Matrix4(), {.doc = "worldMatrix of the constrained transform's parent"})
      .world_place()
      .enumeration<AimAxis>("aimAxis",
                            {{"positiveX", AimAxis::kPositiveX},
                             {"negativeX", AimAxis::kNegativeX},
                             {"positiveY", AimAxis::kPositiveY},
                             {"negativeY", AimAxis::kNegativeY},
                             {"positiveZ", AimAxis::kPositiveZ},
                             {"negativeZ", AimAxis::kNegativeZ}},
                            true, "own axis that points at the source")
      .out("outMatrix", Type::kMatrix, kVrmOutDoc)
      .compute<ComputeVrmAim>()
      .bind(BindVrmAim)
      .cost(500, 0);
  NodeBuilder rotation =
      AddVrm(registry, "vrmRotationConstraint",
             "Turns a transform from rest as its source has turned from its own.", "the source's matrix");
  rotation.structural("sourceRestMatrix", Matrix4(), {.doc = kVrmRestDoc})
      .out("outMatrix", Type::kMatrix, kVrmOutDoc)
      .compute<ComputeVrmTurn<RotationTarget>>()
      .bind(BindVrmRotation)
      .cost(300, 0);
}

}  // namespace kpsa::engine
