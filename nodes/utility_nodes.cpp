// Maya's small utility nodes over numbers, vectors and colours.
#include <algorithm>

#include "base/matrix.h"
#include "base/scalar_math.h"
#include "nodes/kernels/constraint_math.h"
#include "nodes/node_file.h"

namespace kpsa::engine {
namespace {

// The maximum wins where the limits are crossed.
Double3 ClampEach(Double3 v, Double3 low, Double3 high) {
  for (int i = 0; i < 3; ++i) v[i] = std::min(std::max(v[i], low[i]), high[i]);
  return v;
}

Double3 SetRange(Double3 value, Double3 low, Double3 high, Double3 old_low, Double3 old_high) {
  for (int i = 0; i < 3; ++i) {
    const double width = old_high[i] - old_low[i];
    const double t = width == 0 ? 0 : std::min(std::max((value[i] - old_low[i]) / width, 0.0), 1.0);
    value[i] = t == 1 ? high[i] : low[i] + t * (high[i] - low[i]);
  }
  return value;
}

// As UnitOrZero, but also of lengths whose squares are 0 or not finite.
Double3 UnitLength(Double3 v) {
  Double3 unit;
  return Direction(v, 0, &unit) ? unit : Double3();
}

enum class VectorOperation { kNone, kDot, kCross, kVectorMatrix, kPointMatrix };

Double3 VectorProduct(Double3 a, Double3 b, const Matrix4& matrix, VectorOperation operation,
                      bool normalize) {
  Double3 out = a;
  if (operation == VectorOperation::kDot) {
    const double dot = normalize ? Dot(UnitLength(a), UnitLength(b)) : Dot(a, b);
    return {dot, dot, dot};
  }
  if (operation == VectorOperation::kCross) out = Cross(a, b);
  if (operation == VectorOperation::kVectorMatrix) out = TransformVector(matrix, a);
  if (operation == VectorOperation::kPointMatrix) out = TransformPoint(matrix, a);
  return normalize ? UnitLength(out) : out;
}

// The smallest turn from one vector to the other; none where one of them is zero.
void ComputeAngleBetween(NodeContext<In<"vector1", Double3>, In<"vector2", Double3>, Out<"angle", double>,
                                     Out<"axis", Double3>, Out<"euler", Double3>>
                             c) {
  Double3 a, b;
  Quaternion turn;
  if (Direction(c.get<"vector1">(), 0, &a) && Direction(c.get<"vector2">(), 0, &b))
    turn = ShortestArc(a, b, Double3());
  const Double3 vector = RotationVector(turn);
  const double angle = Length(vector);
  c.out<"angle">() = angle;
  c.out<"axis">() = angle > 0 ? vector * (1 / angle) : Double3{1, 0, 0};
  c.out<"euler">() = EulerFromRotation(RotationFromQuaternion(turn), RotateOrder::kXyz);
}

}  // namespace

KPSA_NODES(utility_nodes, registry) {
  const Double3 ones{1, 1, 1};
  registry.add("clamp", "Keeps each component between a minimum and a maximum.")
      .in("input", Double3())
      .in("min", Double3())
      .in("max", ones, {.doc = "wins where it is below the minimum"})
      .out("output", Type::kDouble3)
      .compute([](Double3 input, Double3 low, Double3 high) { return ClampEach(input, low, high); });
  registry.add("setRange", "Maps each component from an old range to a new one, clamped to it.")
      .in("value", Double3())
      .in("min", Double3())
      .in("max", ones)
      .in("oldMin", Double3())
      .in("oldMax", ones, {.doc = "equal to oldMin: the result is min"})
      .out("outValue", Type::kDouble3)
      .compute([](Double3 value, Double3 low, Double3 high, Double3 old_low, Double3 old_high) {
        return SetRange(value, low, high, old_low, old_high);
      });
  registry.add("blendColors", "Mixes two colours or vectors: color1 at 1, color2 at 0.")
      .in("blender", 0.5)
      .in("color1", Double3{1, 0, 0})
      .in("color2", Double3{0, 0, 1})
      .out("output", Type::kDouble3)
      .compute([](double blender, Double3 a, Double3 b) { return a * blender + b * (1 - blender); });
  registry.add("distanceBetween", "The distance of two points, each in the space of a matrix.")
      .in("point1", Double3(), {.unit = Unit::kLength})
      .in("point2", Double3(), {.unit = Unit::kLength})
      .in("inMatrix1", Matrix4(), {.doc = "of point1, as a transform's worldMatrix"})
      .in("inMatrix2", Matrix4(), {.doc = "of point2"})
      .out("distance", Type::kDouble)
      .unit(Unit::kLength)
      .compute([](Double3 a, Double3 b, const Matrix4& of_a, const Matrix4& of_b) {
        return Length(TransformPoint(of_a, a) - TransformPoint(of_b, b));
      });
  registry.add("angleBetween", "The smallest turn from one vector to another.")
      .in("vector1", Double3{1, 0, 0})
      .in("vector2", Double3{1, 0, 0})
      .out("angle", Type::kDouble, "0 to 180 degrees; 0 where a vector is zero")
      .unit(Unit::kAngle)
      .out("axis", Type::kDouble3, "of unit length; x where there is no turn")
      .out("euler", Type::kDouble3, "the same turn as angles in the order xyz")
      .unit(Unit::kAngle)
      .compute<ComputeAngleBetween>();
  registry.add("vectorProduct", "Products of vectors, and of a vector or a point with a matrix.")
      .in("input1", Double3())
      .in("input2", Double3())
      .in("matrix", Matrix4())
      .enumeration<VectorOperation>(
          "operation",
          {{"noOperation", VectorOperation::kNone},
           {"dotProduct", VectorOperation::kDot},
           {"crossProduct", VectorOperation::kCross},
           {"vectorMatrixProduct", VectorOperation::kVectorMatrix},
           {"pointMatrixProduct", VectorOperation::kPointMatrix}},
          false, "a dot product is in every component; products with the matrix are of input1",
          VectorOperation::kDot)
      .in("normalizeOutput", false, {.doc = "unit length; for dot products the cosine of the angle"})
      .out("output", Type::kDouble3)
      .compute([](Double3 a, Double3 b, const Matrix4& matrix, VectorOperation operation, bool normalize) {
        return VectorProduct(a, b, matrix, operation, normalize);
      });
}

}  // namespace kpsa::engine
