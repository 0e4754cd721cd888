// What falloffs that vary do to deformers of every kind.
#include <algorithm>
#include <cmath>

#include "tests/nodes/driver_rig.h"
#include "tests/nodes/node_support.h"

namespace kpsa::engine {
namespace {

// A sheet that a matrix bends (it shears), then a deformer with a sphere that fades it, or without.
struct FadedRig {
  TestGraph g{StandardNodes()};
  std::shared_ptr<const Mesh> sheet =
      GridMesh(21, 19, [](double x, double y) { return 0.2 * std::sin(3 * x) * y; });
  int frame = 0;

  FadedRig(const std::string& type, bool faded, const std::vector<std::pair<std::string, Value>>& values) {
    g.add("mesh", "m", {{"mesh", sheet}});
    g.add("transformGeometry", "a");
    g.add(type, "d", values);
    g.hold("d.mesh[0]", sheet);
    g.connect("m.points", "a.inPoints[0]");
    g.connect("a.outPoints[0]", "d.inPoints[0]");
    g.vary("a.matrix");
    if (type == "jiggle") g.vary("d.time");
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
    if (g.graph.FindPlug("d.time").ok()) g.set("d.time", frame++ / 24.0);
  }
};

// Of all points of the sheet.
constexpr Index kSheet = 21 * 19;
Value TargetOfAll() {
  std::vector<Index> points;
  std::vector<float> deltas;
  for (Index p = 0; p < kSheet; ++p) {
    points.push_back(p);
    deltas.insert(deltas.end(), {0, 0.01f * static_cast<float>(p % 7), 0.2f});
  }
  std::vector<MorphTargets::Target> targets{{"t", points, deltas}};
  return Value(std::shared_ptr<const MorphTargets>(std::make_shared<const MorphTargets>(targets, kSheet)));
}
Value TwoJoints() {
  std::vector<Index> offsets{0}, joints;
  std::vector<float> weights;
  for (Index p = 0; p < kSheet; ++p) {
    joints.insert(joints.end(), {0, 1});
    weights.insert(weights.end(), {static_cast<float>(p % 4) / 4, 1 - static_cast<float>(p % 4) / 4});
    offsets.push_back(2 * p + 2);
  }
  return Value(std::shared_ptr<const Influences>(
      std::make_shared<const Influences>(offsets, joints, weights, Index{2})));
}
Value ALine() {
  return Value(std::shared_ptr<const Curve>(
      std::make_shared<const Curve>(std::vector<Double3>{{-1, 0, 0}, {0, 0.2, 0}, {1, 0, 0}}, false)));
}

struct FadedCase {
  const char* type;
  std::vector<std::pair<std::string, Value>> values;
  Index most;  // points that a subset of five asks for
};
const std::vector<FadedCase>& Faded() {
  static const std::vector<FadedCase> cases = {
      {"transformGeometry", {{"matrix", Translation({0.1, 0.2, 0.3})}}, 5},
      {"cluster", {{"matrix", Matrix4()}, {"bindPreMatrix", Translation({0.1, 0.3, 0.2})}}, 5},
      {"softMod",
       {{"matrix", Matrix4()}, {"bindPreMatrix", Translation({0.1, 0.3, 0.2})}, {"falloffRadius", 2.0}},
       5},
      {"bend", {{"curvature", 1.0}}, 5},
      {"twist", {{"endAngle", 1.0}}, 5},
      {"squash", {{"factor", 0.5}}, 5},
      {"flare", {{"endFlareX", 2.0}}, 5},
      {"sine", {{"amplitude", 0.2}}, 5},
      {"wave", {{"amplitude", 0.2}}, 5},
      {"sculpt", {{"radius", 0.5}}, 5},
      {"lattice",
       {{"boxMin", Double3{-3, -3, -3}},
        {"boxMax", Double3{3, 3, 3}},
        {"divisions", std::vector<std::int64_t>{2, 2, 2}},
        {"points", PointsOf({0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0, 0, 0, 1.5f, 1, 0, 1, 0, 1, 1, 1, 1, 1})}},
       5},
      {"wire",
       {{"curve", ALine()}, {"displacements", PointsOf({0, 0, 1, 0, 0, 1, 0, 0.5f, 1})}, {"dropoff", 1.5}},
       5},
      {"blendShape", {{"targets[0]", TargetOfAll()}, {"weight[0]", 0.75}}, 5},
      {"skinCluster",
       {{"influences[0]", TwoJoints()},
        {"matrix[0]", Translation({0, 0, 0.5})},
        {"matrix[1]", RotationFromEuler({0, 0.5, 0}, RotateOrder::kXyz)},
        {"bindPreMatrix[0]", Matrix4()},
        {"bindPreMatrix[1]", Matrix4()}},
       5},
      {"deltaMush", {{"iterations", 2}, {"displacement", 0.0}}, 5 * 37},
      {"tension", {{"compressScale", 0.3}, {"stretchScale", 0.2}}, 5 * 19},
      {"jiggle", {}, 5},
      {"proximityWrap", {}, 5},
      {"wrap", {}, 5},
      {"shrinkWrap", {}, 5},
  };
  return cases;
}

TEST(FalloffWeights, AreOfEveryDeformer) {
  for (const std::string& type : StandardNodes().Names()) {
    const NodeDef& def = *StandardNodes().Find(type);
    if (def.FindAttribute("falloffWeights") < 0 || def.passes_points) continue;
    EXPECT_EQ(
        std::count_if(Faded().begin(), Faded().end(), [&](const FadedCase& c) { return c.type == type; }), 1)
        << type;
  }
}

TEST(FalloffWeights, ShareWhatEveryDeformerDoes) {
  for (const auto& [type, values, most] : Faded()) {
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
  for (const auto& [type, values, most] : Faded()) {
    SCOPED_TRACE(type);
    FadedRig whole(type, true, values), part(type, true, values);
    Random random(3);
    std::vector<Index> some;
    for (int i = 0; i < 5; ++i) some.push_back(random.Below(whole.sheet->point_count()));
    const PointSet set = PointSet::Of(some, whole.sheet->point_count());
    whole.g.want("d.outPoints[0]");
    part.g.want("d.outPoints[0]", set);
    for (const double shear : {0.1, 0.3}) {
      for (FadedRig* rig : {&whole, &part}) {
        rig->Pose(shear);
        (void)rig->g.pull_points("d.outPoints[0]");
      }
    }
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
}  // namespace kpsa::engine
