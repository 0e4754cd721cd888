// Deformers as nodes: what their attributes mean, on a few points.
#include <gtest/gtest.h>

#include <cmath>

#include "base/matrix.h"
#include "base/scalar_math.h"
#include "graph/compiler.h"
#include "graph/geometry.h"
#include "nodes/deformer.h"
#include "tests/nodes/driver_rig.h"
#include "tests/nodes/node_support.h"

namespace kpsa::engine {
namespace {

TEST(TensionNode, MeasuresBothWays) {
  TestGraph g(StandardNodes());
  Mesh::Data data;
  data.rest = PointBuffer::FromInterleaved(std::vector<float>{0, 0, 0, 1, 0, 0, 0, 1, 0});
  data.triangles = {0, 1, 2};
  data.vertex_to_point = {0, 1, 2};
  const auto mesh = std::make_shared<const Mesh>(std::move(data));
  g.add("mesh", "m", {{"mesh", mesh}});
  g.add("cluster", "c", {{"matrix", Matrix4()}});
  g.add("tension", "t", {{"mesh[0]", mesh}, {"compressScale", 0.5}, {"stretchScale", -0.25}});
  g.connect("m.points", "c.inPoints[0]");
  g.connect("c.outPoints[0]", "t.inPoints[0]");
  g.vary("c.matrix");
  ExpectPoints(g.pull_points("t.stretch[0]"), {0, 0, 0}, 0);
  g.pull_points("t.compress[0]");
  g.pull_points("t.outPoints[0]");
  g.set("c.matrix", Scaling({1.5, 1.5, 1.5}));
  ExpectPoints(g.pull_points("t.stretch[0]"), {0.5, 0.5, 0.5});
  ExpectPoints(g.pull_points("t.compress[0]"), {0, 0, 0}, 0);
  ExpectPoints(g.pull_points("t.outPoints[0]"), {0, 0, -0.125, 1.5, 0, -0.125, 0, 1.5, -0.125});
  g.set("c.matrix", Scaling({0.5, 0.5, 0.5}));
  ExpectPoints(g.pull_points("t.stretch[0]"), {0, 0, 0}, 0);
  ExpectPoints(g.pull_points("t.compress[0]"), {0.5, 0.5, 0.5});
  ExpectPoints(g.pull_points("t.outPoints[0]"), {0, 0, 0.25, 0.5, 0, 0.25, 0, 0.5, 0.25});
}

// A handle before the skin acts by its motion against its parent; after it, where it stands.
TEST(NonLinearNode, HandlesMoveAgainstTheirParents) {
  TestGraph g(StandardNodes());
  const Matrix4 parent = Translation({0, 1, 0}) * RotationFromEuler({0.2, 0.3, 0.4}, RotateOrder::kXyz);
  g.add("twist", "n",
        {{"inPoints[0]", PointsOf({1, 1, 0, 1, 0, 0, 1, -1, 0})},
         {"endAngle", kPi / 2},
         {"lowBound", 0.0},
         {"matrix", Matrix4()},
         {"parentMatrix", Matrix4()}});
  g.vary("n.matrix");
  g.vary("n.parentMatrix");
  const std::vector<double> rest = {0, 1, -1, 1, 0, 0, 1, -1, 0};
  ExpectPoints(g.pull_points("n.outPoints[0]"), rest);
  g.set("n.matrix", Translation({0, 1, 0}));
  ExpectPoints(g.pull_points("n.outPoints[0]"), {1, 1, 0, 1, 0, 0, 1, -1, 0});
  g.hold("n.space", Value("mesh"));
  g.pull_points("n.outPoints[0]");
  g.set("n.matrix", parent);
  g.set("n.parentMatrix", parent);
  ExpectPoints(g.pull_points("n.outPoints[0]"), rest);
  g.set("n.matrix", parent * Translation({0, -1, 0}));
  ExpectPoints(g.pull_points("n.outPoints[0]"), {0, 1, -1, 0, 0, -1, 1, -1, 0});
}

TEST(WireNode, FollowsSeveralCurves) {
  TestGraph g(StandardNodes());
  const auto left = std::make_shared<const Curve>(std::vector<Double3>{{-1, -1, 0}, {-1, 1, 0}}, false);
  const auto right = std::make_shared<const Curve>(std::vector<Double3>{{1, -1, 0}, {1, 1, 0}}, false);
  g.add("curve", "l", {{"curve", left}, {"cv", PointsOf({0, 0, 1, 0, 0, 1})}});
  g.add("curve", "r", {{"curve", right}, {"cv", PointsOf({0, 0, 4, 0, 0, 4})}});
  g.add("wire", "w",
        {{"inPoints[0]", PointsOf({-1, 0, 0, 0, 0, 0, 1, 0, 0, 3, 0, 0})},
         {"baseWire[0]", left},
         {"baseWire[1]", right},
         {"dropoff", 2.0},
         {"dropoffDistance[1]", 1.5}});
  EXPECT_NE(g.try_pull("w.outPoints[0]").ToString().find("deformedWire has 0 elements for 2 curves"),
            std::string::npos);
  g.connect("l.displacements", "w.deformedWire[0]");
  g.connect("r.displacements", "w.deformedWire[1]");
  const double a = 0.5, b = 1 - 4 / 9.0 * (3 - 4 / 3.0);  // of the point in the middle
  const std::vector<float> blended = g.pull_points("w.outPoints[0]");
  ExpectPoints(blended, {-1, 0, 1, 0, 0, (a * a + 4 * b * b) / (a + b), 1, 0, 4, 3, 0, 0});
  g.hold("w.crossingEffect", 1.0);
  ExpectPoints(g.pull_points("w.outPoints[0]"), {-1, 0, 1, 0, 0, a + 4 * b, 1, 0, 4, 3, 0, 0});
}

// A row of points along s, in a box from 0 to 1; every control of a slice s is raised by 1 along y.
std::vector<float> Raised(std::int64_t divisions, int slice, const char* interpolation, const char* outside,
                          const std::vector<double>& places) {
  TestGraph g(StandardNodes());
  std::vector<float> xyz;
  for (double x : places) xyz.insert(xyz.end(), {static_cast<float>(x), 0.5f, 0.5f});
  g.add("lattice", "l",
        {{"inPoints[0]", PointsOf(xyz)},
         {"divisions", std::vector<std::int64_t>{divisions, 2, 2}},
         {"localInfluence", std::vector<std::int64_t>{3, 2, 2}},
         {"interpolation", interpolation},
         {"outside", outside},
         {"outsideFalloffDist", 0.5},
         {"boxMin", Double3{0, 0, 0}},
         {"boxMax", Double3{1, 1, 1}}});
  for (std::int64_t c = 0; c < 4 * divisions; ++c) {
    if (slice >= 0 && c % divisions != slice) continue;
    g.hold("l.points[" + std::to_string(c) + "].y", 1.0 + static_cast<double>(c / divisions % 2));
  }
  const std::vector<float> points = g.pull_points("l.outPoints[0]");
  std::vector<float> raised;
  for (std::size_t i = 1; i < points.size(); i += 3) raised.push_back(points[i] - 0.5f);
  return raised;
}

TEST(LatticeNode, InterpolatesLocallyOrOverAllControls) {
  const std::vector<double> places = {0.25, 0.5, 0.75};
  ExpectPoints(Raised(3, 1, "linear", "inside", places), {0.5, 1, 0.5});
  ExpectPoints(Raised(3, 1, "bernstein", "inside", places), {0.375, 0.5, 0.375});
  ExpectPoints(Raised(3, 1, "bspline", "inside", places), {0.375, 0.5, 0.375});  // as many as its order
  // Of four controls, a quadratic B-spline has a knot in the middle: beyond it, the first ends
  ExpectPoints(Raised(4, 0, "bspline", "inside", places), {0.25, 0, 0});
  ExpectPoints(Raised(4, 1, "bspline", "inside", places), {0.625, 0.5, 0.125});
  ExpectPoints(Raised(4, 0, "bernstein", "inside", places), {27 / 64.0, 1 / 8.0, 1 / 64.0});
}

TEST(LatticeNode, PointsOutsideStayFollowOrFade) {
  const std::vector<double> places = {-0.125, 0.5, 1.25, 1.5, 9};
  ExpectPoints(Raised(2, -1, "linear", "inside", places), {0, 1, 0, 0, 0});
  ExpectPoints(Raised(2, -1, "linear", "all", places), {1, 1, 1, 1, 1});
  ExpectPoints(Raised(2, -1, "linear", "falloff", places), {0.75, 1, 0.5, 0, 0});
  ExpectPoints(Raised(2, 1, "linear", "all", places), {0, 0.5, 1, 1, 1});  // as the nearest place of the box
}

// A point above the middle of a square of border points, three of them at a distance of 1 and one at 3.
class DeltaMushNode : public testing::Test {
 protected:
  DeltaMushNode() : g(StandardNodes()) {
    Mesh::Data data;
    data.rest =
        PointBuffer::FromInterleaved(std::vector<float>{0, 0, 0, 1, 0, 0, 0, 1, 0, -1, 0, 0, 0, -3, 0});
    data.triangles = {0, 1, 2, 0, 2, 3, 0, 3, 4, 0, 4, 1};
    for (Index i = 0; i < 5; ++i) data.vertex_to_point.push_back(i);
    const auto mesh = std::make_shared<const Mesh>(std::move(data));
    g.add("mesh", "m", {{"mesh", mesh}});
    g.add("cluster", "c");
    g.add("deltaMush", "d", {{"mesh[0]", mesh}, {"iterations", 1}, {"smoothingStep", 1.0}});
    g.connect("m.points", "c.inPoints[0]");
    g.connect("c.outPoints[0]", "d.inPoints[0]");
    g.vary("c.matrix");
  }
  // Where the middle and the last point are, the shape turned by a right angle about z.
  std::vector<float> Turned() {
    g.pull_points("d.outPoints[0]");
    g.set("c.matrix", RotationFromEuler({0, 0, kPi / 2}, RotateOrder::kXyz));
    const std::vector<float> p = g.pull_points("d.outPoints[0]");
    return {p[0], p[1], p[2], p[12], p[13], p[14]};
  }
  TestGraph g;
};

// What the compiler says that `count` points in the middle of a grid cost.
double PriceOfMush(int iterations, Index count) {
  TestGraph g(StandardNodes());
  const auto mesh = GridMesh(30, 30, [](double, double) { return 0.0; });
  g.add("mesh", "m", {{"mesh", mesh}});
  g.add("cluster", "c");
  g.add("deltaMush", "d", {{"mesh[0]", mesh}, {"iterations", iterations}});
  g.connect("m.points", "c.inPoints[0]");
  g.connect("c.outPoints[0]", "d.inPoints[0]");
  g.vary("c.matrix");
  const Index total = 30 * 30;
  std::vector<Index> points;
  for (Index i = 0; i < count; ++i) points.push_back(count == total ? i : 14 * 30 + 5 + i);  // off borders
  g.want("d.outPoints[0]", PointSet::Of(points, total));
  const auto plan = Compiler().Compile(g.graph, g.request);
  EXPECT_TRUE(plan.ok()) << plan.status().ToString();
  for (Index s = 0; s < (*plan)->steps().size(); ++s) {
    if (std::string_view((*plan)->step_name(s)) == "d")
      return static_cast<double>((*plan)->infos()[s].cost_ns);
  }
  return 0;
}

TEST(DeltaMushPrice, OfAFewPointsIsThatOfAllThatSmoothAroundThem) {
  const double one = PriceOfMush(10, 1), none = PriceOfMush(0, 1), all = PriceOfMush(10, 900);
  EXPECT_GT(one, 2 * none);  // ten rings
  EXPECT_GT(10 * one, all);  // not a thousandth of it
  EXPECT_LT(2 * one, all);
  EXPECT_LT(PriceOfMush(10, 20), 4 * one);  // they share rings
}

TEST_F(DeltaMushNode, DisplacementTurnsWithTheSurface) {
  ExpectPoints(Turned(), {0, 0, 0, 3, 0, 0});  // the whole detail: a turned rest shape
  g.hold("d.displacement", 0.0);
  ExpectPoints(Turned(), {0.5, 0, 0, 3, 0, 0});  // the mean of the border is (0, -0.5, 0) at rest
  g.hold("d.displacement", 0.5);
  ExpectPoints(Turned(), {0.25, 0, 0, 3, 0, 0});
  g.hold("d.envelope", 0.5);
  ExpectPoints(Turned(), {0.125, 0, 0, 3, 0, 0});
}

TEST_F(DeltaMushNode, NearNeighboursWeighMore) {
  g.hold("d.displacement", 0.0);
  g.hold("d.distanceWeight", 1.0);  // 1, 1, 1 and 1/3 of 10/3: the mean is y = (1 - 1) / (10/3)
  ExpectPoints(Turned(), {0, 0, 0, 3, 0, 0});
  g.hold("d.distanceWeight", 0.5);
  ExpectPoints(Turned(), {0.25, 0, 0, 3, 0, 0});
}

TEST_F(DeltaMushNode, BordersStayWhereTheyArePinned) {
  g.hold("d.displacement", 0.0);
  g.hold("d.pinBorderVertices", Value(false));
  // The last point's neighbours are the middle and two of the corners
  ExpectPoints(Turned(), {0.5, 0, 0, 0, 0, 0});
  g.hold("d.pinBorderVertices", Value(true));
  ExpectPoints(Turned(), {0.5, 0, 0, 3, 0, 0});
}

// What a kernel takes in memory is no time.
TEST(DeformerKernels, CostWhatTheirNodesSay) {
  struct Large {
    double numbers[40] = {};
  };
  const BoundKernel made = MakeBound(Large(), 3, 5);
  EXPECT_EQ(made.cost_ns, 0) << "the group's";
  EXPECT_EQ(made.touched_points, kNoIndex);
  EXPECT_EQ(made.object_bytes, sizeof(Large));
  EXPECT_EQ(made.scratch_floats, 3u);
  EXPECT_EQ(made.state_bytes, 5u);
}

}  // namespace
}  // namespace kpsa::engine
