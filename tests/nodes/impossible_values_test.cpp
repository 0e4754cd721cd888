// Impossible values, for every number of every node type: what is not finite, or out of its range, is refused
// by the attribute's name; whatever is allowed gives numbers.
#include <cmath>
#include <limits>
#include <set>

#include "tests/nodes/driver_rig.h"
#include "tests/nodes/node_support.h"

namespace kpsa::engine {
namespace {

using Settings = std::vector<std::pair<std::string, Value>>;

std::shared_ptr<const Mesh> SmallSheet() {
  static const auto sheet = GridMesh(4, 4, [](double x, double y) { return 0.1 * x * y; });
  return sheet;
}
std::shared_ptr<const Curve> ACurve() {
  return std::make_shared<const Curve>(std::vector<Double3>{{-1, 0, 0}, {0, 0.2, 0}, {1, 0, 0}}, false);
}
std::shared_ptr<const AnimationKeys> ExampleKeys() {
  AnimationKeys::Data data;
  data.translation.times = data.weights.times = {0, 1};
  data.translation.values = {0, 0, 0, 1, 2, 3};
  data.weights.components = 1;
  data.weights.values = {0, 1};
  return std::make_shared<const AnimationKeys>(std::move(data));
}

// What a type needs to compute anything at all.
Settings NeededBy(const std::string& type) {
  const Index n = SmallSheet()->point_count();
  if (type == "mesh") return {{"mesh", SmallSheet()}};
  if (type == "curve") return {{"curve", ACurve()}};
  if (type == "wire") return {{"curve", ACurve()}, {"displacements", PointsOf({0, 0, 1, 0, 0, 1, 0, 0, 1})}};
  if (type == "clipTransform" || type == "clipWeights") return {{"keys", ExampleKeys()}};
  if (type == "layeredTransform" || type == "layeredWeights")
    return {{"keys[0]", ExampleKeys()}, {"time[0]", 0.5}, {"additive", std::vector<std::int64_t>{0}}};
  if (type.starts_with("animCurve"))
    return {{"keyTimes", std::vector<double>{0, 1}}, {"keyValues", std::vector<double>{0, 1}}};
  if (type == "poseInterpolator") return {{"poseAngles", std::vector<double>{0, 0, 0, 1, 0, 0}}};
  if (type == "weightMap")
    return {{"weights[0]", Value(std::shared_ptr<const WeightMap>(
                               std::make_shared<const WeightMap>(std::vector<float>{0, 0.5f, 1})))}};
  if (type == "combineFalloff") return {};
  if (type == "blendShape") {
    std::vector<MorphTargets::Target> targets{{"a", {1, 2}, {0, 0, 1, 0, 1, 0}}};
    return {{"targets[0]", Value(std::shared_ptr<const MorphTargets>(
                               std::make_shared<const MorphTargets>(std::move(targets), n)))},
            {"weight[0]", 0.5}};
  }
  if (type == "skinCluster") {
    std::vector<Index> offsets{0}, joints;
    for (Index p = 0; p < n; ++p) joints.push_back(0), offsets.push_back(p + 1);
    return {{"influences[0]", Value(std::shared_ptr<const Influences>(std::make_shared<const Influences>(
                                  offsets, joints, std::vector<float>(n, 1.0f), Index{1})))},
            {"matrix[0]", Matrix4()},
            {"bindPreMatrix[0]", Matrix4()}};
  }
  if (type == "uvPin" || type == "follicle") return {{type == "uvPin" ? "face[0]" : "face", 1}};
  if (type == "splineIk")
    return {{"curve", ACurve()},
            {"displacements", PointsOf({0, 0, 0, 0, 0, 0, 0, 0, 0})},
            {"inMatrix[0]", Matrix4()},
            {"inMatrix[1]", Translation({0.5, 0, 0})},
            {"tipMatrix", Translation({0.5, 0, 0})}};
  if (type == "twistDistribution")
    return {{"axis", Double3{1, 0, 0}}, {"endMatrix", Translation({1, 0, 0})}, {"inMatrix[0]", Matrix4()}};
  if (type == "ikHandle")
    return {{"inMidMatrix", Translation({0.5, 0.1, 0})},
            {"belowMatrix[0]", Translation({0.5, -0.1, 0})},
            {"target", Translation({0.8, 0.2, 0})}};
  if (type.starts_with("vrm") && type.ends_with("Constraint"))
    return {{"sourceMatrix", Translation({1, 0, 0})}};
  if (type.ends_with("Constraint") || type == "spaceSwitch")
    return {{"targetMatrix[0]", Translation({1, 0, 0})}};
  if (type == "indirectIllumination")
    return {{"width", 2},
            {"height", 2},
            {"samples", 1},
            {"bounces", 1},
            {"lightKinds", std::vector<std::int64_t>{0}},
            {"lightMatrix[0]", Translation({0, 0, 2})},
            {"lightColor[0]", Double3{1, 1, 1}}};
  return {};
}

// A node of the type on the sheet, and where it can be one, under a mesh that drives it.
struct NodeOfType {
  TestGraph g{StandardNodes()};
  const NodeDef& def;

