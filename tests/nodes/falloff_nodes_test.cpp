// Falloffs that vary.
#include <cmath>
#include <functional>
#include <tuple>

#include "base/triangle_tree.h"
#include "tests/nodes/driver_rig.h"
#include "tests/nodes/node_support.h"

namespace kpsa::engine {
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

TEST(FalloffNodes, ThereMayBeAPlateau) {
  const auto wall = MeshOf({0, -9, -9, 0, 9, -9, 0, 0, 9}, {0, 1, 2});
  for (const char* type : {"sphereFalloff", "capsuleFalloff", "proximityFalloff"}) {
    SCOPED_TRACE(type);
    FalloffNode f(type, {{"curve", "linear"}}, {"radius", "fullRadius"});
    if (type == std::string("proximityFalloff")) {
      f.g.add("mesh", "wall", {{"mesh", wall}});
      f.g.connect("wall.points", "f.driverPoints");
      f.g.hold("f.driverMesh", wall);
    }
    f.Expect([](double x) { return std::max(0.0, 1 - std::fabs(x)); });
    f.g.set("f.fullRadius", 0.5);
    f.Expect([](double x) { return std::clamp((1 - std::fabs(x)) / 0.5, 0.0, 1.0); });
    f.g.set("f.radius", 2.5);
    f.Expect([](double x) { return std::clamp((2.5 - std::fabs(x)) / 2, 0.0, 1.0); });
    for (const double full : {0.75, 7.0}) {  // no less than the radius: a step there
      f.g.set("f.radius", 0.75);
      f.g.set("f.fullRadius", full);
      f.Expect([](double x) { return std::fabs(x) <= 0.75 ? 1.0 : 0.0; });
    }
    f.g.set("f.radius", -1.0);  // what drives it may say so
    f.g.set("f.fullRadius", -2.0);
    f.Expect([](double x) { return x == 0 ? 1.0 : 0.0; });
  }
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

// A sheet that bends, a cage that moves, and a falloff of any type, `f`, over the sheet.
struct WeighedRig {
  TestGraph g{StandardNodes()};
  std::shared_ptr<const Mesh> sheet = GridMesh(21, 19, [](double x, double y) { return x * y; });
  std::shared_ptr<const Mesh> cage =
      GridMesh(8, 9, [](double x, double y) { return 0.3 * std::sin(5 * x + y); });

  explicit WeighedRig(const std::string& type) {
    for (const auto& [mesh, moved, points] :
         {std::tuple("sheet", "a", sheet), std::tuple("cage", "lift", cage)}) {
      g.add("mesh", mesh, {{"mesh", points}});
      g.add("transformGeometry", moved);
      g.connect(std::string(mesh) + ".points", std::string(moved) + ".inPoints[0]");
      g.vary(std::string(moved) + ".matrix");
    }
    if (type == "combineFalloff") {
      Add("p", "sphereFalloff");
      Add("q", "weightMap");
      g.add(type, "f");
      g.connect("p.outputWeights[0]", "f.input1[0]");
      g.connect("q.outputWeights[0]", "f.input2[0]");
    } else {
      Add("f", type);
    }
  }
  void Add(const std::string& name, const std::string& type) {
    g.add(type, name);
    if (type == "weightMap") {
      std::vector<float> weights;
      for (Index p = 0; p < sheet->point_count(); ++p) weights.push_back(static_cast<float>(p % 37) / 36);
      g.hold(name + ".weights[0]", std::make_shared<const WeightMap>(std::move(weights)));
      g.vary(name + ".multiplier");
      return;
    }
    g.connect("a.outPoints[0]", name + ".inPoints[0]");
    g.vary(name + (type == "planeFalloff" ? ".end" : ".radius"));
    if (type == "capsuleFalloff") g.hold(name + ".endMatrix", Translation({1, 0.5, 0}));
    if (type != "proximityFalloff") return;
    g.connect("lift.outPoints[0]", name + ".driverPoints");
    g.hold(name + ".driverMesh", cage);
  }
  void Pose(double angle) {
    g.set("a.matrix", Translation({0.1, 0, angle}) * RotationFromEuler({0, 0, angle}, RotateOrder::kXyz) *
                          Scaling({1, 1.5, 0.8}));
    g.set("lift.matrix", Translation({0, angle, 0.2}) * RotationFromEuler({angle, 0, 0}, RotateOrder::kXyz));
  }
  Index PointsOf(const std::string& node) const {
    Index most = 0;
    for (Index s = 0; s < g.plan->steps().size(); ++s) {
      if (node == g.plan->step_name(s)) most = std::max(most, g.plan->infos()[s].points);
    }
    return most;
  }
};

TEST(FalloffNodes, ProximityIsTheLeastDistanceToAnyTriangle) {
  WeighedRig rig("proximityFalloff");
  rig.g.hold("f.radius", 0.9);
  rig.g.hold("f.fullRadius", 0.2);
  // Another geometry that it weighs: as if it were alone
  rig.g.connect("sheet.points", "f.inPoints[1]");
  for (const char* output :
       {"sheet.points", "a.outPoints[0]", "lift.outPoints[0]", "f.outputWeights[0]", "f.outputWeights[1]"})
    rig.g.want(output);
  const std::vector<Index>& triangles = rig.cage->data().triangles;
  std::vector<std::vector<float>> results[2];
  for (const bool parallel : {false, true}) {
    rig.g.options.parallel = parallel;
    rig.g.plan = nullptr;
    for (const double angle : {0.0, 0.3, -1.2}) {
      rig.Pose(angle);
      const std::vector<float> driver = rig.g.pull_points("lift.outPoints[0]");
      const PointBuffer moved = PointBuffer::FromInterleaved(driver);
      for (const int element : {0, 1}) {
        const std::vector<float> points = rig.g.pull_points(element == 0 ? "a.outPoints[0]" : "sheet.points"),
                                 weights =
                                     rig.g.pull_points("f.outputWeights[" + std::to_string(element) + "]");
        ASSERT_EQ(3 * weights.size(), points.size());
        int between = 0;
        for (std::size_t i = 0; i < weights.size(); ++i) {
          double least = HUGE_VAL;
          for (std::size_t t = 0; t < triangles.size(); t += 3) {
            const Double3 p{points[3 * i], points[3 * i + 1], points[3 * i + 2]};
            least = std::min(least, ClosestOnTriangle(moved.view(), &triangles[t], p).squared);
          }
          ASSERT_NEAR(weights[i], Smooth(1 - (std::sqrt(least) - 0.2) / 0.7), 1e-6) << element << " " << i;
          between += weights[i] > 0 && weights[i] < 1;
        }
        EXPECT_GT(between, 50);
        results[parallel].push_back(weights);
      }
    }
  }
  EXPECT_EQ(results[0], results[1]);
}

TEST(FalloffNodes, AParentCarriesItsDriverFromBeforeTheSkinToo) {
  WeighedRig rig("proximityFalloff");
  rig.g.hold("f.parentMatrix", Translation({0, 3, 0}));
  rig.g.hold("f.driverMatrix", Translation({0, 0, 0.25}));
  rig.g.hold("f.geometryMatrix[0]", Scaling({1, 1, 0.5}));
  rig.g.vary("f.parentMatrix");
  rig.g.want("f.outputWeights[0]");
  rig.Pose(0.2);
  const std::vector<float> rest = rig.g.pull_points("f.outputWeights[0]");
  EXPECT_GT(*std::max_element(rest.begin(), rest.end()), 0.5f);
  rig.g.set("f.parentMatrix", Translation({9, -2, 1}) *
                                  RotationFromEuler({0.4, 0.5, 1.1}, RotateOrder::kXyz) *
                                  Translation({0, 3, 0}));
  const std::vector<float> moved = rig.g.pull_points("f.outputWeights[0]");
  for (std::size_t i = 0; i < rest.size(); ++i) ASSERT_NEAR(moved[i], rest[i], 1e-5) << i;
  // Points in the world stay where they are, and the driver goes
  ASSERT_TRUE(rig.g.graph.Unset(rig.g.plug("f.geometryMatrix[0]")).ok());
  rig.g.plan = nullptr;
  rig.Pose(0.2);
  const std::vector<float> here = rig.g.pull_points("f.outputWeights[0]");
  EXPECT_GT(*std::max_element(here.begin(), here.end()), 0.5f);
  rig.g.set("f.parentMatrix", Translation({0, 90, 0}));
  const std::vector<float> gone = rig.g.pull_points("f.outputWeights[0]");
  EXPECT_EQ(*std::max_element(gone.begin(), gone.end()), 0);
}

TEST(FalloffNodes, WeighTheDemandedPointsOnly) {
  std::size_t types = 0;
  for (const std::string& type : StandardNodes().Names()) {
    if (StandardNodes().Find(type)->FindAttribute("outputWeights") < 0) continue;
    SCOPED_TRACE(type);
    ++types;
    WeighedRig whole(type), part(type);
    Random random(3);
    std::vector<Index> some;
    for (int i = 0; i < 40; ++i) some.push_back(random.Below(whole.sheet->point_count()));
    const PointSet set = PointSet::Of(some, whole.sheet->point_count());
    whole.g.want("f.outputWeights[0]");
    part.g.want("f.outputWeights[0]", set);
    for (const double angle : {0.1, -0.6}) {
      for (WeighedRig* rig : {&whole, &part}) {
        const auto set_if = [&](const char* name, const auto& value) {
          if (rig->g.graph.FindPlug(name).ok()) rig->g.set(name, value);
        };
        ASSERT_TRUE(rig->g.compile().ok());
        const auto reaches = [&](const char* name) { return rig->PointsOf(name) > 0; };
        if (reaches("a")) rig->g.set("a.matrix", Translation({0, angle, 0.5 * angle}));
        if (reaches("lift")) rig->g.set("lift.matrix", Translation({angle, 0, 0}));
        for (const char* name : {"f.multiplier", "q.multiplier", "p.radius", "f.radius", "f.end"})
          set_if(name, 1.2 + angle);
      }
      const std::vector<float> all = whole.g.pull_points("f.outputWeights[0]"),
                               few = part.g.pull_points("f.outputWeights[0]");
      ASSERT_EQ(all.size(), whole.sheet->point_count());
      ASSERT_EQ(few.size(), set.size());
      EXPECT_GT(*std::max_element(few.begin(), few.end()), 0);
      for (Index i = 0; i < set.size(); ++i) EXPECT_EQ(few[i], all[set[i]]) << i;
    }
    // Sufficient it was; and no more
    EXPECT_EQ(part.PointsOf("f"), set.size());
    EXPECT_EQ(part.PointsOf("a"), type == "weightMap" ? 0 : set.size());
    EXPECT_EQ(part.PointsOf("lift"), type == "proximityFalloff" ? part.cage->point_count() : 0);
    for (const char* one : {"p", "q"})
      EXPECT_EQ(part.PointsOf(one), type == "combineFalloff" ? set.size() : 0);
  }
  EXPECT_EQ(types, 6u);
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

}  // namespace
}  // namespace kpsa::engine
