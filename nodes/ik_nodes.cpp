// ikHandle: two bones reach for a target. poleVectorConstraint: places its pole by weighted targets.
#include <utility>

#include "nodes/constraint_node.h"
#include "nodes/deformer.h"
#include "nodes/kernels/matrix_parts.h"
#include "nodes/kernels/two_bone_ik.h"
#include "nodes/node_file.h"

namespace kpsa::engine {
namespace {

using IkContext =
    NodeContext<In<"target", Matrix4>, In<"poleVector", Matrix4>, In<"twist", double>, In<"blend", double>,
                In<"inStartMatrix", Matrix4>, In<"inMidMatrix", Matrix4>, In<"parentMatrix", Matrix4>,
                In<"betweenMatrix", ArrayView<Matrix4>>, In<"belowMatrix", ArrayView<Matrix4>>,
                Out<"startMatrix", Matrix4>, Out<"midMatrix", Matrix4>>;
using PoleContext = NodeContext<In<"targetMatrix", ArrayView<Matrix4>>, In<"targetWeight", ArrayView<double>>,
                                In<"inMatrix", Matrix4>, In<"blend", double>, Out<"outMatrix", Matrix4>>;

struct IkKernel {
  TwoBoneRest rest;
  bool has_pole = false;
  Double3 end_from_target;  // the end's place in the target's axes
};

// The arm as the matrices below say.
struct Arm {
  Matrix4 above_mid;  // world matrix of the middle joint's parent
  TwoBonePose pose;
};

Arm ArmOf(const Matrix4& parent, const Matrix4& start, const Matrix4& between, const Matrix4& mid,
          const Matrix4& below) {
  const Matrix4 world = parent * start;
  Arm arm;
  arm.above_mid = world * between;
  const Matrix4 mid_world = arm.above_mid * mid;
  arm.pose = {PlaceOf(world), PlaceOf(mid_world), PlaceOf(mid_world * below), TakeApart(world).rotation};
  return arm;
}

Result<Matrix4> RestProduct(const Structural& s, std::string_view name) {
  Matrix4 product;
  for (int i = 0; i < s.array_size(name); ++i) {
    const Value* value = s.rest(name, i);
    if (value == nullptr || value->get_if<Matrix4>() == nullptr)
      return Status::Invalid("{}[{}] has no value at rest", name, i);
    product = product * value->get<Matrix4>();
  }
  return product;
}

Matrix4 ProductOf(ArrayView<Matrix4> matrices) {
  Matrix4 product;
  for (std::uint32_t i = 0; i < matrices.size(); ++i) product = product * matrices[i];
  return product;
}

Result<BoundKernel> BindIk(const Binding& binding) {
  const Structural& s = binding.structural();
  Matrix4 rest[7];
  const char* const names[7] = {"inStartMatrix", "inMidMatrix", "parentMatrix", "betweenMatrix",
                                "belowMatrix",   "target",      "poleVector"};
  for (int i = 0; i < 7; ++i) {
    Result<Matrix4> matrix = i == 3 || i == 4 ? RestProduct(s, names[i]) : RestMatrix(s, names[i]);
    if (!matrix.ok()) return matrix.status();
    rest[i] = *matrix;
  }
  const bool maintain = s.get_bool("maintainOffset");
  const Arm arm = ArmOf(rest[2], rest[0], rest[3], rest[1], rest[4]);
  IkKernel kernel;
  kernel.has_pole = s.is_set("poleVector");
  kernel.rest = BindTwoBones(
      arm.pose, kernel.has_pole ? std::optional<Double3>(PlaceOf(rest[6])) : std::nullopt, maintain);
  if (maintain) {
    Matrix4 inverse;
    if (!Invert(rest[5], &inverse))
      return Status::Invalid("target is singular at rest, so that no offset can be maintained");
    kernel.end_from_target = TransformPoint(inverse, arm.pose.end);
  }
  return MakeBound(std::move(kernel), 0);
}

// `local` turned in the world about its own place.
Matrix4 TurnLocal(const Matrix4& local, const Matrix4& parent, Quaternion turn) {
  if (turn == Quaternion()) return local;
  Matrix4 turned = InverseOrIdentity(parent) * (RotationFromUnit(turn) * (parent * local));
  for (int row = 0; row < 3; ++row) turned(row, 3) = local(row, 3);
  return turned;
}

void ComputeIk(IkContext c) {
  const auto& k = c.kernel_as<IkKernel>();
  const Matrix4 &start = c.get<"inStartMatrix">(), &mid = c.get<"inMidMatrix">(),
                &parent = c.get<"parentMatrix">();
  const double blend = c.get<"blend">();
  c.out<"startMatrix">() = start;
  c.out<"midMatrix">() = mid;
  if (blend == 0) return;
  const Arm arm =
      ArmOf(parent, start, ProductOf(c.get<"betweenMatrix">()), mid, ProductOf(c.get<"belowMatrix">()));
  TwoBoneGoal goal;
  goal.place = TransformPoint(c.get<"target">(), k.end_from_target);
  if (k.has_pole) goal.pole = PlaceOf(c.get<"poleVector">());
  goal.twist = c.get<"twist">();
  const TwoBoneTurns turns = SolveTwoBones(arm.pose, k.rest, goal);
  c.out<"startMatrix">() = BlendMatrices(start, TurnLocal(start, parent, turns.start), blend);
  c.out<"midMatrix">() = BlendMatrices(mid, TurnLocal(mid, arm.above_mid, turns.mid), blend);
}

// poleVectorConstraint: the offset is a place in the target's axes.
struct PoleKernel {
  bool maintain = false;
  Matrix4 in;
  std::vector<Matrix4> targets;
  std::vector<Double3> offsets;
};

Result<BoundKernel> BindPole(const Binding& binding) {
  const Structural& s = binding.structural();
  PoleKernel kernel;
  kernel.maintain = s.get_bool("maintainOffset");
  Result<Matrix4> in = RestMatrix(s, "inMatrix");
  if (!in.ok()) return in.status();
  kernel.in = *in;
  for (int i = 0; i < s.array_size("targetMatrix"); ++i) {
    const Value* target = s.rest("targetMatrix", i);
    if (target == nullptr || target->get_if<Matrix4>() == nullptr)
      return Status::Invalid("targetMatrix[{}] has no value at rest", i);
    kernel.targets.push_back(target->get<Matrix4>());
    Matrix4 inverse;
    if (kernel.maintain && !Invert(kernel.targets.back(), &inverse))
      return Status::Invalid("targetMatrix[{}] is singular at rest, so that no offset can be maintained", i);
    kernel.offsets.push_back(kernel.maintain ? TransformPoint(inverse, PlaceOf(kernel.in)) : Double3());
  }
  return MakeBound(std::move(kernel), 0);
}

void ComputePole(PoleContext c) {
  const auto& k = c.kernel_as<PoleKernel>();
  const ArrayView<Matrix4> targets = c.get<"targetMatrix">();
  const ArrayView<double> weights = c.get<"targetWeight">();
  const Matrix4& in = c.get<"inMatrix">();
  const double blend = c.get<"blend">();
  c.out<"outMatrix">() = in;
  Double3 sum;
  double total = 0;
  bool at_rest = k.maintain && in == k.in;
  for (std::uint32_t i = 0; i < targets.size(); ++i) {
    const double weight = i < weights.size() ? weights[i] : 1.0;
    sum = sum + TransformPoint(targets[i], k.offsets[i]) * weight;
    total += weight;
    at_rest = at_rest && targets[i] == k.targets[i];
  }
  if (blend == 0 || !(total > 0) || at_rest) return;
  c.out<"outMatrix">() = BlendMatrices(in, Translation(sum * (1 / total)), blend);
}

}  // namespace

KPSA_NODES(ik_nodes, registry) {
  registry
      .add("ikHandle",
           "Turns a start and a middle joint so that an end joint gets to a target. In rigs: `start`, `mid` "
           "and `end` name the joints; those in between move with their bone.")
      .category("constraint")
      .in("target", Matrix4(), {.doc = "world matrix whose place the end goes to"})
      .in("poleVector", Matrix4(),
          {.doc = "world matrix whose place the middle points at; unset: the bend stays in its plane"})
      .in("twist", 0.0, {.unit = Unit::kAngle, .doc = "about the line from start to target"})
      .in("blend", 1.0, {.min = 0, .max = 1, .doc = "0: the matrices below, 1: the solution"})
      .in("inStartMatrix", Matrix4(), {.doc = "the start's local matrix below: of the clip or the rest pose"})
      .in("inMidMatrix", Matrix4(), {.doc = "the middle's local matrix below"})
      .in("parentMatrix", Matrix4(), {.doc = "worldMatrix of the start's parent"})
      .world_place()
      .in("betweenMatrix", Matrix4(), {.doc = "local matrices of the joints between start and middle"})
      .array()
      .in("belowMatrix", Matrix4(), {.doc = "local matrices of the joints below the middle, the end's last"})
      .array()
      .structural("maintainOffset", false,
                  {.doc = "keeps how the end lies to the target, and the bend to the pole, at rest"})
      .out("startMatrix", Type::kMatrix, "local, for the start's offsetParentMatrix")
      .out("midMatrix", Type::kMatrix, "local, for the middle's offsetParentMatrix")
      .compute<ComputeIk>()
      .bind(BindIk)
      .cost(1000, 0);
  registry
      .add("poleVectorConstraint",
           "Places the pole of an ikHandle by targets. In rigs: `constrained` names the handle.")
      .category("constraint")
      .in("targetMatrix", Matrix4(), {.doc = "world matrices; `targets:` connects them"})
      .array()
      .in("targetWeight", 1.0, {.min = 0, .doc = "of the target; 1 where unset. All 0: no constraint"})
      .array()
      .in("inMatrix", Matrix4(), {.doc = "the pole below"})
      .in("blend", 1.0, {.min = 0, .max = 1, .doc = "0: inMatrix, 1: the constraint"})
      .structural("maintainOffset", false, {.doc = "keeps how inMatrix lies to the targets at rest"})
      .out("outMatrix", Type::kMatrix, "world, for an ikHandle's poleVector")
      .compute<ComputePole>()
      .bind(BindPole)
      .cost(100, 0);
}

}  // namespace kpsa::engine