  explicit NodeOfType(const std::string& type) : def(*StandardNodes().Find(type)) {
    g.add(type, "n", NeededBy(type));
    const auto has = [&](const char* name) { return def.FindAttribute(name) >= 0; };
    g.add("mesh", "sheet", {{"mesh", SmallSheet()}});
    if (has("inPoints")) g.connect("sheet.points", "n.inPoints[0]");
    if (has("mesh") && type != "mesh") g.hold("n.mesh[0]", SmallSheet());
    if (has("driverPoints")) {
      g.connect("sheet.points", "n.driverPoints");
      g.hold("n.driverMesh", SmallSheet());
    }
    if (type == "indirectIllumination") g.connect("sheet.points", "n.points[0]");
    if (type == "combineFalloff") {
      g.add("sphereFalloff", "f");
      g.connect("sheet.points", "f.inPoints[0]");
      g.connect("f.outputWeights[0]", "n.input1[0]");
      g.connect("f.outputWeights[0]", "n.input2[0]");
    }
  }
  // Of all outputs: "" where all are numbers; the error, or which one is none.
  std::string Evaluate() {
    for (const AttributeDef& a : def.attributes) {
      if (!a.output) continue;
      const std::string plug = "n." + a.name + (a.array ? "[0]" : "");
      const Status status = g.try_pull(plug);
      if (!status.ok()) return status.ToString();
      const std::byte* slot = reinterpret_cast<const std::byte*>(&g.evaluator->Get<double>(g.want(plug)));
      const auto finite = [](const double* numbers, std::size_t count) {
        return std::all_of(numbers, numbers + count, [](double x) { return std::isfinite(x); });
      };
      bool good = true;
      if (IsPointType(a.type)) {
        const ConstPointsView view = g.evaluator->Points(g.want(plug));
        for (const float* row : {view.x, view.y, view.z}) {
          for (std::size_t i = 0; row != nullptr && i < view.count; ++i) good = good && std::isfinite(row[i]);
        }
      } else if (a.type >= Type::kDouble) {
        good = finite(reinterpret_cast<const double*>(slot), SlotSize(a.type) / sizeof(double));
      }
      if (!good) return plug + " is not finite";
    }
    return "";
  }
};

std::vector<std::string> AllTypes() { return StandardNodes().Names(); }

bool IsNumber(const AttributeDef& a) {
  return !a.output && (a.type == Type::kInt || a.type == Type::kDouble || a.type == Type::kDouble3 ||
                       a.type == Type::kQuaternion || a.type == Type::kMatrix || a.type == Type::kDoubles);
}

// The number in every place of a value of the type.
Value Filled(Type type, double x) {
  if (type == Type::kInt) return Value(static_cast<std::int64_t>(std::clamp(x, -1e15, 1e15)));
  if (type == Type::kDouble3) return Value(Double3{x, x, x});
  if (type == Type::kQuaternion) return Value(Quaternion{x, x, x, x});
  if (type == Type::kDoubles) return Value(std::vector<double>{x, x, x});
  if (type == Type::kMatrix) {
    Matrix4 m;
    for (int i = 0; i < 3; ++i) m(i, i) = x, m(i, 3) = x;
    return Value(m);
  }
  return Value(x);
}

std::string PlugOf(const AttributeDef& a) { return "n." + a.name + (a.array ? "[0]" : ""); }

TEST(ImpossibleValues, TheExamplesEvaluate) {
  for (const std::string& type : AllTypes()) {
    if (type == "time") continue;
    EXPECT_EQ(NodeOfType(type).Evaluate(), "") << type;
  }
}

TEST(ImpossibleValues, WhatIsNotFiniteIsRefusedByName) {
  std::size_t attributes = 0;
  for (const std::string& type : AllTypes()) {
    NodeOfType n(type);
    for (const AttributeDef& a : n.def.attributes) {
      if (!IsNumber(a) || a.type == Type::kInt) continue;
      ++attributes;
      for (const double x : {std::nan(""), HUGE_VAL, -HUGE_VAL}) {
        const Status status = n.g.graph.Set(n.g.plug(PlugOf(a)), Filled(a.type, x));
        ASSERT_FALSE(status.ok()) << type << "." << a.name;
        EXPECT_NE(status.ToString().find(a.name), std::string::npos) << status.ToString();
      }
    }
  }
  EXPECT_GT(attributes, 250u);
}

TEST(ImpossibleValues, WhatIsAllowedGivesNumbersOrAnErrorThatNamesIt) {
  for (const std::string& type : AllTypes()) {
    if (type == "time") continue;
    const NodeDef& def = *StandardNodes().Find(type);
    for (const AttributeDef& a : def.attributes) {
      if (!IsNumber(a)) continue;
      for (const double x : {0.0, -1.0, 1e-12, -1e9, 1e9}) {
        SCOPED_TRACE(type + "." + a.name + " = " + std::to_string(x));
        NodeOfType n(type);
        const Status status = n.g.graph.Set(n.g.plug(PlugOf(a)), Filled(a.type, x));
        const std::string outcome = status.ok() ? n.Evaluate() : status.ToString();
        if (outcome.empty()) continue;
        EXPECT_EQ(outcome.find("is not finite"), std::string::npos) << outcome;
        EXPECT_NE(outcome.find(a.name), std::string::npos) << outcome;
      }
    }
  }
}

// At run time nobody refuses: whatever comes out, nothing breaks (sanitizers look on).
TEST(ImpossibleValues, RunThroughAtRunTime) {
  std::size_t types = 0, attributes = 0;
  for (const std::string& type : AllTypes()) {
    NodeOfType n(type);
    std::vector<const AttributeDef*> varied;
    for (const AttributeDef& a : n.def.attributes) {
      if (!IsNumber(a) || a.structural || a.lazy || a.type == Type::kInt) continue;
      n.g.vary(PlugOf(a));
      varied.push_back(&a);
    }
    if (type == "time") continue;
    EXPECT_EQ(n.Evaluate(), "") << type;
    types += varied.empty() ? 0 : 1;
    for (const AttributeDef* a : varied) {
      const Index varying = n.g.plan->FindVarying(n.g.plug(PlugOf(*a)));
      ASSERT_NE(varying, kNoIndex) << type << "." << a->name;
      ++attributes;
      const Value held = n.g.graph.FindValue(n.g.plug(PlugOf(*a))) != nullptr
                             ? *n.g.graph.FindValue(n.g.plug(PlugOf(*a)))
                             : a->default_value;
      const auto set = [&](const Value& value) {
        if (const auto* number = value.get_if<double>()) n.g.evaluator->Set(varying, *number);
        if (const auto* vector = value.get_if<Double3>()) n.g.evaluator->Set(varying, *vector);
        if (const auto* turn = value.get_if<Quaternion>()) n.g.evaluator->Set(varying, *turn);
        if (const auto* matrix = value.get_if<Matrix4>()) n.g.evaluator->Set(varying, *matrix);
      };
      for (const double x : {std::nan(""), HUGE_VAL, -HUGE_VAL, 1e300, -1e300}) {
        set(Filled(a->type, x));
        (void)n.g.evaluator->Evaluate().ok();
      }
      set(held);
      const Status status = n.g.evaluator->Evaluate();
      // And back again, but for what remembers
      EXPECT_TRUE(status.ok() || n.def.stateful) << type << "." << a->name << ": " << status.ToString();
    }
    if (!n.def.stateful) {
      EXPECT_EQ(n.Evaluate(), "") << type;
    }
  }
  EXPECT_GT(types, 75u);
  EXPECT_GT(attributes, 250u);
}

TEST(ImpossibleValues, ShapesThatAreNoShapes) {
  const auto error = [](NodeOfType& n) { return n.Evaluate(); };
  {  // a lattice without a volume
    NodeOfType n("lattice");
    n.g.hold("n.boxMin", Double3{0, 0, 0});
    n.g.hold("n.boxMax", Double3{1, 0, 1});
    EXPECT_NE(error(n).find("its box is empty: 1 x 0 x 1 m"), std::string::npos) << error(n);
    NodeOfType one("lattice");
    one.g.hold("n.boxMin", Double3{0, 0, 0});
    EXPECT_NE(error(one).find("boxMin and boxMax go together"), std::string::npos);
  }
  for (const char* type : {"deltaMush", "tension"}) {  // points without faces stay
    NodeOfType n(type);
    const auto bare = MeshOf({0, 0, 0, 1, 0, 0, 0, 1, 0}, {});
    n.g.hold("sheet.mesh", bare);
    n.g.hold("n.mesh[0]", bare);
    EXPECT_EQ(error(n), "") << type;
    EXPECT_EQ(n.g.pull_points("n.outPoints[0]"), (std::vector<float>{0, 0, 0, 1, 0, 0, 0, 1, 0})) << type;
    NodeOfType unset(type);
    ASSERT_TRUE(unset.g.graph.Unset(unset.g.plug("n.mesh[0]")).ok());
    EXPECT_NE(error(unset).find("mesh is not set"), std::string::npos) << error(unset);
  }
  for (const char* type : {"wrap", "proximityWrap", "shrinkWrap", "uvPin", "follicle", "proximityFalloff"}) {
    NodeOfType n(type);
    ASSERT_TRUE(n.g.graph.Disconnect(n.g.plug("n.driverPoints")).ok());
    EXPECT_NE(error(n).find("it has no driver"), std::string::npos) << type << error(n);
  }
  {  // poses that are one
    NodeOfType n("poseInterpolator");
    n.g.hold("n.poseAngles", std::vector<double>{1, 0, 0, 1, 0, 0});
    n.g.hold("n.poseNames", Value("a\nb"));
    EXPECT_NE(error(n).find("\"a\""), std::string::npos) << error(n);
    EXPECT_NE(error(n).find("\"b\""), std::string::npos) << error(n);
  }
}

}  // namespace
}  // namespace kpsa::engine
