// Falloffs that vary, and what they do to deformers of every kind.
#include <cmath>
#include <functional>

#include "tests/nodes/driver_rig.h"
#include "tests/nodes/node_support.h"

namespace kpsa {
namespace {

double Smooth(double t) {
  t = std::clamp(t, 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

// Weights of points along x under one falloff.
class FalloffNode {
 public:
  FalloffNode(const std::string& type, const std::vector<std::pair<std::string, Value>>& values,
              const std::vector<std::string>& varying)
      : g(StandardNodes()) {
    g.add(type, "f", values);
    std::vector<float> xyz;
    for (const double x : kPlaces) xyz.insert(xyz.end(), {static_cast<float>(x), 0, 0});
    g.hold("f.inPoints[0]", PointsOf(xyz));
    for (const std::string& name : varying) g.vary("f." + name);
  }
  void Expect(const std::function<double(double)>& weight) {
    std::vector<double> expected;
    for (const double x : kPlaces) expected.push_back(weight(x));
    ExpectPoints(g.pull_points("f.outputWeights[0]"), expected);
  }
  static constexpr double kPlaces[] = {-2, -1, -0.5, 0, 0.25, 0.75, 1, 3};
  TestGraph g;
};

TEST(FalloffNodes, ASphereMovesGrowsAndStretches) {
  FalloffNode f("sphereFalloff", {{"curve", "linear"}}, {"matrix", "radius"});
  f.Expect([](double x) { return std::max(0.0, 1 - std::fabs(x)); });
  f.g.set("f.radius", 2.0);
  f.Expect([](double x) { return std::max(0.0, 1 - std::fabs(x) / 2); });
  f.g.set("f.matrix", Translation({1, 0, 0}) * RotationFromEuler({0, 0, 1}, RotateOrder::kXyz));
  f.Expect([](double x) { return std::max(0.0, 1 - std::fabs(x - 1) / 2); });
  f.g.set("f.matrix", Scaling({0.25, 9, 9}));
  f.Expect([](double x) { return std::max(0.0, 1 - std::fabs(x) / 0.5); });
  f.g.set("f.matrix", Matrix4());
  f.g.set("f.radius", 0.0);
  f.Expect([](double x) { return x == 0 ? 1.0 : 0.0; });
  f.g.set("f.matrix", Scaling({0, 1, 1}));
  f.Expect([](double) { return 0.0; });
  FalloffNode smooth("sphereFalloff", {}, {});
  smooth.Expect([](double x) { return Smooth(1 - std::fabs(x)); });
}

TEST(FalloffNodes, ACapsuleLiesBetweenItsEnds) {
  FalloffNode f("capsuleFalloff", {{"curve", "linear"}, {"radius", 0.5}}, {"startMatrix", "endMatrix"});
  f.g.want("f.outputWeights[0]");
  f.g.set("f.startMatrix", Translation({0, 0.25, 0}));
  f.g.set("f.endMatrix", Translation({1, 0.25, 0}));
  f.Expect([](double x) { return std::max(0.0, 1 - std::hypot(std::max({0.0, -x, x - 1}), 0.25) / 0.5); });
  f.g.set("f.endMatrix", Translation({0, 0.25, 0}));  // a sphere
  f.Expect([](double x) { return std::max(0.0, 1 - std::hypot(x, 0.25) / 0.5); });
}

TEST(FalloffNodes, APlaneFallsAlongItsAxis) {
  const Matrix4 along_x = RotationFromEuler({0, 0, -kPi / 2}, RotateOrder::kXyz);  // y to x
  FalloffNode f("planeFalloff", {{"curve", "linear"}, {"matrix", along_x}}, {"start", "end"});
  f.g.want("f.outputWeights[0]");
  f.Expect([](double x) { return std::clamp(1 - x, 0.0, 1.0); });
  f.g.set("f.start", 1.0);
  f.g.set("f.end", -1.0);
  f.Expect([](double x) { return std::clamp((x + 1) / 2, 0.0, 1.0); });
  f.g.set("f.end", 1.0);
  f.g.set("f.start", 0.5);
  f.g.set("f.end", 0.5);
  f.Expect([](double x) { return x <= 0.5 ? 1.0 : 0.0; });
}

TEST(FalloffNodes, ProximityFollowsItsMesh) {
  FalloffNode f("proximityFalloff", {{"curve", "linear"}, {"radius", 1.0}}, {});
  EXPECT_NE(f.g.try_pull("f.outputWeights[0]").ToString().find("it has no driver"), std::string::npos);
  const auto wall = MeshOf({0, -9, -9, 0, 9, -9, 0, 0, 9}, {0, 1, 2});
  f.g.add("mesh", "wall", {{"mesh", wall}});
  f.g.add("transformGeometry", "move");
  f.g.connect("wall.points", "move.inPoints[0]");
  f.g.connect("move.outPoints[0]", "f.driverPoints");
  f.g.hold("f.driverMesh", wall);
  f.g.vary("move.matrix");
  f.g.vary("f.radius");
  f.Expect([](double x) { return std::max(0.0, 1 - std::fabs(x)); });
  f.g.set("move.matrix", Translation({0.75, 0, 0}));
  f.Expect([](double x) { return std::max(0.0, 1 - std::fabs(x - 0.75)); });
  f.g.set("f.radius", 0.0);
  f.Expect([](double x) { return x == 0.75 ? 1.0 : 0.0; });
  f.g.hold("f.driverMesh", MeshOf({0, 0, 0, 1, 0, 0, 0, 1, 0}, {}));
  EXPECT_NE(f.g.try_pull("f.outputWeights[0]").ToString().find("has no faces"), std::string::npos);
}

TEST(FalloffNodes, AMapIsMultipliedAndCut) {
  TestGraph g(StandardNodes());
  g.add("weightMap", "m");
  EXPECT_NE(g.try_pull("m.outputWeights[0]").ToString().find("weights are not set"), std::string::npos);
  g.hold("m.weights[0]", std::make_shared<const WeightMap>(std::vector<float>{0, 0.25f, 1, 0.5f}));
  g.vary("m.multiplier");
  ExpectPoints(g.pull_points("m.outputWeights[0]"), {0, 0.25, 1, 0.5}, 0);
  g.set("m.multiplier", 2.0);
  ExpectPoints(g.pull_points("m.outputWeights[0]"), {0, 0.5, 1, 1}, 0);
  g.set("m.multiplier", -1.0);
  ExpectPoints(g.pull_points("m.outputWeights[0]"), {0, 0, 0, 0}, 0);
}

TEST(FalloffNodes, TwoAreCombined) {
  TestGraph g(StandardNodes());
  g.add("weightMap", "a",
        {{"weights[0]", Value(std::shared_ptr<const WeightMap>(
                            std::make_shared<const WeightMap>(std::vector<float>{0, 0.25f, 1, 0.5f})))}});
  g.add("weightMap", "b",
        {{"weights[0]", Value(std::shared_ptr<const WeightMap>(std::make_shared<const WeightMap>(
                            std::vector<float>{1, 0.5f, 0.75f, 0.125f})))}});
  g.add("combineFalloff", "c");
  g.connect("a.outputWeights[0]", "c.input1[0]");
  g.connect("b.outputWeights[0]", "c.input2[0]");
  g.vary("c.operation");
  const std::vector<std::vector<double>> expected = {{0, 0.125, 0.75, 0.0625}, {1, 0.5, 1, 0.5},
                                                     {0, 0.25, 0.75, 0.125},   {1, 0.75, 1, 0.625},
                                                     {0, 0, 0.25, 0.375},      {0.5, 0.375, 0.875, 0.3125}};
  for (std::size_t how = 0; how < expected.size(); ++how) {
    g.want("c.outputWeights[0]");
    g.set("c.operation", static_cast<int>(how));
    ExpectPoints(g.pull_points("c.outputWeights[0]"), expected[how], 0);
  }
  // The other side has as many points
  g.hold("b.weights[0]", std::make_shared<const WeightMap>(std::vector<float>{1, 1}));
  EXPECT_FALSE(g.try_pull("c.outputWeights[0]").ok());
}

TEST(FalloffNodes, BeforeTheSkinPointsAreWhereTheirParentHasTakenThem) {
  FalloffNode f("sphereFalloff", {{"curve", "linear"}, {"geometryMatrix[0]", Translation({0, 0, 0.5})}},
                {"parentMatrix", "matrix"});
  f.Expect([](double x) { return std::max(0.0, 1 - std::hypot(x, 0.5)); });
  f.g.set("f.parentMatrix", Translation({1, 0, 0}));
  f.Expect([](double x) { return std::max(0.0, 1 - std::hypot(x + 1, 0.5)); });
  f.g.set("f.matrix", Translation({1, 0, 0.5}));  // both together
  f.Expect([](double x) { return std::max(0.0, 1 - std::fabs(x)); });
}

// A sheet that a matrix bends (it shears), then a deformer with a sphere that fades it, or without.
struct FadedRig {
  TestGraph g{StandardNodes()};
  std::shared_ptr<const Mesh> sheet =
      GridMesh(21, 19, [](double x, double y) { return 0.2 * std::sin(3 * x) * y; });

  FadedRig(const std::string& type, bool faded, const std::vector<std::pair<std::string, Value>>& values) {
    g.add("mesh", "m", {{"mesh", sheet}});
    g.add("transformGeometry", "a");
    g.add(type, "d", values);
    g.hold("d.mesh[0]", sheet);
    g.connect("m.points", "a.inPoints[0]");
    g.connect("a.outPoints[0]", "d.inPoints[0]");
    g.vary("a.matrix");
    if (g.graph.def(g.plug("d.envelope").node).FindAttribute("driverPoints") >= 0) {
      const auto cage = GridMesh(9, 9, [](double, double) { return 0.1; });
      g.add("mesh", "cage", {{"mesh", cage}});
      g.add("transformGeometry", "lift", {{"matrix", Translation({0, 0, 0.4})}});
      g.connect("cage.points", "lift.inPoints[0]");
      g.connect("lift.outPoints[0]", "d.driverPoints");
      g.hold("d.driverMesh", cage);
      g.hold("lift.matrix", Matrix4());
      g.vary("lift.matrix");
    }
    if (!faded) return;
    g.add("sphereFalloff", "f", {{"matrix", Translation({0.2, 0.1, 0})}});
    g.connect("a.outPoints[0]", "f.inPoints[0]");
    g.connect("f.outputWeights[0]", "d.falloffWeights[0]");
    g.vary("f.radius");
  }
  void Pose(double shear) {
    Matrix4 m = RotationFromEuler({0.3, 0.2, shear}, RotateOrder::kXyz);
    m(0, 1) += shear, m(2, 0) += 0.5 * shear;
    g.set("a.matrix", m);
    if (g.graph.FindPlug("lift.matrix").ok()) g.set("lift.matrix", Translation({0, 0, shear}));
  }
};

struct FadedCase {
  const char* type;
  std::vector<std::pair<std::string, Value>> values;
  Index most;  // points that a subset of five asks for
};
const std::vector<FadedCase> kFaded = {
    {"cluster", {{"matrix", Matrix4()}, {"bindPreMatrix", Translation({0.1, 0.3, 0.2})}}, 5},
    {"bend", {{"curvature", 1.0}}, 5},
    {"sculpt", {{"radius", 0.5}}, 5},
    {"deltaMush", {{"iterations", 2}, {"displacement", 0.0}}, 5 * 37},
    {"tension", {{"compressScale", 0.3}, {"stretchScale", 0.2}}, 5 * 19},
    {"proximityWrap", {}, 5},
    {"wrap", {}, 5},
};

TEST(FalloffWeights, ShareWhatEveryDeformerDoes) {
  for (const auto& [type, values, most] : kFaded) {
    SCOPED_TRACE(type);
    FadedRig faded(type, true, values), plain(type, false, values);
    for (const char* output : {"d.outPoints[0]", "a.outPoints[0]", "f.outputWeights[0]"})
      faded.g.want(output);
    plain.g.want("d.outPoints[0]");
    double moved = 0;
    for (const double shear : {0.2, -0.4}) {
      faded.Pose(shear);
      plain.Pose(shear);
      for (const double radius : {0.6, 1.4}) {
        faded.g.set("f.radius", radius);
        const std::vector<float> out = faded.g.pull_points("d.outPoints[0]"),
                                 in = faded.g.pull_points("a.outPoints[0]"),
                                 weights = faded.g.pull_points("f.outputWeights[0]"),
                                 whole = plain.g.pull_points("d.outPoints[0]");
        ASSERT_EQ(3 * weights.size(), out.size());
        std::size_t zeros = 0, between = 0;
        for (std::size_t i = 0; i < out.size(); ++i) {
          const float w = weights[i / 3];
          zeros += w == 0, between += w > 0 && w < 1;
          if (w == 0) {
            ASSERT_EQ(out[i], in[i]);
          } else if (w == 1) {
            ASSERT_EQ(out[i], whole[i]);
          } else {
            ASSERT_NEAR(out[i], in[i] + w * (double{whole[i]} - in[i]), 1e-6);
          }
          moved = std::max(moved, std::fabs(double{out[i]} - in[i]));
        }
        EXPECT_GT(between, 100u);
        EXPECT_EQ(zeros > 100u, radius < 1);
      }
    }
    EXPECT_GT(moved, 2e-3);
    // A sphere of which all points are the middle, and none
    faded.g.set("f.radius", 1e9);
    const std::vector<float> all = faded.g.pull_points("d.outPoints[0]"),
                             whole = plain.g.pull_points("d.outPoints[0]");
    for (std::size_t i = 0; i < all.size(); ++i) ASSERT_NEAR(all[i], whole[i], 1e-6);
    faded.g.set("f.radius", 0.0);
    EXPECT_EQ(faded.g.pull_points("d.outPoints[0]"), faded.g.pull_points("a.outPoints[0]"));
  }
}

TEST(FalloffWeights, OfTheDemandedPointsOnly) {
  for (const auto& [type, values, most] : kFaded) {
    SCOPED_TRACE(type);
    FadedRig whole(type, true, values), part(type, true, values);
    Random random(3);
    std::vector<Index> some;
    for (int i = 0; i < 5; ++i) some.push_back(random.Below(whole.sheet->point_count()));
    const PointSet set = PointSet::Of(some, whole.sheet->point_count());
    whole.g.want("d.outPoints[0]");
    part.g.want("d.outPoints[0]", set);
    for (FadedRig* rig : {&whole, &part}) rig->Pose(0.3);
    const std::vector<float> all = whole.g.pull_points("d.outPoints[0]"),
                             few = part.g.pull_points("d.outPoints[0]");
    ASSERT_EQ(few.size(), 3 * std::size_t{set.size()});
    for (Index i = 0; i < set.size(); ++i) {
      for (std::size_t k = 0; k < 3; ++k)
        EXPECT_EQ(few[3 * std::size_t{i} + k], all[3 * std::size_t{set[i]} + k]);
    }
    Index weighed = 0, came = 0;
    for (Index s = 0; s < part.g.plan->steps().size(); ++s) {
      const Index points = part.g.plan->infos()[s].points;
      if (part.g.plan->step_name(s) == std::string("f")) weighed = std::max(weighed, points);
      if (part.g.plan->step_name(s) == std::string("a")) came = std::max(came, points);
    }
    EXPECT_EQ(weighed, set.size());
    EXPECT_GE(came, set.size());
    EXPECT_LE(came, most);
  }
}

}  // namespace
}  // namespace kpsa
