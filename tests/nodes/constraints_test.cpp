#include <limits>

#include "nodes/kernels/matrix_parts.h"
#include "tests/nodes/node_support.h"

namespace kpsa::engine {
namespace {

const std::vector<std::string> kTransformConstraints = {
    "pointConstraint", "orientConstraint", "parentConstraint", "scaleConstraint", "aimConstraint"};

struct Situation {
  std::vector<Matrix4> targets;
  Matrix4 in, parent;
};

class ConstraintNode : public PosedNode {
 public:
  ConstraintNode(const std::string& type, const Situation& rest,
                 std::vector<std::pair<std::string, Value>> values = {})
      : PosedNode(type, Rest(rest, std::move(values)), Varying(rest)) {}
  void Now(const Situation& now) {
    for (std::size_t i = 0; i < now.targets.size(); ++i)
      PosedNode::Now("targetMatrix[" + std::to_string(i) + "]", now.targets[i]);
    PosedNode::Now("inMatrix", now.in);
    PosedNode::Now("parentMatrix", now.parent);
  }
  Matrix4 At(const Situation& now) {
    Now(now);
    return Out();
  }

 private:
  static std::vector<std::pair<std::string, Value>> Rest(const Situation& rest,
                                                         std::vector<std::pair<std::string, Value>> values) {
    for (std::size_t i = 0; i < rest.targets.size(); ++i)
      values.emplace_back("targetMatrix[" + std::to_string(i) + "]", rest.targets[i]);
    values.emplace_back("inMatrix", rest.in);
    values.emplace_back("parentMatrix", rest.parent);
    return values;
  }
  static std::vector<std::string> Varying(const Situation& rest) {
    std::vector<std::string> names = {"inMatrix", "parentMatrix"};
    for (std::size_t i = 0; i < rest.targets.size(); ++i)
      names.push_back("targetMatrix[" + std::to_string(i) + "]");
    return names;
  }
};

Situation RandomSituation(RandomFrames* random, std::size_t targets) {
  Situation s;
  for (std::size_t i = 0; i < targets; ++i) s.targets.push_back(random->Rigid(2));
  s.in = random->Scaled();
  s.parent = random->Rigid();
  return s;
}

Matrix4 Rotation(const Matrix4& m) { return RotationFromQuaternion(TakeApart(m).rotation); }
Double3 Scale(const Matrix4& m) { return TakeApart(m).scale; }

TEST(PointConstraint, GoesToTheWeightedPlaceAndKeepsItsAxes) {
  RandomFrames random(10);
  const Situation s = RandomSituation(&random, 2);
  ConstraintNode node("pointConstraint", s, {{"targetWeight[0]", 1.0}, {"targetWeight[1]", 3.0}});
  const Matrix4 out = node.At(s);
  EXPECT_LT(Apart(PlaceIn(s.parent * out), PlaceIn(s.targets[0]) * 0.25 + PlaceIn(s.targets[1]) * 0.75),
            1e-14);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(AxisOf(out, i), AxisOf(s.in, i));
}

TEST(PointConstraint, MaintainsTheOffsetInTheParentsAxes) {
  RandomFrames random(11);
  const Situation rest = RandomSituation(&random, 1);
  ConstraintNode node("pointConstraint", rest, {{"maintainOffset", Value(true)}});
  Situation now = rest;
  const Double3 move{0.25, -1, 3};
  now.targets[0] = Translation(move) * now.targets[0];
  EXPECT_LT(Apart(PlaceIn(rest.parent * node.At(now)), PlaceIn(rest.parent * rest.in) + move), 1e-13);
}

TEST(OrientConstraint, TurnsAsTheTarget) {
  RandomFrames random(12);
  const Situation s = RandomSituation(&random, 1);
  ConstraintNode node("orientConstraint", s);
  const Matrix4 out = node.At(s);
  EXPECT_LT(Apart(Rotation(s.parent * Rotation(out)), Rotation(s.targets[0])), 1e-13);
  EXPECT_EQ(PlaceIn(out), PlaceIn(s.in));
  EXPECT_LT(Apart(Scale(out), Scale(s.in)), 1e-13);
}

TEST(OrientConstraint, MixesOnTheShortestWay) {
  Situation s;
  const auto about_z = [](double degrees) {
    return RotationFromEuler({0, 0, degrees * kPi / 180}, RotateOrder::kXyz);
  };
  s.targets = {about_z(170), about_z(-150)};  // 40 degrees apart across 180
  for (int interp : {0, 1}) {
    ConstraintNode node("orientConstraint", s, {{"interpType", interp}});
    EXPECT_LT(Apart(node.At(s), about_z(190)), 1e-12) << interp;
  }
  ConstraintNode quarter("orientConstraint", s, {{"targetWeight[0]", 3.0}, {"targetWeight[1]", 1.0}});
  EXPECT_LT(Apart(quarter.At(s), about_z(180)), 1e-12);
}

TEST(ParentConstraint, WithOneTargetIsRigidParenting) {
  RandomFrames random(13);
  for (int i = 0; i < 20; ++i) {
    const Situation rest = RandomSituation(&random, 1);
    ConstraintNode node("parentConstraint", rest, {{"maintainOffset", Value(true)}});
    Situation now = rest;
    now.targets[0] = random.Rigid(3), now.parent = random.Rigid();
    const Matrix4 world = now.parent * node.At(now);
    const Matrix4 expected = now.targets[0] * InverseOrIdentity(rest.targets[0]) * rest.parent * rest.in;
    EXPECT_LT(Apart(world, expected), 1e-12);
  }
}

TEST(ParentConstraint, GoesFromTargetToTarget) {
  RandomFrames random(14);
  const Situation rest = RandomSituation(&random, 2);
  Situation now = rest;
  now.targets = {random.Rigid(), random.Rigid()};
  const auto at = [&](double a, double b) {
    ConstraintNode node("parentConstraint", rest,
                        {{"maintainOffset", Value(true)}, {"targetWeight[0]", a}, {"targetWeight[1]", b}});
    return node.At(now);
  };
  const auto alone = [&](std::size_t i) {
    ConstraintNode node("parentConstraint", {{rest.targets[i]}, rest.in, rest.parent},
                        {{"maintainOffset", Value(true)}});
    return node.At({{now.targets[i]}, now.in, now.parent});
  };
  EXPECT_LT(Apart(at(1, 0), alone(0)), 1e-13);
  EXPECT_LT(Apart(at(0, 2), alone(1)), 1e-13);
  EXPECT_LT(Apart(at(1, 1), BlendMatrices(alone(0), alone(1), 0.5)), 1e-12);
}

TEST(ScaleConstraint, ScalesAsTheTargets) {
  RandomFrames random(15);
  Situation s = RandomSituation(&random, 2);
  s.parent = s.parent * Scaling({2, 2, 2});
  s.targets = {s.targets[0] * Scaling({1, 2, 3}), s.targets[1] * Scaling({4, 4, 4})};
  ConstraintNode node("scaleConstraint", s, {{"targetWeight[1]", 3.0}});
  const Matrix4 out = node.At(s);
  EXPECT_LT(Apart(Scale(out), {3.25 / 2, 3.5 / 2, 3.75 / 2}), 1e-13);
  EXPECT_LT(Apart(Rotation(out), Rotation(s.in)), 1e-13);
  EXPECT_EQ(PlaceIn(out), PlaceIn(s.in));

  const Situation rest = RandomSituation(&random, 1);
  ConstraintNode kept("scaleConstraint", rest, {{"maintainOffset", Value(true)}});
  Situation now = rest;
  now.targets[0] = now.targets[0] * Scaling({2, 1, 0.5});
  const Double3 own = Scale(rest.in);
  EXPECT_LT(Apart(Scale(kept.At(now)), {own.x * 2, own.y, own.z * 0.5}), 1e-13);
}

TEST(AimConstraint, AxesAreOrthonormalAndPointAtTheTarget) {
  RandomFrames random(16);
  for (int type = 0; type < 5; ++type) {
    for (int i = 0; i < 10; ++i) {
      Situation s = RandomSituation(&random, 1);
      s.in = random.Rigid();
      const Double3 aim = random.Vector(), up = random.Vector(), world_up = random.Vector();
      const Matrix4 up_matrix = random.Rigid();
      ConstraintNode node("aimConstraint", s,
                          {{"aimVector", aim},
                           {"upVector", up},
                           {"worldUpType", type},
                           {"worldUpVector", world_up},
                           {"worldUpMatrix", up_matrix}});
      const Matrix4 world = s.parent * node.At(s);
      for (int a = 0; a < 3; ++a) {
        for (int b = 0; b < 3; ++b)
          EXPECT_NEAR(Dot(AxisOf(world, a), AxisOf(world, b)), a == b ? 1 : 0, 1e-12);
      }
      EXPECT_GT(Determinant3(world), 0);
      Double3 direction = PlaceIn(s.targets[0]) - PlaceIn(world);
      direction = direction * (1 / Length(direction));
      const Double3 aimed = TransformVector(world, aim) * (1 / Length(aim));
      EXPECT_LT(Apart(aimed, direction), 1e-12);
      if (type == 4) continue;
      // The up axis lies in the half plane of the direction and the world's up
      const Double3 wanted = type == 0   ? Double3{0, 1, 0}
                             : type == 1 ? PlaceIn(up_matrix) - PlaceIn(world)
                             : type == 2 ? TransformVector(up_matrix, world_up)
                                         : world_up;
      const Double3 normal = Cross(direction, wanted), own = TransformVector(world, up);
      EXPECT_NEAR(Dot(own, normal) / (Length(own) * Length(normal)), 0, 1e-11);
      EXPECT_GT(Dot(Cross(direction, own), normal), 0);
    }
  }
}

TEST(AimConstraint, WithoutAnUpTakesTheSmallestTurn) {
  RandomFrames random(17);
  Situation s = RandomSituation(&random, 1);
  s.in = random.Rigid();
  ConstraintNode node("aimConstraint", s, {{"worldUpType", 4}});
  const Matrix4 before = s.parent * s.in, after = s.parent * node.At(s);
  const Double3 direction = PlaceIn(s.targets[0]) - PlaceIn(before), aim = AxisOf(before, 0);
  const Quaternion turn = TakeApart(after * InverseOrIdentity(before)).rotation;
  EXPECT_NEAR(Length(RotationVector(turn)), Acos(Dot(aim, direction) / Length(direction)), 1e-9);
}

TEST(AimConstraint, WhatCannotBeAimedStaysHarmless) {
  Situation s;
  s.in = ComposeTrs({1, 2, 3}, Normalized({0.1, 0.2, 0.3, 1}), {1, 1, 1});
  s.targets = {Translation({1, 2, 3})};  // at its own place
  ConstraintNode same("aimConstraint", s);
  EXPECT_LT(Apart(same.At(s), s.in), 1e-15);
  s.targets = {Translation({1, 5, 3})};  // straight up, along the world's up
  ConstraintNode up("aimConstraint", s);
  EXPECT_LT(Apart(AxisOf(up.At(s), 0), {0, 1, 0}), 1e-12);
  s.targets[0](0, 3) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_LT(Apart(up.At(s), s.in), 1e-15);
}

TEST(Constraints, MaintainedOffsetsKeepTheRestBitForBit) {
  RandomFrames random(18);
  for (const std::string& type : kTransformConstraints) {
    for (std::size_t targets : {1, 3}) {
      Situation rest = RandomSituation(&random, targets);
      rest.parent = random.Scaled();
      ConstraintNode node(type, rest, {{"maintainOffset", Value(true)}, {"targetWeight[0]", 0.3}});
      EXPECT_EQ(node.At(rest), rest.in) << type;
      // Nearly there: nothing jumps
      Situation now = rest;
      for (Matrix4& target : now.targets) target(0, 3) += 1e-13;
      EXPECT_LT(Apart(node.At(now), rest.in), 1e-11) << type;
    }
  }
}

TEST(Constraints, BlendGoesFromBelowToTheConstraint) {
  RandomFrames random(19);
  for (const std::string& type : kTransformConstraints) {
    const Situation s = RandomSituation(&random, 2);
    const auto at = [&](double blend) {
      ConstraintNode node(type, s, {{"blend", blend}});
      return node.At(s);
    };
    EXPECT_EQ(at(0), s.in) << type;
    EXPECT_GT(Apart(at(1), s.in), 1e-3) << type;
    EXPECT_LT(Apart(at(0.25), BlendMatrices(s.in, at(1), 0.25)), 1e-14) << type;
  }
}

TEST(Constraints, WithoutTargetsOrWeightsDoNothing) {
  RandomFrames random(20);
  for (const std::string& type : kTransformConstraints) {
    const Situation s = RandomSituation(&random, 2);
    ConstraintNode idle(type, s, {{"targetWeight[0]", 0.0}, {"targetWeight[1]", 0.0}});
    EXPECT_EQ(idle.At(s), s.in) << type;
    ConstraintNode none(type, {{}, s.in, s.parent});
    EXPECT_EQ(none.At({{}, s.in, s.parent}), s.in) << type;
  }
}

TEST(Constraints, MoveWithTheWorld) {
  RandomFrames random(21);
  for (const std::string& type : kTransformConstraints) {
    for (const bool maintain : {false, true}) {
      for (int up_type : {1, 2, 4}) {
        Situation rest = RandomSituation(&random, 2), now = RandomSituation(&random, 2);
        rest.in = random.Rigid(), now.in = random.Rigid();
        std::vector<std::pair<std::string, Value>> values = {{"maintainOffset", Value(maintain)}};
        Matrix4 up = random.Rigid();
        if (type == "aimConstraint")
          values.insert(values.end(), {{"worldUpType", up_type}, {"worldUpMatrix", up}});
        ConstraintNode node(type, rest, values);
        if (type == "aimConstraint") node.g.vary("n.worldUpMatrix");
        const auto moved = [&](const Matrix4& world) {
          Situation s = now;
          s.parent = world * s.parent;
          for (Matrix4& target : s.targets) target = world * target;
          if (type == "aimConstraint") node.PosedNode::Now("worldUpMatrix", world * up);
          return node.At(s);
        };
        EXPECT_LT(Apart(moved(Matrix4()), moved(random.Rigid(10))), 1e-12) << type;
      }
    }
  }
}

TEST(Constraints, SayWhatIsWrongWhenTheyAreBound) {
  const auto error = [](const std::string& type, const Situation& s,
                        std::vector<std::pair<std::string, Value>> values) {
    ConstraintNode node(type, s, std::move(values));
    return node.Error();
  };
  const auto has = [](const std::string& text, const char* part) {
    return text.find(part) != std::string::npos;
  };
  Situation s;
  s.targets = {Scaling({0, 0, 0})};
  for (const char* type : {"parentConstraint", "scaleConstraint"}) {
    EXPECT_TRUE(has(error(type, s, {{"maintainOffset", Value(true)}}),
                    "targetMatrix[0] is scaled to nothing at rest"))
        << type;
    EXPECT_EQ(error(type, s, {}), "no error") << type;
  }
  s.parent = Scaling({0, 1, 1});
  for (const std::string& type : kTransformConstraints) {
    EXPECT_TRUE(has(error(type, s, {{"maintainOffset", Value(true)}}), "parentMatrix is singular at rest"))
        << type;
  }
  EXPECT_TRUE(has(error("aimConstraint", s, {{"aimVector", Double3()}}), "aimVector has no direction"));
  EXPECT_TRUE(
      has(error("aimConstraint", s, {{"upVector", Double3{-2, 0, 0}}}), "upVector is parallel to aimVector"));
  EXPECT_EQ(error("aimConstraint", s, {{"upVector", Double3{-2, 0, 0}}, {"worldUpType", 4}}), "no error");
}

TEST(SpaceSwitch, CarriesItsOwnMotionUnderTheChosenSpace) {
  RandomFrames random(22);
  const Situation rest = RandomSituation(&random, 3);
  Situation now = RandomSituation(&random, 3);
  ConstraintNode node("spaceSwitch", rest);
  node.g.vary("n.space");
  const auto under = [&](std::size_t i) {
    return InverseOrIdentity(now.parent) * now.targets[i] * InverseOrIdentity(rest.targets[i]) * rest.parent *
           now.in;
  };
  const auto at = [&](double space) {
    node.PosedNode::Now("space", space);
    return node.At(now);
  };
  for (std::size_t i = 0; i < 3; ++i) EXPECT_LT(Apart(at(static_cast<double>(i)), under(i)), 1e-12);
  EXPECT_LT(Apart(at(1.5), BlendMatrices(under(1), under(2), 0.5)), 1e-12);
  EXPECT_EQ(at(7), at(2));
  EXPECT_EQ(at(std::numeric_limits<double>::quiet_NaN()), now.in);
  // At rest in any of them, and with the world
  for (double space : {0.0, 0.4, 1.0, 2.0}) {
    node.PosedNode::Now("space", space);
    const Matrix4 out = node.At(rest);
    EXPECT_LT(Apart(out, rest.in), space == std::floor(space) ? 1e-300 : 1e-13);
  }
  const Matrix4 before = at(0.75), world = random.Rigid(5);
  for (Matrix4& target : now.targets) target = world * target;
  now.parent = world * now.parent;
  EXPECT_LT(Apart(at(0.75), before), 1e-12);
}

TEST(SpaceSwitch, WithoutOffsetsTakesTheLocalMatrixAsInTheSpace) {
  RandomFrames random(23);
  const Situation s = RandomSituation(&random, 2);
  ConstraintNode node("spaceSwitch", s, {{"maintainOffset", Value(false)}, {"space", 1.0}});
  EXPECT_LT(Apart(s.parent * node.At(s), s.targets[1] * s.in), 1e-12);
  ConstraintNode off("spaceSwitch", s, {{"blend", 0.0}});
  EXPECT_EQ(off.At(s), s.in);
}

}  // namespace
}  // namespace kpsa::engine
