#include <limits>

#include "nodes/kernels/constraint_math.h"
#include "nodes/kernels/matrix_parts.h"
#include "nodes/kernels/two_bone_ik.h"
#include "tests/nodes/node_support.h"

namespace kpsa::engine {
namespace {

// An arm of locals: start, one joint between, mid, one joint below it, end.
struct ArmLocals {
  Matrix4 parent, start, between, mid, below, end, target, pole;
  Matrix4 Mid() const { return parent * start * between * mid; }
  Matrix4 End() const { return Mid() * below * end; }
  double Upper() const { return Length(PlaceIn(Mid()) - PlaceIn(parent * start)); }
  double Lower() const { return Length(PlaceIn(End()) - PlaceIn(Mid())); }
};

ArmLocals RandomArm(RandomFrames* random) {
  ArmLocals arm;
  arm.parent = random->Rigid(2), arm.start = random->Rigid(), arm.mid = random->Rigid(0.2);
  arm.between = random->Rigid(), arm.below = random->Rigid(), arm.end = random->Rigid(0.2);
  arm.pole = random->Rigid(4);
  return arm;
}

Double3 RandomDirection(RandomFrames* random) { return Rotate(random->Turn(), {1, 0, 0}); }

class IkNode : public PosedNode {
 public:
  IkNode(const ArmLocals& rest, bool pole, std::vector<std::pair<std::string, Value>> values = {})
      : PosedNode("ikHandle", Rest(rest, pole, std::move(values)),
                  {"target", "parentMatrix", "inStartMatrix", "inMidMatrix", "betweenMatrix[0]",
                   "belowMatrix[0]", "belowMatrix[1]"}),
        pole_(pole) {
    if (pole) g.vary("n.poleVector");
  }
  // The arm as solved.
  ArmLocals At(const ArmLocals& now) {
    Now("target", now.target);
    Now("parentMatrix", now.parent);
    Now("inStartMatrix", now.start);
    Now("inMidMatrix", now.mid);
    Now("betweenMatrix[0]", now.between);
    Now("belowMatrix[0]", now.below);
    Now("belowMatrix[1]", now.end);
    if (pole_) Now("poleVector", now.pole);
    ArmLocals solved = now;
    solved.start = Out("startMatrix");
    solved.mid = Out("midMatrix");
    return solved;
  }

