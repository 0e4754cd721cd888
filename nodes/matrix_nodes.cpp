#include "base/matrix.h"
#include "nodes/deformer.h"
#include "nodes/standard_nodes.h"

namespace kpsa {
namespace {

Result<BoundKernel> BindOrder(const Binding& binding) {
  return MakeBound(static_cast<RotateOrder>(binding.structural().get_int("rotateOrder")), 0);
}

void ComputeDecompose(ComputeContext& c) {
  Double3 translate, scale;
  Quaternion rotation;
  DecomposeTrs(c.get<Matrix4>(0), &translate, &rotation, &scale);
  c.out_value<Double3>(0) = translate;
  c.out_value<Double3>(1) = EulerFromRotation(RotationFromQuaternion(rotation), c.kernel_as<RotateOrder>());
  c.out_value<Double3>(2) = scale;
  c.out_value<Quaternion>(3) = rotation;
}

void ComputeCompose(ComputeContext& c) {
  c.out_value<Matrix4>(0) =
      Translation(c.get<Double3>(0)) *
      (RotationFromEuler(c.get<Double3>(1), c.kernel_as<RotateOrder>()) * Scaling(c.get<Double3>(2)));
}

}  // namespace

void AddMatrixNodes(NodeRegistry& registry) {
  const std::vector<std::string> orders = {"xyz", "yzx", "zxy", "xzy", "yxz", "zyx"};
  registry.add("multMatrix", "The product of matrices, for column vectors: matrixIn[0] is applied last.")
      .category("matrix")
      .in("matrixIn", Matrix4())
      .array()
      .out("matrixSum", Type::kMatrix)
      .compute([](ArrayView<Matrix4> in) {
        Matrix4 product;
        for (std::uint32_t i = 0; i < in.size(); ++i) product = product * in[i];
        return product;
      });
  registry.add("composeMatrix", "A matrix from translation, rotation and scale.")
      .category("matrix")
      .in("inputTranslate", Double3(), {.unit = Unit::kLength})
      .in("inputRotate", Double3(), {.unit = Unit::kAngle})
      .in("inputScale", Double3{1, 1, 1})
      .enumeration("rotateOrder", orders, true)
      .out("outputMatrix", Type::kMatrix)
      .compute(&ComputeCompose)
      .bind(BindOrder);
  registry.add("decomposeMatrix", "Translation, rotation and scale of a matrix; shear is dropped.")
      .category("matrix")
      .in("inputMatrix", Matrix4())
      .enumeration("rotateOrder", orders, true)
      .out("outputTranslate", Type::kDouble3)
      .unit(Unit::kLength)
      .out("outputRotate", Type::kDouble3)
      .unit(Unit::kAngle)
      .out("outputScale", Type::kDouble3)
      .out("outputQuat", Type::kQuaternion)
      .compute(&ComputeDecompose)
      .bind(BindOrder);
}

}  // namespace kpsa
