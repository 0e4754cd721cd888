// splineIk and twistDistribution.
#include "graph/geometry.h"
#include "nodes/kernels/constraint_math.h"
#include "nodes/kernels/matrix_parts.h"
#include "nodes/kernels/spline_chain.h"
#include "tests/nodes/node_support.h"

namespace kpsa::engine {
namespace {

struct Chain {
  Matrix4 parent;
  std::vector<Matrix4> in;
  Matrix4 tip;
  std::vector<Double3> Places() const {  // of the joints and the end
    std::vector<Double3> places;
    Matrix4 world = parent;
    for (const Matrix4& local : in) places.push_back(PlaceIn(world = world * local));
    places.push_back(PlaceIn(world * tip));
    return places;
  }
};

Chain RandomChain(RandomFrames* random, int joints) {
  Chain chain;
  chain.parent = random->Rigid();
  for (int i = 0; i < joints; ++i) {
    Matrix4 local = random->Rigid();
    const Double3 bone{random->Number(0.1, 0.4), 0.05, 0};
    local(0, 3) = bone.x, local(1, 3) = bone.y, local(2, 3) = bone.z;
    chain.in.push_back(local);
  }
  chain.tip = Translation({0.25, 0, 0.1});
  return chain;
}

Chain Solved(const Chain& chain, const std::vector<Double3>& vertices, double start_twist = 0,
             double end_twist = 0) {
  CurveShape shape;
  shape.vertices = vertices.size();
  Chain solved = chain;
  SolveSplineChain({chain.parent, chain.in, chain.tip, shape, vertices, start_twist, end_twist}, solved.in);
  return solved;
}

const std::vector<Double3> kBow = {{0, 0, 0}, {0.6, 0.5, 0}, {1.2, 0.4, 0.5}, {1.5, -0.2, 0.9}};

TEST(SplineChain, JointsLieOnTheCurveAndBonesKeepTheirLengths) {
  RandomFrames random(50);
  CurveShape shape;
  shape.vertices = kBow.size();
  for (int i = 0; i < 20; ++i) {
    const Chain chain = RandomChain(&random, 4);
    const std::vector<Double3> before = chain.Places(), after = Solved(chain, kBow).Places();
    EXPECT_LT(Apart(after[0], kBow[0]), 1e-12);
    for (std::size_t j = 0; j < after.size(); ++j) {
      const double u = shape.Nearest(kBow, after[j]);
      EXPECT_LT(Apart(shape.Point(kBow, u), after[j]), 1e-7) << j;
      if (j == 0) continue;
      EXPECT_NEAR(Length(after[j] - after[j - 1]), Length(before[j] - before[j - 1]), 1e-12);
    }
  }
}

TEST(SplineChain, GoesStraightOnBeyondTheEnd) {
  RandomFrames random(51);
  const Chain chain = RandomChain(&random, 6);
  const std::vector<Double3> before = chain.Places();
  const std::vector<Double3> after = Solved(chain, {{1, 2, 3}, {1.3, 2, 3}}).Places();
  double x = 1;
  for (std::size_t j = 0; j < after.size(); ++j) {
    if (j > 0) x += Length(before[j] - before[j - 1]);
    EXPECT_LT(Apart(after[j], {x, 2, 3}), 1e-9) << j;
  }
}

TEST(SplineChain, TwistGoesFromStartToEnd) {
  Chain chain;  // along x
  chain.in = {Matrix4(), Translation({1, 0, 0}), Translation({1, 0, 0})};
  chain.tip = Translation({1, 0, 0});
  const Chain twisted = Solved(chain, {{0, 0, 0}, {2, 0, 0}, {4, 0, 0}}, 0.2, 0.8);
  Matrix4 world;
  for (std::size_t i = 0; i < 3; ++i) {
    world = world * twisted.in[i];
    const double angle = 0.2 + 0.3 * static_cast<double>(i);
    EXPECT_LT(Apart(world, Translation({static_cast<double>(i), 0, 0}) *
                               RotationFromEuler({angle, 0, 0}, RotateOrder::kXyz)),
              1e-12);
  }
}

TEST(SplineChain, WithoutLengthIsHarmless) {
  Chain chain;
  chain.in = {Matrix4(), Matrix4()};
  const std::vector<Double3> point = {{1, 1, 1}, {1, 1, 1}};
  for (const Chain& solved : {Solved(chain, point), Solved(chain, kBow)}) {
    for (const Matrix4& local : solved.in) EXPECT_NEAR(Determinant3(local), 1, 1e-12);
  }
}

TEST(SplineChain, MovesWithTheWorld) {
  RandomFrames random(55);
  const Chain chain = RandomChain(&random, 5);
  const Matrix4 world = random.Rigid(3);
  Chain moved = chain;
  moved.parent = world * chain.parent;
  std::vector<Double3> vertices = kBow;
  for (Double3& v : vertices) v = TransformPoint(world, v);
  const Chain before = Solved(chain, kBow, 0.3, -0.4), after = Solved(moved, vertices, 0.3, -0.4);
  for (std::size_t i = 0; i < 5; ++i) EXPECT_LT(Apart(after.in[i], before.in[i]), 1e-10) << i;
}

class SplineNode {
 public:
  SplineNode(const Chain& rest, bool maintain, const Matrix4& parent = Matrix4()) : g(StandardNodes()) {
    g.add("curve", "c");
    g.hold("c.curve", Value(std::make_shared<const class Curve>(kBow, false)));
    g.add("splineIk", "n",
          {{"maintainOffset", Value(maintain)}, {"tipMatrix", rest.tip}, {"parentMatrix", rest.parent}});
    g.hold("n.curve", Value(std::make_shared<const class Curve>(kBow, false)));
    g.connect("c.displacements", "n.displacements");
    g.connect("c.worldMatrix", "n.curveMatrix");
    g.hold("c.parentMatrix", parent);
    for (std::size_t i = 0; i < rest.in.size(); ++i)
      g.hold("n.inMatrix[" + std::to_string(i) + "]", rest.in[i]);
    for (const char* plug : {"n.parentMatrix", "n.blend", "c.cv", "c.parentMatrix", "n.endTwist"})
      g.vary(plug);
    for (std::size_t i = 0; i < rest.in.size(); ++i) g.want("n.outMatrix[" + std::to_string(i) + "]");
  }
  std::vector<Matrix4> Out(std::size_t joints) {
    std::vector<Matrix4> out;
    for (std::size_t i = 0; i < joints; ++i)
      out.push_back(g.pull<Matrix4>("n.outMatrix[" + std::to_string(i) + "]"));
    return out;
  }
  // Offsets of the curve's vertices.
  void Move(const std::vector<float>& xyz) {
    ASSERT_TRUE(g.compile().ok());
    const PointBuffer points = PointBuffer::FromInterleaved(xyz);
    ASSERT_TRUE(
        g.evaluator->SetPoints(*g.evaluator->FindVarying(g.graph, g.plug("c.cv")), points.view()).ok());
  }
  TestGraph g;
};

TEST(SplineIk, FollowsTheCurveThatMoves) {
  RandomFrames random(52);
  const Chain rest = RandomChain(&random, 3);
  SplineNode node(rest, false);
  EXPECT_EQ(node.Out(3), Solved(rest, kBow).in);
  node.Move({0, 0.5f, 0, 0, 0, 0, 0.25f, 0, 0, 0, 0, -1});
  std::vector<Double3> moved = kBow;
  moved[0].y += 0.5, moved[2].x += 0.25, moved[3].z -= 1;
  EXPECT_EQ(node.Out(3), Solved(rest, moved).in);
  node.Move(std::vector<float>(12, 0.0f));
  node.g.set("n.blend", 0.0);
  EXPECT_EQ(node.Out(3), rest.in);
  node.g.set("n.blend", 0.5);
  const std::vector<Matrix4> half = node.Out(3), whole = Solved(rest, kBow).in;
  for (std::size_t i = 0; i < 3; ++i)
    EXPECT_LT(Apart(half[i], BlendMatrices(rest.in[i], whole[i], 0.5)), 1e-14);
}

TEST(SplineIk, MaintainsTheRestBitForBitAndBendsFromThere) {
  RandomFrames random(53);
  const Chain rest = RandomChain(&random, 4);
  SplineNode node(rest, true);
  EXPECT_EQ(node.Out(4), rest.in);
  node.g.set("n.endTwist", 1e-9);
  const std::vector<Matrix4> near = node.Out(4);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_LT(Apart(near[i], rest.in[i]), 1e-8);
  // All of the curve moves: so does the chain, as a whole
  node.g.set("n.endTwist", 0.0);
  node.Move({0, 0.5f, 0, 0, 0.5f, 0, 0, 0.5f, 0, 0, 0.5f, 0});
  Chain lifted = rest;
  lifted.in = node.Out(4);
  const std::vector<Double3> before = rest.Places(), after = lifted.Places();
  for (std::size_t j = 0; j < after.size(); ++j)
    EXPECT_LT(Apart(after[j], before[j] + Double3{0, 0.5, 0}), 1e-9);
}

// The curve and the chain hang under one root: where that goes, the chain lies in it as before.
TEST(SplineIk, WalksWithTheParentOfItsCurve) {
  RandomFrames random(54);
  const std::vector<float> offsets = {0, 0.5f, 0, 0, 0, 0, 0.25f, 0, 0, 0, 0, -1};
  for (const bool maintain : {false, true}) {
    const Chain rest = RandomChain(&random, 4);
    const Matrix4 root = random.Rigid(2), walk = random.Rigid(5);
    SplineNode node(rest, maintain, root);
    node.Move(offsets);
    const std::vector<Matrix4> before = node.Out(4);
    node.g.set("c.parentMatrix", walk * root);
    const std::vector<Matrix4> alone = node.Out(4);
    node.g.set("n.parentMatrix", walk * rest.parent);
    const std::vector<Matrix4> after = node.Out(4);
    double left = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      EXPECT_LT(Apart(after[i], before[i]), 1e-6) << i;
      left = std::max(left, Apart(alone[i], before[i]));
    }
    EXPECT_GT(left, 0.1);
    // Back at rest, bit for bit
    node.Move(std::vector<float>(12, 0.0f));
    node.g.set("c.parentMatrix", root);
    node.g.set("n.parentMatrix", rest.parent);
    EXPECT_EQ(node.Out(4), maintain ? rest.in : Solved(rest, kBow).in);
  }
}

TEST(SplineIk, SaysWhatIsMissing) {
  TestGraph g(StandardNodes());
  g.add("splineIk", "n", {{"inMatrix[0]", Matrix4()}});
  EXPECT_NE(g.try_pull("n.outMatrix[0]").ToString().find("node \"n\" (splineIk): curve is not set"),
            std::string::npos);
}

class TwistNode {
 public:
  TwistNode(const Matrix4& start, const Matrix4& end, const std::vector<Matrix4>& joints,
            const std::vector<std::pair<std::string, Value>>& values = {})
      : g(StandardNodes()) {
    g.add("twistDistribution", "n", values);
    g.hold("n.startMatrix", start);
    g.hold("n.endMatrix", end);
    for (std::size_t i = 0; i < joints.size(); ++i) {
      g.hold("n.inMatrix[" + std::to_string(i) + "]", joints[i]);
      g.want("n.outMatrix[" + std::to_string(i) + "]");
    }
    g.vary("n.startMatrix");
    g.vary("n.endMatrix");
  }
  Matrix4 Out(std::size_t i) { return g.pull<Matrix4>("n.outMatrix[" + std::to_string(i) + "]"); }
  TestGraph g;
};

TEST(TwistDistribution, SharesTheTwistAlongAChain) {
  RandomFrames random(54);
  const Matrix4 start = random.Rigid();
  const std::vector<Matrix4> joints = {random.Rigid(), random.Rigid()};
  const Matrix4 end = start * random.Rigid();
  Double3 axis = PlaceIn(end) - PlaceIn(start);
  axis = axis * (1 / Length(axis));
  const auto about = [&](double angle) { return RotationFromQuaternion(AxisAngle(axis, angle)); };
  const double angle = 1.2;
  TwistNode node(start, end, joints);
  EXPECT_EQ(node.Out(0), joints[0]);
  EXPECT_EQ(node.Out(1), joints[1]);
  // The end turns about the bone, and swings besides: only its twist counts
  const Quaternion swing = AxisAngle(Perpendicular(axis, {1, 2, 3}), 0.7);
  for (const Matrix4& extra : {Matrix4(), RotationFromQuaternion(swing)}) {
    Matrix4 turned = extra * about(angle) * end;
    for (int row = 0; row < 3; ++row) turned(row, 3) = end(row, 3);
    node.g.set("n.endMatrix", turned);
    const Matrix4 first = start * node.Out(0), second = first * node.Out(1);
    const auto turn_of = [&](const Matrix4& now, const Matrix4& rest) {
      return TakeApart(now * InverseOrIdentity(rest)).rotation;
    };
    EXPECT_LT(Apart(RotationFromQuaternion(turn_of(first, start * joints[0])), about(angle / 3)), 1e-12);
    EXPECT_LT(
        Apart(RotationFromQuaternion(turn_of(second, start * joints[0] * joints[1])), about(angle * 2 / 3)),
        1e-12);
    // Joints turn about their own place
    EXPECT_EQ(PlaceIn(node.Out(0)), PlaceIn(joints[0]));
  }
  // With the world
  const Matrix4 before = node.Out(1), world = random.Rigid(4);
  Matrix4 turned = about(angle) * end;
  for (int row = 0; row < 3; ++row) turned(row, 3) = end(row, 3);
  node.g.set("n.startMatrix", world * start);
  node.g.set("n.endMatrix", world * turned);
  EXPECT_LT(Apart(node.Out(1), before), 1e-12);
}

TEST(TwistDistribution, JointsBesideEachOtherAndWeights) {
  const Matrix4 end = Translation({1, 0, 0});
  const std::vector<Matrix4> joints = {Translation({0.2, 0, 0}), Translation({0.8, 0, 0})};
  TwistNode node(Matrix4(), end, joints,
                 {{"parents", std::vector<std::int64_t>{-1, -1}}, {"weight[0]", 0.25}, {"weight[1]", -1.0}});
  node.g.set("n.endMatrix", end * RotationFromEuler({0.8, 0, 0}, RotateOrder::kXyz));
  EXPECT_LT(Apart(node.Out(0), joints[0] * RotationFromEuler({0.2, 0, 0}, RotateOrder::kXyz)), 1e-12);
  EXPECT_LT(Apart(node.Out(1), joints[1] * RotationFromEuler({-0.8, 0, 0}, RotateOrder::kXyz)), 1e-12);
}

TEST(TwistDistribution, SaysWhatIsWrong) {
  const auto error = [](const std::vector<std::pair<std::string, Value>>& values) {
    TwistNode node(Matrix4(), Matrix4(), {Matrix4()}, values);
    return node.g.try_pull("n.outMatrix[0]").ToString();
  };
  EXPECT_NE(error({}).find("startMatrix and endMatrix are at one place at rest: set the axis"),
            std::string::npos);
  EXPECT_EQ(error({{"axis", Double3{0, 2, 0}}}), "");
  EXPECT_NE(error({{"axis", Double3{0, 2, 0}}, {"parents", std::vector<std::int64_t>{0}}})
                .find("parents: entry 0 is 0, expected -1 to -1"),
            std::string::npos);
}

}  // namespace
}  // namespace kpsa::engine
