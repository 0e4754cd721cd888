// Constraints and IK: what they give is local to a parent, and does not change.
#include "tests/nodes/equivariance.h"

namespace kpsa::engine {
namespace {

std::string OnOff(bool maintain) { return maintain ? "maintainOffset" : "no offset"; }

void AddTargetConstraints(std::vector<NodeSetUp>* all) {
  for (const char* type :
       {"pointConstraint", "orientConstraint", "parentConstraint", "scaleConstraint", "aimConstraint"}) {
    for (const bool maintain : {false, true}) {
      RandomFrames random(41);
      const auto frame = [&](const char* name) {  // scaled: the scaleConstraint would see nothing else turn
        return GivenInput{name, Moves::kFrame, random.Scaled(), random.Scaled()};
      };
      NodeSetUp s{type,
                  OnOff(maintain),
                  {frame("targetMatrix[0]"),
                   frame("targetMatrix[1]"),
                   frame("parentMatrix"),
                   Setting("targetWeight[1]", 0.6),
                   Setting("maintainOffset", maintain),
                   {"inMatrix", Moves::kNot, random.Scaled(), random.Scaled()},
                   {"blend", Moves::kNot, 1.0, 0.7}},
                  {{"outMatrix", Moves::kNot}},
                  0,
                  ""};
      if (std::string(type) != "aimConstraint") {
        all->push_back(s);
        continue;
      }
      s.given.push_back(Setting("aimVector", Double3{1, 0.2, 0}));
      s.given.push_back(Setting("upVector", Double3{0, 1, 0.3}));
      const GivenInput up{"worldUpVector", Moves::kDirection, Double3{0.2, 1, 0}, Double3{0, 1, -0.4}};
      const std::vector<std::pair<std::string, std::vector<GivenInput>>> ups = {
          {"scene", {}},
          {"object", {frame("worldUpMatrix")}},
          {"objectrotation", {frame("worldUpMatrix"), Setting("worldUpVector", Double3{0.3, 0.8, 0.1})}},
          {"vector", {up}},
          {"none", {}}};
      for (const auto& [what, own] : ups) {
        NodeSetUp aim = s;
        aim.what = what + ", " + OnOff(maintain);
        aim.given.push_back(Setting("worldUpType", Value(what)));
        aim.given.insert(aim.given.end(), own.begin(), own.end());
        if (what == "scene") aim.unless = kAllTurned | kNowTurned, aim.why = "the world's y stays up";
        all->push_back(aim);
      }
    }
  }
}

void AddPole(std::vector<NodeSetUp>* all) {
  for (const bool maintain : {false, true}) {
    RandomFrames random(42);
    all->push_back({"poleVectorConstraint",
                    OnOff(maintain),
                    {WorldMatrix("targetMatrix[0]", &random),
                     WorldMatrix("targetMatrix[1]", &random),
                     WorldMatrix("inMatrix", &random),
                     {"blend", Moves::kNot, 1.0, 0.6},
                     Setting("maintainOffset", maintain)},
                    {{"outMatrix", Moves::kPlace}},
                    0,
                    ""});
  }
}

void AddIk(std::vector<NodeSetUp>* all) {
  for (const bool maintain : {false, true}) {
    for (const bool pole : {false, true}) {
      RandomFrames random(43);
      const auto bone = [&](const std::string& name, double length) {
        const Quaternion turn = random.Turn();
        const auto there = [&](double bend) {
          return ComposeTrs({length, 0.1, 0}, Slerp(Quaternion(), turn, bend), {1, 1, 1});
        };
        return GivenInput{name, Moves::kNot, there(0.2), there(0.3)};
      };
      const GivenInput target{"target", Moves::kFrame, Translation({1.1, 0.7, 0.2}) * random.Rigid(0.1),
                              Translation({0.7, 0.9, -0.4}) * random.Rigid(0.1)};
      NodeSetUp s{"ikHandle",
                  OnOff(maintain) + (pole ? ", pole" : ""),
                  {target,
                   bone("inStartMatrix", 0.2),
                   bone("inMidMatrix", 0.6),
                   bone("betweenMatrix[0]", 0.4),
                   bone("belowMatrix[0]", 0.5),
                   bone("belowMatrix[1]", 0.4),
                   WorldMatrix("parentMatrix", &random),
                   {"twist", Moves::kNot, 0.0, 0.4},
                   {"blend", Moves::kNot, 1.0, 0.8},
                   Setting("maintainOffset", maintain)},
                  {{"startMatrix", Moves::kNot}, {"midMatrix", Moves::kNot}},
                  0,
                  ""};
      if (pole) s.given.push_back({"poleVector", Moves::kFrame, random.Rigid(3), random.Rigid(3)});
      all->push_back(s);
    }
  }
}

void AddChains(std::vector<NodeSetUp>* all) {
  for (const bool maintain : {false, true}) {
    RandomFrames random(44);
    const auto joint = [&](const std::string& name) {
      return GivenInput{name, Moves::kNot, Translation({0.5, 0, 0}) * random.Rigid(0.1),
                        Translation({0.5, 0, 0}) * random.Rigid(0.1)};
    };
    const Value bow = std::make_shared<const class Curve>(
        std::vector<Double3>{{0, 0, 0}, {0.5, 1, 0}, {1.5, 1, 0.5}, {2.5, 0, 0.5}}, false);
    all->push_back({"splineIk",
                    OnOff(maintain),
                    {{"curve", Moves::kPlace, bow, {}, false, true},
                     {"displacements", Moves::kDirection, PointsOf(std::vector<float>(12, 0.0f)),
                      PointsOf({0, 0.1f, 0, 0.3f, 0, 0.2f, 0, -0.4f, 0.1f, 0.2f, 0.2f, 0})},
                     joint("inMatrix[0]"),
                     joint("inMatrix[1]"),
                     joint("tipMatrix"),
                     WorldMatrix("parentMatrix", &random),
                     {"startTwist", Moves::kNot, 0.0, 0.3},
                     {"endTwist", Moves::kNot, 0.1, 0.9},
                     {"blend", Moves::kNot, 1.0, 0.9},
                     WorldMatrix("curveMatrix", &random),
                     Setting("maintainOffset", maintain)},
                    {{"outMatrix[0]", Moves::kNot}, {"outMatrix[1]", Moves::kNot}},
                    0,
                    ""});
  }
  for (const bool axis : {false, true}) {
    RandomFrames random(45);
    NodeSetUp s{"twistDistribution",
                axis ? "axis" : "",
                {WorldMatrix("startMatrix", &random), WorldMatrix("endMatrix", &random),
                 Setting("inMatrix[0]", random.Rigid()), Setting("inMatrix[1]", random.Rigid())},
                {{"outMatrix[0]", Moves::kNot}, {"outMatrix[1]", Moves::kNot}},
                0,
                ""};
    if (axis) s.given.push_back(Setting("axis", Double3{0.2, 1, 0}));
    all->push_back(s);
  }
}

void AddSpaces(std::vector<NodeSetUp>* all) {
  for (const bool maintain : {false, true}) {
    RandomFrames random(46);
    all->push_back({"spaceSwitch",
                    OnOff(maintain),
                    {WorldMatrix("targetMatrix[0]", &random),
                     WorldMatrix("targetMatrix[1]", &random),
                     WorldMatrix("parentMatrix", &random),
                     Setting("inMatrix", random.Scaled()),
                     {"space", Moves::kNot, 0.0, 0.4},
                     {"blend", Moves::kNot, 1.0, 0.8},
                     Setting("maintainOffset", maintain)},
                    {{"outMatrix", Moves::kNot}},
                    0,
                    ""});
  }
  RandomFrames random(47);
  all->push_back(
      {"vrmAimConstraint",
       "",
       {WorldMatrix("sourceMatrix", &random), WorldMatrix("parentMatrix", &random),
        Setting("inMatrix", random.Rigid()), Setting("restMatrix", random.Rigid()), Setting("weight", 0.8)},
       {{"outMatrix", Moves::kNot}},
       0,
       ""});
}

}  // namespace

std::vector<NodeSetUp> ConstraintSetUps() {
  std::vector<NodeSetUp> all;
  AddTargetConstraints(&all);
  AddPole(&all);
  AddIk(&all);
  AddChains(&all);
  AddSpaces(&all);
  return all;
}

}  // namespace kpsa::engine
