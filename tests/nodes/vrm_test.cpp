// VRM's nodes against the pseudocode of its specification, in arithmetic of this test's own.
#include "nodes/kernels/matrix_parts.h"
#include "tests/nodes/node_support.h"
#include "tests/support/memory_in_use.h"

namespace kpsa::engine {
namespace {

// --- VRMC_node_constraint 1.0, "Example of Implementation" of each constraint.
using Quat = std::array<double, 4>;  // x y z w

Quat Times(const Quat& a, const Quat& b) {
  return {a[3] * b[0] + a[0] * b[3] + a[1] * b[2] - a[2] * b[1],
          a[3] * b[1] - a[0] * b[2] + a[1] * b[3] + a[2] * b[0],
          a[3] * b[2] + a[0] * b[1] - a[1] * b[0] + a[2] * b[3],
          a[3] * b[3] - a[0] * b[0] - a[1] * b[1] - a[2] * b[2]};
}
Quat Inverse(const Quat& q) { return {-q[0], -q[1], -q[2], q[3]}; }
Double3 Apply(const Quat& q, Double3 v) {
  const Quat r = Times(Times(q, {v.x, v.y, v.z, 0}), Inverse(q));
  return {r[0], r[1], r[2]};
}
Quat FromTo(Double3 from, Double3 to) {
  const Double3 c{from.y * to.z - from.z * to.y, from.z * to.x - from.x * to.z,
                  from.x * to.y - from.y * to.x};
  Quat q = {c.x, c.y, c.z, 1 + from.x * to.x + from.y * to.y + from.z * to.z};
  const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  for (double& n : q) n /= length;
  return q;
}
Quat Between(const Quat& a, Quat b, double t) {
  double dot = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3];
  if (dot < 0) dot = -dot, b = {-b[0], -b[1], -b[2], -b[3]};
  const double angle = std::acos(std::min(dot, 1.0));
  if (angle < 1e-9) return a;
  Quat q;
  for (std::size_t i = 0; i < 4; ++i)
    q[i] = (std::sin((1 - t) * angle) * a[i] + std::sin(t * angle) * b[i]) / std::sin(angle);
  return q;
}
Quat From(Quaternion q) { return {q.x, q.y, q.z, q.w}; }
Quat TurnIn(const Matrix4& m) { return From(TakeApart(m).rotation); }

Quat SpecifiedRoll(const Quat& rest, const Quat& source_rest, const Quat& source, Double3 axis) {
  const Quat delta = Times(Inverse(source_rest), source);
  const Quat in_parent = Times(Times(source_rest, delta), Inverse(source_rest));
  const Quat in_own = Times(Times(Inverse(rest), in_parent), rest);
  return Times(Times(rest, Inverse(FromTo(axis, Apply(in_own, axis)))), in_own);
}
Quat SpecifiedAim(const Quat& rest, const Quat& parent, Double3 source_place, Double3 place, Double3 axis) {
  const Double3 way = source_place - place;
  const Quat arc = FromTo(Apply(Times(parent, rest), axis), way * (1 / Length(way)));
  return Times(Times(Times(Inverse(parent), arc), parent), rest);
}
Quat SpecifiedRotation(const Quat& rest, const Quat& source_rest, const Quat& source) {
  return Times(rest, Times(Inverse(source_rest), source));
}

// The matrix of the turn with the place and the size of another.
Matrix4 Turned(const Matrix4& like, const Quat& q) {
  MatrixParts parts = TakeApart(like);
  parts.rotation = {q[0], q[1], q[2], q[3]};
  return PutTogether(parts);
}

struct Pose {
  Matrix4 rest, source_rest, source, in, parent;
  double weight;
};
Pose RandomPose(RandomFrames* random, bool full) {
  return {random->Scaled(), random->Scaled(), random->Scaled(),
          random->Scaled(), random->Scaled(), full ? 1.0 : random->Number(0.1, 0.9)};
}
Matrix4 Out(const std::string& type, const Pose& p, const std::string& axis_name = "", int axis = 0) {
  std::vector<std::pair<std::string, Value>> values = {
      {"restMatrix", p.rest}, {"sourceMatrix", p.source}, {"inMatrix", p.in}, {"weight", p.weight}};
  if (type == "vrmAimConstraint") {
    values.emplace_back("parentMatrix", p.parent);
  } else {
    values.emplace_back("sourceRestMatrix", p.source_rest);
  }
  if (!axis_name.empty()) values.emplace_back(axis_name, Value(std::int64_t{axis}));
  PosedNode node(type, values, {"inMatrix", "sourceMatrix", "weight"});
  return node.Out();
}
Double3 Axis(int i, double sign = 1) {
  Double3 axis;
  axis[i] = sign;
  return axis;
}

TEST(VrmConstraints, AreThoseOfTheSpecification) {
  RandomFrames random(20);
  for (int round = 0; round < 24; ++round) {
    const Pose p = RandomPose(&random, round % 2 == 0);
    const Quat rest = TurnIn(p.rest), source_rest = TurnIn(p.source_rest), source = TurnIn(p.source);
    const auto expected = [&](const Quat& target) { return Turned(p.in, Between(rest, target, p.weight)); };
    const int axis = round % 3;
    EXPECT_LT(Apart(Out("vrmRollConstraint", p, "rollAxis", axis),
                    expected(SpecifiedRoll(rest, source_rest, source, Axis(axis)))),
              1e-9)
        << round;
    EXPECT_LT(Apart(Out("vrmRotationConstraint", p), expected(SpecifiedRotation(rest, source_rest, source))),
              1e-9)
        << round;
    const int aim = round % 6;
    EXPECT_LT(Apart(Out("vrmAimConstraint", p, "aimAxis", aim),
                    expected(SpecifiedAim(rest, TurnIn(p.parent), PlaceIn(p.source), PlaceIn(p.parent * p.in),
                                          Axis(aim / 2, aim % 2 == 0 ? 1 : -1)))),
              1e-9)
        << round;
  }
}

TEST(VrmConstraints, RestIsKeptBitForBit) {
  RandomFrames random(21);
  Pose p = RandomPose(&random, true);
  p.source = p.source_rest, p.in = p.rest;
  EXPECT_EQ(Out("vrmRollConstraint", p), p.rest);
  EXPECT_EQ(Out("vrmRotationConstraint", p), p.rest);
  p.source = random.Scaled();
  p.in = random.Scaled();
  p.weight = 0;  // a clip's rotation gives way, its place does not
  for (const char* type : {"vrmRollConstraint", "vrmAimConstraint", "vrmRotationConstraint"})
    EXPECT_LT(Apart(Out(type, p), Turned(p.in, TurnIn(p.rest))), 1e-12) << type;
}

// What a twist joint is for: the roll of the arm, and none of its bend.
TEST(VrmConstraints, RollTakesTheTwistOnly) {
  const auto about = [](Double3 axis, double degrees) {
    return RotationFromQuaternion(
        Normalized({axis.x * std::sin(degrees * kPi / 360), axis.y * std::sin(degrees * kPi / 360),
                    axis.z * std::sin(degrees * kPi / 360), std::cos(degrees * kPi / 360)}));
  };
  Pose p = {Translation({0, 1, 0}), Matrix4(), about({1, 0, 0}, 40), Translation({0, 1, 0}), Matrix4(), 1};
  EXPECT_LT(Apart(Out("vrmRollConstraint", p), Translation({0, 1, 0}) * about({1, 0, 0}, 40)), 1e-12);
  p.source = about({0, 0, 1}, 70);
  EXPECT_LT(Apart(Out("vrmRollConstraint", p), p.rest), 1e-12);
  p.source = about({0, 0, 1}, 70) * about({1, 0, 0}, 40);
  EXPECT_LT(Apart(Out("vrmRollConstraint", p), Translation({0, 1, 0}) * about({1, 0, 0}, 40)), 1e-12);
  p.weight = 0.5;
  EXPECT_LT(Apart(Out("vrmRollConstraint", p), Translation({0, 1, 0}) * about({1, 0, 0}, 20)), 1e-12);
}

TEST(VrmConstraints, AimsWhereNothingTellsTheWay) {
  Pose p;
  p.weight = 1;
  EXPECT_EQ(Out("vrmAimConstraint", p), Matrix4());  // on top of each other
  p.source = Translation({-2, 0, 0});                // straight behind: half a turn about some other axis
  const Matrix4 out = Out("vrmAimConstraint", p);
  EXPECT_LT(Apart(AxisOf(out, 0), {-1, 0, 0}), 1e-12);
  EXPECT_NEAR(Length(AxisOf(out, 1)), 1, 1e-12);
}

// --- Expressions.
class Expressions {
 public:
  Expressions() : g(StandardNodes()) {
    g.add("vrmExpressions", "e",
          {{"weight[6]", 0.0},
           // 0 happy, 1 angry, 2 blink, 3 aa, 4 a binary blink, 5 lookUp, 6 sad without a word
           {"isBinary", Value(std::vector<std::int64_t>{0, 1, 0, 0, 1})},
           {"kind", Value(std::vector<std::int64_t>{0, 0, 1, 3, 1, 2})},
           {"overrideBlink", Value(std::vector<std::int64_t>{2, 1, 1})},
           {"overrideLookAt", Value(std::vector<std::int64_t>{0, 0, 2})},
           {"overrideMouth", Value(std::vector<std::int64_t>{2, 2})}});
    for (int i = 0; i < 7; ++i) g.vary("e.weight[" + std::to_string(i) + "]");
  }
  std::vector<double> Of(const std::vector<double>& weights) {
    for (int i = 0; i < 7; ++i) g.want("e.output[" + std::to_string(i) + "]");
    for (std::size_t i = 0; i < 7; ++i)
      g.set("e.weight[" + std::to_string(i) + "]", i < weights.size() ? weights[i] : 0.0);
    std::vector<double> outputs;
    for (int i = 0; i < 7; ++i) outputs.push_back(g.pull<double>("e.output[" + std::to_string(i) + "]"));
    return outputs;
  }
  TestGraph g;
};

void ExpectAll(const std::vector<double>& got, const std::vector<double>& expected) {
  for (std::size_t i = 0; i < got.size(); ++i)
    EXPECT_NEAR(got[i], i < expected.size() ? expected[i] : 0, 1e-15) << i;
}

TEST(VrmExpressions, HoldEachOtherBack) {
  Expressions e;
  ExpectAll(e.Of({}), {});
  ExpectAll(e.Of({0.25, 0, 0, 0, 0, 0, 0.5}), {0.25, 0, 0, 0, 0, 0, 0.5});
  ExpectAll(e.Of({0.25, 0, 0.8, 0.4}), {0.25, 0, 0.8 * 0.75, 0.4 * 0.75});  // blends
  ExpectAll(e.Of({0, 0.6, 0.8, 0.4}), {0, 1, 0, 0});        // binary: as if it were 1, which blocks
  ExpectAll(e.Of({0, 0.5, 0.8, 0.4}), {0, 0, 0.8, 0.4});    // ... or not there
  ExpectAll(e.Of({0.01, 0, 0, 0, 1}), {0.01, 0, 0, 0, 0});  // a binary one that is held back at all is off
  ExpectAll(e.Of({0, 0, 0.3, 0, 1}), {0, 0, 0.3, 0, 1});    // nobody holds back its own kind
  ExpectAll(e.Of({0, 0, 0.25, 0, 0, 1}), {0, 0, 0.25, 0, 0, 0.75});
  ExpectAll(e.Of({0.7, 1, 0, 1}), {0.7, 1, 0, 0});  // together no more than all
  ExpectAll(e.Of({7, 0, -3}), {1, 0, 0});
}

TEST(VrmExpressions, AddToMorphWeights) {
  TestGraph g(StandardNodes());
  g.add("vrmMorphWeights", "m",
        {{"weight[0]", 0.25},
         {"weight[1]", -2.0},
         {"weight[2]", 0.5},
         {"expression[1]", 0.0},
         {"targets", Value(std::vector<std::int64_t>{0, 2, 2})},
         {"expressions", Value(std::vector<std::int64_t>{0, 0, 1})},
         {"shares", Value(std::vector<double>{0.5, 1, 0.75})}});
  for (const char* plug : {"m.expression[0]", "m.expression[1]", "m.weight[2]"}) g.vary(plug);
  for (const char* plug : {"m.output[0]", "m.output[1]", "m.output[2]"}) g.want(plug);
  const auto of = [&](double first, double second, double own) {
    g.set("m.expression[0]", first);
    g.set("m.expression[1]", second);
    g.set("m.weight[2]", own);
    EXPECT_EQ(g.pull<double>("m.output[1]"), -2);  // nobody's: as it is
    return std::pair(g.pull<double>("m.output[0]"), g.pull<double>("m.output[2]"));
  };
  EXPECT_EQ(of(0, 0, 0.5), std::pair(0.25, 0.5));
  EXPECT_EQ(of(0.5, 0, 0.25), std::pair(0.5, 0.75));
  EXPECT_EQ(of(0, 1, 0), std::pair(0.25, 0.75));
  EXPECT_EQ(of(1, 1, 0.5), std::pair(0.75, 1.0));
  EXPECT_EQ(of(0, 0, -1), std::pair(0.25, 0.0));
}

// Binds are in any order; what they name beyond the mesh's targets costs nothing.
TEST(VrmExpressions, BindsAreFewHoweverFarTheirTargets) {
  const std::size_t before = MemoryInUse();
  TestGraph g(StandardNodes());
  constexpr std::int64_t kLast = (1 << 20) - 1;
  g.add("vrmMorphWeights", "m",
        {{"weight[3]", 0.125},
         {"expression[1]", 0.5},
         {"targets", Value(std::vector<std::int64_t>{kLast, 3, 0, 3})},
         {"expressions", Value(std::vector<std::int64_t>{0, 1, kLast, 0})},
         {"shares", Value(std::vector<double>{1, 0.25, 1, 1})}});
  g.vary("m.weight[3]");  // so that it is there at run time
  g.want("m.output[2]");
  g.want("m.output[3]");
  g.set("m.weight[3]", 0.25);
  EXPECT_EQ(g.pull<double>("m.output[3]"), 0.375);
  EXPECT_EQ(g.pull<double>("m.output[2]"), 0);
  EXPECT_LT(MemoryInUse(), before + (std::size_t{1} << 20));
}

TEST(VrmExpressions, RefuseListsThatMakeNoSense) {
  const auto error = [](const std::string& type, const std::vector<std::pair<std::string, Value>>& values) {
    TestGraph g(StandardNodes());
    g.add(type, "n", values);
    const Status status = g.try_pull("n.output[0]");
    return status.ok() ? "no error" : status.ToString();
  };
  const auto ints = [](std::vector<std::int64_t> list) { return Value(std::move(list)); };
  EXPECT_NE(error("vrmExpressions", {{"kind", ints({0, 4})}}).find("kind: entry 1 is 4, expected 0 to 3"),
            std::string::npos);
  EXPECT_NE(error("vrmExpressions", {{"overrideMouth", ints({-1})}}).find("overrideMouth: entry 0"),
            std::string::npos);
  EXPECT_NE(error("vrmMorphWeights", {{"targets", ints({0})}}).find("targets has 1 entries, expressions 0"),
            std::string::npos);
  EXPECT_NE(error("vrmMorphWeights", {{"targets", ints({std::int64_t{1} << 60})},
                                      {"expressions", ints({0})},
                                      {"shares", Value(std::vector<double>{1})}})
                .find("targets: entry 0"),
            std::string::npos);
}

}  // namespace
}  // namespace kpsa::engine
