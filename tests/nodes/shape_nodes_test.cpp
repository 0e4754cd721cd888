// blendShape with in-betweens and a parent, combinationShape, and the methods of skinCluster, as nodes.
#include <gtest/gtest.h>

#include <cmath>

#include "base/matrix.h"
#include "base/scalar_math.h"
#include "graph/geometry.h"
#include "tests/nodes/node_support.h"

namespace kpsa::engine {
namespace {

// Two points; `full` moves the first to x = 1, `half` to y = 1, `most` the second to z = 1.
class BlendShapeNode : public testing::Test {
 protected:
  BlendShapeNode() : g(StandardNodes()) {
    std::vector<MorphTargets::Target> targets = {
        {"full", {0}, {1, 0, 0}}, {"half", {0}, {0, 1, 0}}, {"most", {1}, {0, 0, 1}}};
    g.add("blendShape", "b",
          {{"inPoints[0]", PointsOf({0, 0, 0, 5, 5, 5})},
           {"targets[0]", std::make_shared<const MorphTargets>(targets, 2)},
           {"weight[2]", 0.0}});
  }
  void Inbetweens(std::vector<std::int64_t> targets, std::vector<std::int64_t> shapes,
                  std::vector<double> weights) {
    g.hold("b.inbetweenTarget", Value(std::move(targets)));
    g.hold("b.inbetweenShape", Value(std::move(shapes)));
    g.hold("b.inbetweenWeight", Value(std::move(weights)));
  }
  TestGraph g;
};

TEST_F(BlendShapeNode, GoesThroughItsInbetweens) {
  Inbetweens({0, 0}, {1, 2}, {0.5, 0.75});
  g.vary("b.weight[0]");
  const struct {
    double weight, full, half, most;
  } cases[] = {{0, 0, 0, 0},       {0.25, 0, 0.5, 0}, {0.5, 0, 1, 0},   {0.6, 0, 0.6, 0.4}, {0.75, 0, 0, 1},
               {0.8, 0.2, 0, 0.8}, {1, 1, 0, 0},      {1.25, 2, 0, -1}, {-0.5, 0, -1, 0}};
  for (const auto& c : cases) {
    g.pull_points("b.outPoints[0]");
    g.set("b.weight[0]", c.weight);
    ExpectPoints(g.pull_points("b.outPoints[0]"), {c.full, c.half, 0, 5, 5, 5 + c.most});
  }
}

TEST_F(BlendShapeNode, InbetweensKeepTheirOwnWeights) {
  Inbetweens({0}, {1}, {0.5});
  g.hold("b.weight[0]", 0.25);
  g.hold("b.weight[1]", 0.125);
  g.hold("b.weight[2]", 0.5);
  g.hold("b.envelope", 0.5);
  ExpectPoints(g.pull_points("b.outPoints[0]"), {0, 0.5 * 0.625, 0, 5, 5, 5.25});
}

TEST_F(BlendShapeNode, BadInbetweensAreNamed) {
  const auto message = [&] { return g.try_pull("b.outPoints[0]").ToString(); };
  const auto has = [&](const char* part) { return message().find(part) != std::string::npos; };
  Inbetweens({0}, {3}, {0.5});
  EXPECT_TRUE(has("expected numbers of targets from 0 to 2")) << message();
  Inbetweens({1}, {1}, {0.5});
  EXPECT_TRUE(has("target 1 is its own")) << message();
  Inbetweens({0}, {1}, {1});
  EXPECT_TRUE(has("a weight of 1, expected more than 0 and less than 1")) << message();
  Inbetweens({0, 0}, {1, 2}, {0.5, 0.5});
  EXPECT_TRUE(has("target 0 has two at 0.5")) << message();
  Inbetweens({0}, {1, 2}, {0.5});
  EXPECT_TRUE(has("have 1, 2 and 1 entries")) << message();
}

TEST_F(BlendShapeNode, DisplacementsTurnWithTheParent) {
  g.add("transform", "t", {{"translate", Double3{1, 2, 3}}, {"rotate", Double3{0, 0, 0.25}}});
  g.connect("t.worldMatrix", "b.parentMatrix");
  g.hold("b.weight[0]", 2.0);
  g.vary("t.rotate");
  g.pull_points("b.outPoints[0]");
  ExpectPoints(g.pull_points("b.outPoints[0]"), {2, 0, 0, 5, 5, 5});  // at rest, whatever the parent is there
  g.set("t.rotate", Double3{0, 0, 0.25 + kPi / 2});
  ExpectPoints(g.pull_points("b.outPoints[0]"), {0, 2, 0, 5, 5, 5});
  g.hold("b.space", Value("mesh"));  // the skin turns them
  g.pull_points("b.outPoints[0]");
  g.set("t.rotate", Double3{0, 0, 0.25 + kPi / 2});
  ExpectPoints(g.pull_points("b.outPoints[0]"), {2, 0, 0, 5, 5, 5});
}

TEST_F(BlendShapeNode, PointsTakeWeightsThatVary) {
  auto shares = std::make_shared<PointBuffer>(2, 1);
  shares->view().x[0] = 0.25f, shares->view().x[1] = 0.5f;
  g.hold("b.pointWeights[0]", Value(PointBufferPtr(shares)));
  g.hold("b.weight[0]", 2.0);
  g.hold("b.weight[2]", 1.0);
  ExpectPoints(g.pull_points("b.outPoints[0]"), {0.5, 0, 0, 5, 5, 5.5});
  g.hold("b.pointWeights[0]", Value(PointBufferPtr(std::make_shared<PointBuffer>(3, 1))));
  EXPECT_FALSE(g.try_pull("b.outPoints[0]").ok());
}

TEST_F(BlendShapeNode, PointsByThemselvesHaveTheBitsOfAll) {
  Inbetweens({0}, {1}, {0.5});
  g.add("transform", "t", {{"rotate", Double3{0.1, 0.2, 0.3}}});
  g.connect("t.worldMatrix", "b.parentMatrix");
  g.hold("b.weight[0]", 0.7);
  g.hold("b.weight[2]", 0.3);
  g.vary("t.rotate");
  std::vector<float> all, some;
  for (bool whole : {true, false}) {
    g.request.outputs.clear();
    g.names.clear();
    g.want("b.outPoints[0]", whole ? PointSet() : PointSet::Of({1}, 2));
    g.pull_points("b.outPoints[0]");
    g.set("t.rotate", Double3{1, 2, 3});
    (whole ? all : some) = g.pull_points("b.outPoints[0]");
  }
  ASSERT_EQ(some.size(), 3u);
  EXPECT_EQ(some, std::vector<float>(all.begin() + 3, all.end()));
}

TEST(CombinationShape, CombinesWeights) {
  TestGraph g(StandardNodes());
  g.add("combinationShape", "c",
        {{"inputWeight[0]", 0.5}, {"inputWeight[1]", 0.25}, {"inputWeight[2]", 1.0}});
  for (const char* varying : {"c.inputWeight[0]", "c.inputWeight[1]", "c.combinationMethod"}) g.vary(varying);
  EXPECT_DOUBLE_EQ(g.pull<double>("c.outputWeight"), 0.125);
  g.set("c.combinationMethod", 1);
  EXPECT_DOUBLE_EQ(g.pull<double>("c.outputWeight"), 0.25);
  g.set("c.combinationMethod", 2);
  EXPECT_DOUBLE_EQ(g.pull<double>("c.outputWeight"), 3 / (2 + 4 + 1.0));
  g.set("c.inputWeight[0]", 0.0);
  for (int method : {0, 1, 2}) {
    g.set("c.combinationMethod", method);
    EXPECT_EQ(g.pull<double>("c.outputWeight"), 0) << method;
  }
  g.set("c.inputWeight[0]", -1.0);
  EXPECT_EQ(g.pull<double>("c.outputWeight"), 0);
  g.set("c.inputWeight[0]", 1.0);
  g.set("c.inputWeight[1]", 1.0);
  for (int method : {0, 1, 2}) {
    g.set("c.combinationMethod", method);
    EXPECT_EQ(g.pull<double>("c.outputWeight"), 1) << method;
  }
}

// Two joints, the second turned by `angle` about x; three points: of the first, of both, of the second.
class SkinNode : public testing::Test {
 protected:
  SkinNode() : g(StandardNodes()) {
    g.add("skinCluster", "s",
          {{"inPoints[0]", PointsOf({0, 1, 0, 0.5f, 1, 0, 1, 1, 0})},
           {"influences[0]",
            std::make_shared<const Influences>(std::vector<Index>{0, 1, 3, 4}, std::vector<Index>{0, 0, 1, 1},
                                               std::vector<float>{1, 0.5f, 0.5f, 1}, 2)},
           {"matrix[0]", Matrix4()},
           {"matrix[1]", Matrix4()}});
    g.vary("s.matrix[1]");
  }
  std::vector<float> Turned(double angle) {
    g.pull_points("s.outPoints[0]");
    g.set("s.matrix[1]", RotationFromEuler({angle, 0, 0}, RotateOrder::kXyz));
    return g.pull_points("s.outPoints[0]");
  }
  TestGraph g;
};

TEST_F(SkinNode, DualQuaternionsKeepTheThicknessThatLinearBlendingLoses) {
  const double a = 2.5, c = std::cos(a), s = std::sin(a);
  ExpectPoints(Turned(a), {0, 1, 0, 0.5, (1 + c) / 2, s / 2, 1, c, s});
  g.hold("s.skinningMethod", Value("dualQuaternion"));
  ExpectPoints(Turned(a), {0, 1, 0, 0.5, std::cos(a / 2), std::sin(a / 2), 1, c, s});
}

TEST_F(SkinNode, BlendWeightsGoBetween) {
  const double a = 2.5, c = std::cos(a), s = std::sin(a);
  const std::vector<float> linear = Turned(a);
  g.hold("s.skinningMethod", Value("weightBlended"));
  EXPECT_EQ(Turned(a), linear);  // Maya's default
  g.hold("s.blendWeights[0]", std::make_shared<const WeightMap>(std::vector<float>{0, 0.25f, 1}));
  ExpectPoints(Turned(a), {0, 1, 0, 0.5, 0.75 * (1 + c) / 2 + 0.25 * std::cos(a / 2),
                           0.75 * s / 2 + 0.25 * std::sin(a / 2), 1, c, s});
  g.hold("s.envelope", 0.5);
  ExpectPoints(Turned(a), {0, 1, 0, 0.5, 0.5 + 0.5 * (0.75 * (1 + c) / 2 + 0.25 * std::cos(a / 2)),
                           0.5 * (0.75 * s / 2 + 0.25 * std::sin(a / 2)), 1, (1 + c) / 2, s / 2});
}

TEST_F(SkinNode, BadBlendWeightsAreNamed) {
  g.hold("s.skinningMethod", Value("weightBlended"));
  const auto message = [&](std::vector<float> weights) {
    g.hold("s.blendWeights[0]", std::make_shared<const WeightMap>(std::move(weights)));
    return g.try_pull("s.outPoints[0]").ToString();
  };
  EXPECT_NE(message({0, 1}).find("blendWeights are for 2 points, the geometry has 3"), std::string::npos);
  EXPECT_NE(message({0, 1, 2}).find("blendWeights of point 2: 2 is outside of 0 to 1"), std::string::npos);
}

}  // namespace
}  // namespace kpsa::engine
