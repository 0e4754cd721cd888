#include "base/matrix.h"
#include "nodes/choices.h"
#include "nodes/deformer.h"
#include "nodes/kernels/matrix_parts.h"
#include "nodes/node_file.h"

namespace kpsa::engine {
namespace {

Result<BoundKernel> BindOrder(const Binding& binding) {
  return MakeBound(binding.structural().choice<RotateOrder>("rotateOrder"), 0);
}

void ComputeDecompose(
    NodeContext<In<"inputMatrix", Matrix4>, Out<"outputTranslate", Double3>, Out<"outputRotate", Double3>,
                Out<"outputScale", Double3>, Out<"outputQuat", Quaternion>>
        c) {
  Double3 translate, scale;
  Quaternion rotation;
  DecomposeTrs(c.get<"inputMatrix">(), &translate, &rotation, &scale);
  c.out<"outputTranslate">() = translate;
  c.out<"outputRotate">() = EulerFromRotation(RotationFromQuaternion(rotation), c.kernel_as<RotateOrder>());
  c.out<"outputScale">() = scale;
  c.out<"outputQuat">() = rotation;
}

void ComputeCompose(NodeContext<In<"inputTranslate", Double3>, In<"inputRotate", Double3>,
                                In<"inputScale", Double3>, Out<"outputMatrix", Matrix4>>
                        c) {
  c.out<"outputMatrix">() = Translation(c.get<"inputTranslate">()) *
                            (RotationFromEuler(c.get<"inputRotate">(), c.kernel_as<RotateOrder>()) *
                             Scaling(c.get<"inputScale">()));
}

using BlendMatrixContext =
    NodeContext<In<"inputMatrix", Matrix4>, In<"targetMatrix", ArrayView<Matrix4>>,
                In<"targetWeight", ArrayView<double>>, In<"envelope", double>, In<"translateWeight", double>,
                In<"rotateWeight", double>, In<"scaleWeight", double>, In<"shearWeight", double>,
                Out<"outputMatrix", Matrix4>>;

// Target after target onto the input, as layers.
void ComputeBlendMatrix(BlendMatrixContext c) {
  const ArrayView<Matrix4> targets = c.get<"targetMatrix">();
  const ArrayView<double> weights = c.get<"targetWeight">();
  Matrix4 result = c.get<"inputMatrix">();
  for (std::uint32_t i = 0; i < targets.size(); ++i) {
    const double w = (i < weights.size() ? weights[i] : 1.0) * c.get<"envelope">();
    result = BlendMatrices(result, targets[i],
                           {w * c.get<"translateWeight">(), w * c.get<"rotateWeight">(),
                            w * c.get<"scaleWeight">(), w * c.get<"shearWeight">()});
  }
  c.out<"outputMatrix">() = result;
}

Matrix4 PickMatrix(const Matrix4& m, bool translate, bool rotate, bool scale, bool shear) {
  return BlendMatrices(Matrix4(), m,
                       {translate ? 1.0 : 0.0, rotate ? 1.0 : 0.0, scale ? 1.0 : 0.0, shear ? 1.0 : 0.0});
}

}  // namespace

KPSA_NODES(matrix_nodes, registry) {
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
      .enumeration<RotateOrder>("rotateOrder", kRotateOrders, true)
      .out("outputMatrix", Type::kMatrix)
      .compute<ComputeCompose>()
      .bind(BindOrder);
  registry.add("decomposeMatrix", "Translation, rotation and scale of a matrix; shear is dropped.")
      .category("matrix")
      .in("inputMatrix", Matrix4())
      .enumeration<RotateOrder>("rotateOrder", kRotateOrders, true)
      .out("outputTranslate", Type::kDouble3)
      .unit(Unit::kLength)
      .out("outputRotate", Type::kDouble3)
      .unit(Unit::kAngle)
      .out("outputScale", Type::kDouble3)
      .out("outputQuat", Type::kQuaternion)
      .compute<ComputeDecompose>()
      .bind(BindOrder);
  registry.add("inverseMatrix", "The inverse; of a matrix that has none, the identity.")
      .category("matrix")
      .in("inputMatrix", Matrix4())
      .out("outputMatrix", Type::kMatrix)
      .compute([](const Matrix4& m) { return InverseOrIdentity(m); });
  const AttributeOptions share{.min = 0, .max = 1};
  registry.add("blendMatrix", "Blends matrices onto one another, part by part; rotations by slerp.")
      .category("matrix")
      .in("inputMatrix", Matrix4())
      .in("targetMatrix", Matrix4(), {.doc = "applied in their order, each onto what those before it gave"})
      .array()
      .in("targetWeight", 1.0, {.min = 0, .max = 1, .doc = "of the target; 1 where unset"})
      .array()
      .in("envelope", 1.0, {.min = 0, .max = 1, .doc = "of all targets"})
      .in("translateWeight", 1.0, share)
      .in("rotateWeight", 1.0, share)
      .in("scaleWeight", 1.0, share)
      .in("shearWeight", 1.0, share)
      .out("outputMatrix", Type::kMatrix)
      .compute<ComputeBlendMatrix>()
      .cost(300, 0);
  registry.add("pickMatrix", "The chosen parts of a matrix; the identity in place of the others.")
      .category("matrix")
      .in("inputMatrix", Matrix4())
      .in("useTranslate", true)
      .in("useRotate", true)
      .in("useScale", true)
      .in("useShear", true)
      .out("outputMatrix", Type::kMatrix)
      .compute([](const Matrix4& m, bool translate, bool rotate, bool scale, bool shear) {
        return PickMatrix(m, translate, rotate, scale, shear);
      });
}

}  // namespace kpsa::engine
