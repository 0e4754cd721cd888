#include <limits>

#include "tests/nodes/node_support.h"

namespace kpsa::engine {
namespace {

class UtilityNodes : public testing::Test {
 protected:
  template <typename T>
  T Value1(const std::string& type, const std::vector<std::pair<std::string, Value>>& values,
           const std::string& output) {
    TestGraph g(StandardNodes());
    g.add(type, "n", values);
    return g.pull<T>("n." + output);
  }
};

TEST_F(UtilityNodes, ClampKeepsEachComponentBetweenItsLimits) {
  EXPECT_EQ(
      Value1<Double3>(
          "clamp", {{"input", Double3{-3, 0.25, 7}}, {"min", Double3{-1, 0, 1}}, {"max", Double3{1, 1, 5}}},
          "output"),
      (Double3{-1, 0.25, 5}));
  // Crossed limits: the maximum
  EXPECT_EQ(Value1<Double3>(
                "clamp", {{"input", Double3{0, 3, 9}}, {"min", Double3{4, 4, 4}}, {"max", Double3{2, 2, 2}}},
                "output"),
            (Double3{2, 2, 2}));
}

TEST_F(UtilityNodes, SetRangeMapsAndClamps) {
  EXPECT_EQ(Value1<Double3>("setRange",
                            {{"value", Double3{5, -2, 30}},
                             {"min", Double3{-1, 3, 0}},
                             {"max", Double3{1, 4, 0.1}},
                             {"oldMax", Double3{10, 10, 10}}},
                            "outValue"),
            (Double3{0, 3, 0.1}));
  EXPECT_EQ(Value1<Double3>("setRange",
                            {{"value", Double3{2, 2, 2}}, {"min", Double3{7, 8, 9}}, {"oldMax", Double3()}},
                            "outValue"),
            (Double3{7, 8, 9}));
}

TEST_F(UtilityNodes, BlendColorsTakesTheFirstAtOne) {
  const Double3 a{0.1, 0.2, 0.3}, b{4, 5, 7};
  const auto at = [&](double t) {
    return Value1<Double3>("blendColors", {{"blender", t}, {"color1", a}, {"color2", b}}, "output");
  };
  EXPECT_EQ(at(1), a);
  EXPECT_EQ(at(0), b);
  EXPECT_LT(Apart(at(0.25), {3.025, 3.8, 5.325}), 1e-15);
}

TEST_F(UtilityNodes, DistanceIsMeasuredInTheWorld) {
  EXPECT_DOUBLE_EQ(Value1<double>("distanceBetween",
                                  {{"point1", Double3{1, 2, 2}}, {"point2", Double3{1, -1, -2}}}, "distance"),
                   5);
  EXPECT_DOUBLE_EQ(Value1<double>("distanceBetween",
                                  {{"point1", Double3{1, 0, 0}},
                                   {"inMatrix1", Scaling({3, 1, 1})},
                                   {"inMatrix2", Translation({3, 0, 4})}},
                                  "distance"),
                   4);
}

TEST_F(UtilityNodes, AngleBetweenTurnsOneVectorToTheOther) {
  RandomFrames random(1);
  for (int i = 0; i < 50; ++i) {
    const Double3 a = random.Vector(), b = random.Vector(3);
    TestGraph g(StandardNodes());
    g.add("angleBetween", "n", {{"vector1", a}, {"vector2", b}});
    const double angle = g.pull<double>("n.angle");
    const Double3 axis = g.pull<Double3>("n.axis"), euler = g.pull<Double3>("n.euler");
    EXPECT_NEAR(angle, Acos(Dot(a, b) / (Length(a) * Length(b))), 1e-7);
    EXPECT_NEAR(Length(axis), 1, 1e-12);
    EXPECT_NEAR(Dot(axis, a), 0, 1e-9);
    const Double3 turned = TransformVector(RotationFromEuler(euler, RotateOrder::kXyz), a);
    EXPECT_LT(Apart(turned * (1 / Length(a)), b * (1 / Length(b))), 1e-9);
  }
  EXPECT_NEAR(Value1<double>("angleBetween", {{"vector1", Double3{0, 2, 0}}, {"vector2", Double3{0, -5, 0}}},
                             "angle"),
              kPi, 1e-12);
  EXPECT_EQ(Value1<double>("angleBetween", {{"vector1", Double3()}}, "angle"), 0);
  EXPECT_EQ(Value1<Double3>("angleBetween", {{"vector1", Double3()}}, "axis"), (Double3{1, 0, 0}));
}

TEST_F(UtilityNodes, VectorProducts) {
  const Double3 a{1, 2, 3}, b{-2, 0.5, 4};
  const Matrix4 m = Translation({1, 2, 3}) * Scaling({2, 3, 4});
  const auto product = [&](int operation, bool normalize) {
    return Value1<Double3>("vectorProduct",
                           {{"input1", a},
                            {"input2", b},
                            {"matrix", m},
                            {"operation", operation},
                            {"normalizeOutput", Value(normalize)}},
                           "output");
  };
  EXPECT_EQ(product(0, false), a);
  EXPECT_EQ(product(1, false), (Double3{11, 11, 11}));
  EXPECT_EQ(product(2, false), (Double3{6.5, -10, 4.5}));
  EXPECT_EQ(product(3, false), (Double3{2, 6, 12}));
  EXPECT_EQ(product(4, false), (Double3{3, 8, 15}));
  const double cosine = 11 / (std::sqrt(14.0) * std::sqrt(20.25));
  EXPECT_LT(Apart(product(1, true), {cosine, cosine, cosine}), 1e-15);
  for (int operation : {0, 2, 3, 4}) {
    const Double3 plain = product(operation, false), unit = product(operation, true);
    EXPECT_LT(Apart(unit, plain * (1 / Length(plain))), 1e-15) << operation;
  }
  EXPECT_EQ(Value1<Double3>("vectorProduct", {{"operation", 2}, {"normalizeOutput", Value(true)}}, "output"),
            Double3());
}

TEST_F(UtilityNodes, SetDrivenKeysKnowTheirUnit) {
  for (const char* type : {"animCurve", "animCurveUU", "animCurveUA", "animCurveUL"}) {
    EXPECT_DOUBLE_EQ(Value1<double>(type,
                                    {{"input", 0.5},
                                     {"keyTimes", std::vector<double>{0, 1, 2}},
                                     {"keyValues", std::vector<double>{1, 3, -1}}},
                                    "output"),
                     2)
        << type;
    const NodeDef& def = *StandardNodes().Find(type);
    const auto unit = [&](const char* name) {
      return def.attributes[static_cast<std::size_t>(def.FindAttribute(name))].unit;
    };
    const Unit expected = type[9] == '\0'   ? Unit::kNone
                          : type[10] == 'A' ? Unit::kAngle
                          : type[10] == 'L' ? Unit::kLength
                                            : Unit::kNone;
    EXPECT_EQ(unit("output"), expected) << type;
    EXPECT_EQ(unit("keyValues"), expected) << type;
    EXPECT_EQ(unit("input"), Unit::kNone) << type;
  }
}

// T R Sh S with what Maya calls shearXY, XZ, YZ.
Matrix4 Sheared(Double3 translation, Quaternion turn, Double3 scale, Double3 shear) {
  Matrix4 sh;
  sh(0, 1) = shear.x, sh(0, 2) = shear.y, sh(1, 2) = shear.z;
  return Translation(translation) * RotationFromQuaternion(turn) * sh * Scaling(scale);
}

TEST_F(UtilityNodes, InverseMatrix) {
  RandomFrames random(2);
  const Matrix4 m = random.Scaled();
  EXPECT_LT(Apart(Value1<Matrix4>("inverseMatrix", {{"inputMatrix", m}}, "outputMatrix") * m, Matrix4()),
            1e-14);
  EXPECT_EQ(Value1<Matrix4>("inverseMatrix", {{"inputMatrix", Scaling({1, 0, 1})}}, "outputMatrix"),
            Matrix4());
}

TEST_F(UtilityNodes, PickMatrixTakesParts) {
  RandomFrames random(3);
  const Double3 t = random.Vector(), s{2, 0.5, 1.5}, shear{0.3, -0.2, 0.7};
  const Quaternion q = random.Turn();
  for (int mask = 0; mask < 16; ++mask) {
    const auto on = [&](int bit) { return (mask >> bit & 1) != 0; };
    const Matrix4 picked = Value1<Matrix4>("pickMatrix",
                                           {{"inputMatrix", Sheared(t, q, s, shear)},
                                            {"useTranslate", Value(on(0))},
                                            {"useRotate", Value(on(1))},
                                            {"useScale", Value(on(2))},
                                            {"useShear", Value(on(3))}},
                                           "outputMatrix");
    const Matrix4 expected = Sheared(on(0) ? t : Double3(), on(1) ? q : Quaternion(),
                                     on(2) ? s : Double3{1, 1, 1}, on(3) ? shear : Double3());
    EXPECT_LT(Apart(picked, expected), 1e-14) << mask;
  }
}

TEST_F(UtilityNodes, BlendMatrixBlendsPartByPart) {
  RandomFrames random(4);
  const Matrix4 a = random.Scaled(), b = random.Scaled();
  const auto blend = [&](std::vector<std::pair<std::string, Value>> values) {
    values.insert(values.begin(), {{"inputMatrix", a}, {"targetMatrix[0]", b}});
    return Value1<Matrix4>("blendMatrix", values, "outputMatrix");
  };
  EXPECT_EQ(blend({}), b);
  EXPECT_EQ(blend({{"targetWeight[0]", 0.0}}), a);
  EXPECT_EQ(blend({{"envelope", 0.0}}), a);
  // Half way: the middle of places, half of the turn
  const Matrix4 half = blend({{"targetWeight[0]", 0.5}});
  EXPECT_LT(Apart(PlaceIn(half), (PlaceIn(a) + PlaceIn(b)) * 0.5), 1e-14);
  Double3 place, scale;
  Quaternion qa, qb, qh;
  DecomposeTrs(a, &place, &qa, &scale);
  DecomposeTrs(b, &place, &qb, &scale);
  DecomposeTrs(half, &place, &qh, &scale);
  EXPECT_NEAR(Length(RotationVector(Conjugate(qa) * qh)), 0.5 * Length(RotationVector(Conjugate(qa) * qb)),
              1e-12);
  // Only the translation
  const Matrix4 moved = blend({{"rotateWeight", 0.0}, {"scaleWeight", 0.0}, {"shearWeight", 0.0}});
  EXPECT_EQ(PlaceIn(moved), PlaceIn(b));
  for (int i = 0; i < 3; ++i) EXPECT_LT(Apart(AxisOf(moved, i), AxisOf(a, i)), 1e-14);
  // Targets are layers
  const Matrix4 c = random.Rigid();
  EXPECT_EQ(blend({{"targetMatrix[1]", c}}), c);
  EXPECT_EQ(blend({{"targetMatrix[1]", c}, {"targetWeight[1]", 0.0}}), b);
}

}  // namespace
}  // namespace kpsa::engine
