// transform and joint: local = offsetParentMatrix . T . R(rotateOrder) . S, in Maya's sense. The rest pose or
// the clip feeds offsetParentMatrix; translate, rotate and scale are the controls on top of it.
#include "base/matrix.h"
#include "base/scalar_math.h"
#include "nodes/choices.h"
#include "nodes/deformer.h"
#include "nodes/kernels/transform_math.h"
#include "nodes/node_file.h"

namespace kpsa::engine {
namespace {

struct TransformKernel {
  RotateOrder order;
  Matrix4 rest;
  Double3 twist_axis;
};

Result<BoundKernel> BindTransform(const Binding& binding) {
  const Structural& s = binding.structural();
  TransformKernel kernel{s.choice<RotateOrder>("rotateOrder"), s.value("restMatrix").get<Matrix4>(),
                         UnitVector(s.choice<Axis>("twistAxis"))};
  return MakeBound(kernel, 0);
}

// What all outputs are computed from, the world's from a parent, too.
template <typename... More>
using LocalContext = NodeContext<In<"translate", Double3>, In<"rotate", Double3>, In<"scale", Double3>,
                                 In<"offsetParentMatrix", Matrix4>, More...>;

bool HasControls(LocalContext<> c) {
  return !(c.get<"translate">() == Double3() && c.get<"rotate">() == Double3() &&
           c.get<"scale">() == Double3{1, 1, 1});
}
Matrix4 Local(LocalContext<> c) {
  const Matrix4& offset = c.get<"offsetParentMatrix">();
  if (!HasControls(c)) return offset;
  return ComposeLocal(offset, {c.get<"translate">(), c.get<"rotate">(), c.kernel_as<TransformKernel>().order,
                               c.get<"scale">()});
}

void ComputeMatrix(LocalContext<Out<"matrix", Matrix4>> c) { c.out<"matrix">() = Local(c); }
void ComputeWorld(LocalContext<In<"parentMatrix", Matrix4>, Out<"worldMatrix", Matrix4>> c) {
  const Matrix4 &parent = c.get<"parentMatrix">(), &offset = c.get<"offsetParentMatrix">();
  c.out<"worldMatrix">() = HasControls(c) ? parent * Local(c) : parent * offset;
}
void ComputeWorldInverse(LocalContext<In<"parentMatrix", Matrix4>, Out<"worldInverseMatrix", Matrix4>> c) {
  c.out<"worldInverseMatrix">() = InverseOrIdentity(c.get<"parentMatrix">() * Local(c));
}

void ComputePose(LocalContext<Out<"poseRotate", Double3>> c) {
  const auto& kernel = c.kernel_as<TransformKernel>();
  const Quaternion q = PoseRotation(Local(c), kernel.rest);
  c.out<"poseRotate">() = EulerFromRotation(RotationFromQuaternion(q), kernel.order);
}
void ComputePoseVector(LocalContext<Out<"poseRotateVector", Double3>> c) {
  c.out<"poseRotateVector">() = RotationVector(PoseRotation(Local(c), c.kernel_as<TransformKernel>().rest));
}
void ComputePoseTranslate(LocalContext<Out<"poseTranslate", Double3>> c) {
  const Matrix4 local = Local(c);
  const Matrix4& rest = c.kernel_as<TransformKernel>().rest;
  c.out<"poseTranslate">() = {local(0, 3) - rest(0, 3), local(1, 3) - rest(1, 3), local(2, 3) - rest(2, 3)};
}
void ComputePoseScale(LocalContext<Out<"poseScale", Double3>> c) {
  const Matrix4 pose = InverseOrIdentity(c.kernel_as<TransformKernel>().rest) * Local(c);
  Double3& scale = c.out<"poseScale">();
  for (int i = 0; i < 3; ++i) scale[i] = Length(Double3{pose(0, i), pose(1, i), pose(2, i)});
}
void ComputeSwingTwist(LocalContext<Out<"swing", Double3>, Out<"twist", double>> c) {
  const auto& kernel = c.kernel_as<TransformKernel>();
  const SwingTwist parts = DecomposeSwingTwist(PoseRotation(Local(c), kernel.rest), kernel.twist_axis);
  c.out<"swing">() = RotationVector(parts.swing);
  c.out<"twist">() = TwistAngle(parts.twist, kernel.twist_axis);
}

void AddTransform(NodeRegistry& registry, const char* name, const char* doc) {
  NodeBuilder b = registry.add(name, doc);
  b.category("transform")
      .in("translate", Double3(), {.unit = Unit::kLength, .doc = "control, on top of offsetParentMatrix"})
      .in("rotate", Double3(), {.unit = Unit::kAngle, .doc = "control, applied in rotateOrder"})
      .in("scale", Double3{1, 1, 1}, {.doc = "control"})
      .enumeration<RotateOrder>("rotateOrder", kRotateOrders, true, "xyz turns about X first")
      .in("offsetParentMatrix", Matrix4(), {.doc = "the rest pose, or what the clip makes of it"})
      .in("parentMatrix", Matrix4(), {.doc = "the parent's worldMatrix"})
      .world_place()
      .structural("restMatrix", Matrix4(),
                  {.doc = "the local matrix at rest, for poseRotate, swing and twist"})
      .enumeration<Axis>("twistAxis", kAxes, true, "the axis of swing and twist")
      .out("matrix", Type::kMatrix, "local")
      .out("worldMatrix", Type::kMatrix)
      .out("worldInverseMatrix", Type::kMatrix)
      .out("poseRotate", Type::kDouble3, "rotation against rest, as angles in rotateOrder; includes the clip")
      .unit(Unit::kAngle)
      .out("poseRotateVector", Type::kDouble3, "the same as axis times angle")
      .unit(Unit::kAngle)
      .out("poseTranslate", Type::kDouble3, "translation against rest; includes the clip")
      .unit(Unit::kLength)
      .out("poseScale", Type::kDouble3, "lengths of the axes against rest; includes the clip")
      .out("swing", Type::kDouble3, "rotation vector of poseRotate without its twist")
      .unit(Unit::kAngle)
      .out("twist", Type::kDouble, "angle about twistAxis")
      .unit(Unit::kAngle);
  b.compute<ComputeMatrix>()
      .passes("offsetParentMatrix", {"translate", "rotate", "scale"})
      .bind(BindTransform)
      .cost(60, 0);
  b.compute<ComputeWorld>().bind(BindTransform).cost(70, 0);
  b.compute<ComputeWorldInverse>().bind(BindTransform).cost(150, 0);
  b.compute<ComputePose>().bind(BindTransform).cost(250, 0);
  b.compute<ComputePoseVector>().bind(BindTransform).cost(200, 0);
  b.compute<ComputePoseTranslate>().bind(BindTransform).cost(60, 0);
  b.compute<ComputePoseScale>().bind(BindTransform).cost(150, 0);
  b.compute<ComputeSwingTwist>().bind(BindTransform).cost(300, 0);
}

}  // namespace

KPSA_NODES(transform, registry) {
  AddTransform(registry, "transform", "A coordinate frame under a parent.");
  AddTransform(registry, "joint", "A transform that moves a skin.");
}

}  // namespace kpsa::engine