 private:
  static std::vector<std::pair<std::string, Value>> Rest(const ArmLocals& arm, bool pole,
                                                         std::vector<std::pair<std::string, Value>> values) {
    values.insert(values.end(), {{"target", arm.target},
                                 {"parentMatrix", arm.parent},
                                 {"inStartMatrix", arm.start},
                                 {"inMidMatrix", arm.mid},
                                 {"betweenMatrix[0]", arm.between},
                                 {"belowMatrix[0]", arm.below},
                                 {"belowMatrix[1]", arm.end}});
    if (pole) values.emplace_back("poleVector", arm.pole);
    return values;
  }
  bool pole_;
};

// A target at a share of the way from fully folded (0) to straight (1), in any direction.
void PlaceTarget(RandomFrames* random, double share, ArmLocals* arm) {
  const double shortest = std::fabs(arm->Upper() - arm->Lower()), longest = arm->Upper() + arm->Lower();
  arm->target = random->Rigid();
  const Double3 place =
      PlaceIn(arm->parent * arm->start) + RandomDirection(random) * (shortest + share * (longest - shortest));
  arm->target(0, 3) = place.x, arm->target(1, 3) = place.y, arm->target(2, 3) = place.z;
}

TEST(IkHandle, ReachesEveryReachableTargetAndKeepsTheBones) {
  RandomFrames random(30);
  for (int i = 0; i < 300; ++i) {
    ArmLocals arm = RandomArm(&random);
    PlaceTarget(&random, i % 10 == 0 ? 1e-6 : i % 10 == 1 ? 1 - 1e-6 : random.Number(0, 1), &arm);
    IkNode node(arm, i % 2 == 0, {{"twist", i % 3 == 0 ? 0.7 : 0.0}});
    const ArmLocals solved = node.At(arm);
    EXPECT_LT(Apart(PlaceIn(solved.End()), PlaceIn(arm.target)), 1e-9);
    EXPECT_NEAR(solved.Upper(), arm.Upper(), 1e-12);
    EXPECT_NEAR(solved.Lower(), arm.Lower(), 1e-12);
    // Joints turn only
    EXPECT_EQ(PlaceIn(solved.start), PlaceIn(arm.start));
    EXPECT_EQ(PlaceIn(solved.mid), PlaceIn(arm.mid));
    EXPECT_LT(Apart(TakeApart(solved.start).scale, {1, 1, 1}), 1e-12);
  }
}

TEST(IkHandle, StraightensBeyondItsReach) {
  RandomFrames random(31);
  for (int i = 0; i < 50; ++i) {
    ArmLocals arm = RandomArm(&random);
    PlaceTarget(&random, random.Number(1.01, 5), &arm);
    const ArmLocals solved = IkNode(arm, i % 2 == 0).At(arm);
    const Double3 start = PlaceIn(arm.parent * arm.start);
    const Double3 way = PlaceIn(arm.target) - start, unit = way * (1 / Length(way));
    EXPECT_LT(Apart(PlaceIn(solved.Mid()), start + unit * arm.Upper()), 1e-9);
    EXPECT_LT(Apart(PlaceIn(solved.End()), start + unit * (arm.Upper() + arm.Lower())), 1e-9);
  }
}

TEST(IkHandle, FoldsWhereTheTargetIsTooNear) {
  RandomFrames random(32);
  for (int i = 0; i < 50; ++i) {
    ArmLocals arm = RandomArm(&random);
    PlaceTarget(&random, 0, &arm);
    const double shortest = std::fabs(arm.Upper() - arm.Lower());
    const Double3 start = PlaceIn(arm.parent * arm.start);
    const Double3 near = start + (PlaceIn(arm.target) - start) * 0.3;
    arm.target(0, 3) = near.x, arm.target(1, 3) = near.y, arm.target(2, 3) = near.z;
    const ArmLocals solved = IkNode(arm, false).At(arm);
    EXPECT_NEAR(Length(PlaceIn(solved.End()) - start), shortest, 1e-9);
    EXPECT_NEAR(Dot(PlaceIn(solved.End()) - start, near - start), shortest * Length(near - start), 1e-9);
  }
}

TEST(IkHandle, TheMiddlePointsAtThePoleAndTwistsFromThere) {
  RandomFrames random(33);
  for (int i = 0; i < 50; ++i) {
    ArmLocals arm = RandomArm(&random);
    PlaceTarget(&random, random.Number(0.2, 0.9), &arm);
    const double twist = random.Number(-3, 3);
    for (const double t : {0.0, twist}) {
      const ArmLocals solved = IkNode(arm, true, {{"twist", t}}).At(arm);
      const Double3 start = PlaceIn(arm.parent * arm.start), way = PlaceIn(arm.target) - start;
      double angle = 0;
      ASSERT_TRUE(AngleAbout(way * (1 / Length(way)), PlaceIn(arm.pole) - start,
                             PlaceIn(solved.Mid()) - start, &angle));
      EXPECT_NEAR(angle, t, 1e-9);
    }
  }
}

TEST(IkHandle, WithoutAPoleSwingsOnTheShortestWay) {
  RandomFrames random(34);
  ArmLocals arm = RandomArm(&random);
  // A target that the end already is as far away as: the bend stays
  const Double3 start = PlaceIn(arm.parent * arm.start);
  const Quaternion turn = random.Turn();
  arm.target = Translation(start + Rotate(turn, PlaceIn(arm.End()) - start));
  const ArmLocals solved = IkNode(arm, false).At(arm);
  EXPECT_LT(Apart(solved.mid, arm.mid), 1e-12);
  const Quaternion swing =
      TakeApart(solved.parent * solved.start * InverseOrIdentity(arm.parent * arm.start)).rotation;
  const Double3 from = PlaceIn(arm.End()) - start, to = PlaceIn(arm.target) - start;
  EXPECT_NEAR(Length(RotationVector(swing)), Acos(Dot(from, to) / (Length(from) * Length(to))), 1e-9);
}

TEST(IkHandle, KeepsTheRestBitForBit) {
  RandomFrames random(35);
  for (int i = 0; i < 50; ++i) {
    ArmLocals arm = RandomArm(&random);
    if (i % 5 == 4) arm.mid = Matrix4(), arm.end = Matrix4(), arm.below = arm.between;  // straight
    arm.target = random.Rigid();
    IkNode maintained(arm, i % 2 == 0, {{"maintainOffset", Value(true)}});
    const ArmLocals kept = maintained.At(arm);
    EXPECT_EQ(kept.start, arm.start);
    EXPECT_EQ(kept.mid, arm.mid);
    // A target placed at the end is enough
    arm.target = Translation(PlaceIn(arm.End()));
    const ArmLocals placed = IkNode(arm, false).At(arm);
    EXPECT_EQ(placed.start, arm.start);
    EXPECT_EQ(placed.mid, arm.mid);
  }
}

TEST(IkHandle, MaintainsTheOffsetToTargetAndPole) {
  RandomFrames random(36);
  ArmLocals rest = RandomArm(&random);
  rest.target = Translation(PlaceIn(rest.End())) * random.Rigid(0.1);
  IkNode node(rest, true, {{"maintainOffset", Value(true)}});
  const Double3 start = PlaceIn(rest.parent * rest.start), way = PlaceIn(rest.End()) - start;
  const Double3 move = way * -0.02;
  ArmLocals now = rest;
  now.target = Translation(move) * rest.target;
  EXPECT_LT(Apart(PlaceIn(node.At(now).End()), PlaceIn(rest.End()) + move), 1e-9);
  // A pole that turns about the line takes the middle with it
  const Matrix4 about = Translation(start) * RotationFromQuaternion(AxisAngle(way * (1 / Length(way)), 0.8)) *
                        Translation(start * -1);
  now = rest;
  now.pole = about * rest.pole;
  EXPECT_LT(Apart(PlaceIn(node.At(now).Mid()), TransformPoint(about, PlaceIn(rest.Mid()))), 1e-9);
}

TEST(IkHandle, MovesWithTheWorld) {
  RandomFrames random(37);
  for (int i = 0; i < 30; ++i) {
    ArmLocals rest = RandomArm(&random), now = RandomArm(&random);
    if (i % 4 == 3) now.mid = Matrix4(), now.end = Matrix4(), now.below = now.between;  // straight
    rest.target = random.Rigid();
    PlaceTarget(&random, random.Number(0.1, 1.3), &now);
    IkNode node(rest, i % 2 == 0, {{"maintainOffset", Value(i % 3 == 0)}});
    const ArmLocals before = node.At(now);
    const Matrix4 world = random.Rigid(5);
    now.parent = world * now.parent, now.target = world * now.target, now.pole = world * now.pole;
    const ArmLocals after = node.At(now);
    EXPECT_LT(Apart(after.start, before.start), 1e-9);
    EXPECT_LT(Apart(after.mid, before.mid), 1e-9);
  }
}

TEST(IkHandle, BlendsFromThePoseBelow) {
  RandomFrames random(38);
  ArmLocals arm = RandomArm(&random);
  PlaceTarget(&random, 0.5, &arm);
  const auto at = [&](double blend) { return IkNode(arm, false, {{"blend", blend}}).At(arm); };
  EXPECT_EQ(at(0).start, arm.start);
  EXPECT_EQ(at(0).mid, arm.mid);
  EXPECT_LT(Apart(at(0.5).start, BlendMatrices(arm.start, at(1).start, 0.5)), 1e-14);
  EXPECT_LT(Apart(at(0.5).mid, BlendMatrices(arm.mid, at(1).mid, 0.5)), 1e-14);
}

TEST(IkHandle, ScaledParentsDoNotSpoilTheReach) {
  RandomFrames random(39);
  ArmLocals arm = RandomArm(&random);
  arm.parent = arm.parent * Scaling({2, 2, 2});
  PlaceTarget(&random, 0.6, &arm);
  const ArmLocals solved = IkNode(arm, true).At(arm);
  EXPECT_LT(Apart(PlaceIn(solved.End()), PlaceIn(arm.target)), 1e-9);
  EXPECT_LT(Apart(TakeApart(solved.start).scale, {1, 1, 1}), 1e-12);
}

TEST(IkHandle, WhatCannotBeSolvedStaysHarmless) {
  RandomFrames random(40);
  const Matrix4 one;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (int i = 0; i < 6; ++i) {
    ArmLocals arm = RandomArm(&random);
    arm.target = random.Rigid();
    if (i == 0) arm.between = arm.mid = one;                                    // no upper bone
    if (i == 1) arm.below = arm.end = one;                                      // no lower bone
    if (i == 2) arm.between = arm.mid = arm.below = arm.end = one;              // none at all
    if (i == 3) arm.target = arm.parent * arm.start;                            // nowhere to go
    if (i == 4) arm.pole = Translation(PlaceIn(arm.target)) * random.Rigid(0);  // on the line
    if (i == 5) arm.target(1, 3) = nan;
    const Matrix4 target = arm.target;
    if (i == 5) arm.target = one;  // a graph holds finite numbers only; nan may still flow
    IkNode node(arm, true);
    arm.target = target;
    const ArmLocals solved = node.At(arm);
    EXPECT_LT(Apart(solved.start, Matrix4()), 100) << i;  // finite
    EXPECT_NEAR(Determinant3(solved.start), 1, 1e-12) << i;
    EXPECT_NEAR(Determinant3(solved.mid), 1, 1e-12) << i;
    if (i == 2 || i == 5) {
      EXPECT_EQ(solved.start, arm.start) << i;
      EXPECT_EQ(solved.mid, arm.mid) << i;
    }
    if (i <= 1) {  // the other bone points at the target
      const Double3 start = PlaceIn(arm.parent * arm.start);
      EXPECT_LT(Length(Cross(PlaceIn(solved.End()) - start, PlaceIn(arm.target) - start)), 1e-9) << i;
    }
    if (i == 4) {
      EXPECT_NEAR(solved.Upper(), arm.Upper(), 1e-12);
    }
  }
}

TEST(IkHandle, OppositeDirectionsAreReached) {
  ArmLocals arm;  // along x; the target lies straight behind
  arm.between = Translation({1, 0, 0});
  arm.mid = RotationFromEuler({0, 0, 0.5}, RotateOrder::kXyz);
  arm.below = Translation({1, 0, 0});
  const Double3 end = PlaceIn(arm.End());
  for (const double share : {0.25, 0.7, 0.99}) {
    arm.target = Translation(end * -share);
    EXPECT_LT(Apart(PlaceIn(IkNode(arm, false).At(arm).End()), end * -share), 1e-12) << share;
  }
}

TEST(PoleVectorConstraint, PlacesThePoleByItsTargets) {
  RandomFrames random(41);
  const Matrix4 a = random.Rigid(), b = random.Rigid(), in = random.Rigid();
  const auto make = [&](std::vector<std::pair<std::string, Value>> values) {
    values.insert(values.end(), {{"targetMatrix[0]", a}, {"targetMatrix[1]", b}, {"inMatrix", in}});
    return PosedNode("poleVectorConstraint", values, {"targetMatrix[0]", "targetMatrix[1]"});
  };
  EXPECT_LT(Apart(PlaceIn(make({{"targetWeight[1]", 3.0}}).Out()), PlaceIn(a) * 0.25 + PlaceIn(b) * 0.75),
            1e-14);
  EXPECT_EQ(make({{"blend", 0.0}}).Out(), in);
  EXPECT_EQ(make({{"targetWeight[0]", 0.0}, {"targetWeight[1]", 0.0}}).Out(), in);
  PosedNode kept = make({{"maintainOffset", Value(true)}});
  EXPECT_EQ(kept.Out(), in);
  const Matrix4 world = random.Rigid(3);
  kept.Now("targetMatrix[0]", world * a);
  kept.Now("targetMatrix[1]", world * b);
  EXPECT_LT(Apart(PlaceIn(kept.Out()), TransformPoint(world, PlaceIn(in))), 1e-13);
}

}  // namespace
}  // namespace kpsa::engine
