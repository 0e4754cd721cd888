// Constraints and IK from rig files, on an arm with a joint in each bone.
#include "base/scalar_math.h"
#include "tests/rig/rig_player.h"
#include "tests/support/shared_files.h"

namespace kpsa::engine {
namespace {

// A triangle, and root > upperarm01.L > upperarm02.L > lowerarm01.L > wrist.L > finger, root > head; the clip
// `wave` turns both bones and the wrist.
std::string ArmCharacter() {
  GltfBuilder b;
  const int position = b.Accessor<float>({0, 0, 0, 1, 0, 0, 0, 1, 0}, "VEC3");
  const int indices = b.Accessor<std::uint16_t>({0, 1, 2}, "SCALAR");
  const int times = b.Accessor<float>({0, 1}, "SCALAR");
  const int first = b.Accessor<float>({0, 0, 0, 1, 0.6f, 0, 0, 0.8f}, "VEC4");
  const int second = b.Accessor<float>({0, 0.28f, 0, 0.96f, 0, 0.8f, 0, 0.6f}, "VEC4");
  b.Push("meshes", {{"primitives", {{{"attributes", {{"POSITION", position}}}, {"indices", indices}}}}});
  b.Push("nodes", {{"name", "body"}, {"mesh", 0}});
  b.Push(
      "nodes",
      {{"name", "root"}, {"children", {2, 7}}, {"translation", {0, 1, 0}}, {"rotation", {0, 0.6, 0, 0.8}}});
  b.Push("nodes", {{"name", "upperarm01.L"},
                   {"children", {3}},
                   {"translation", {0.2, 0.4, 0}},
                   {"rotation", {0, 0, 0.28, 0.96}}});
  b.Push("nodes", {{"name", "upperarm02.L"},
                   {"children", {4}},
                   {"translation", {0.15, 0.01, 0}},
                   {"rotation", {0.1, 0, 0, 0.9949874371066199}}});
  b.Push("nodes", {{"name", "lowerarm01.L"},
                   {"children", {5}},
                   {"translation", {0.13, 0, 0}},
                   {"rotation", {0, 0.28, 0, 0.96}}});
  b.Push("nodes", {{"name", "wrist.L"}, {"children", {6}}, {"translation", {0.28, 0, 0}}});
  b.Push("nodes", {{"name", "finger"}, {"translation", {0.1, 0, 0}}});
  b.Push("nodes", {{"name", "head"}, {"translation", {0, 0.6, 0}}});
  b.Push("scenes", {{"nodes", {0, 1}}});
  b.root["scene"] = 0;
  b.Push("animations",
         {{"name", "wave"},
          {"samplers", {{{"input", times}, {"output", first}}, {{"input", times}, {"output", second}}}},
          {"channels",
           {{{"sampler", 0}, {"target", {{"node", 2}, {"path", "rotation"}}}},
            {{"sampler", 1}, {"target", {{"node", 4}, {"path", "rotation"}}}},
            {{"sampler", 0}, {"target", {{"node", 5}, {"path", "rotation"}}}}}}});
  return b.Text();
}

Double3 At(const Matrix4& m) { return {m(0, 3), m(1, 3), m(2, 3)}; }
double Between(const Matrix4& a, const Matrix4& b) { return Length(At(a) - At(b)); }
const std::vector<std::string> kArm = {"upperarm01.L", "upperarm02.L", "lowerarm01.L", "wrist.L", "finger"};
const std::string kHand =
    "nodes:\n"
    "  hand: {type: transform, at: wrist.L}\n"
    "  ik: {type: ikHandle, start: upperarm01.L, mid: lowerarm01.L, end: wrist.L, target: "
    "hand.worldMatrix}\n";
const std::string kHandControls =
    "controls:\n"
    "  hand.translateX: {min: -1, max: 1}\n"
    "  hand.translateY: {min: -1, max: 1}\n"
    "  ik.blend: {min: 0, max: 1}\n";

class RigConstraints : public RigFixture {
 protected:
  RigConstraints() { folder.Write("c.gltf", ArmCharacter()); }
  std::string Write(const std::string& text) {
    return folder.Write("t.yaml", "kpsa: 1\ncharacter: c.gltf\n" + text);
  }
  RigPlayer Play(const std::string& text, bool rest) {
    RigOptions options;
    options.rest = rest;
    return RigPlayer(Write(text), options);
  }
};

TEST_F(RigConstraints, TheRestPoseStaysAsItIs) {
  RigPlayer plain = Play("", true);
  for (const std::string& nodes :
       {kHand,
        std::string(
            "nodes:\n"
            "  hand: {type: transform, at: wrist.L}\n"
            "  pole: {type: transform, at: head}\n"
            "  ik: {type: ikHandle, start: upperarm01.L, mid: lowerarm01.L, end: wrist.L, target: "
            "head.worldMatrix, poleVector: pole.worldMatrix, maintainOffset: on}\n"
            "  turn: {type: orientConstraint, constrained: wrist.L, targets: [hand], maintainOffset: on}\n"
            "  bone: {type: parentConstraint, constrained: upperarm02.L, targets: [head, hand], "
            "maintainOffset: on}\n"
            "  tip: {type: spaceSwitch, constrained: finger, targets: [hand, head], space: 1}\n")}) {
    RigPlayer player = Play(nodes, true);
    ASSERT_TRUE(player.ok());
    for (const std::string& joint : kArm)
      EXPECT_EQ(player.World(joint), plain.World(joint)) << joint << nodes;
  }
}

TEST_F(RigConstraints, TheArmReachesForTheHand) {
  for (const bool rest : {true, false}) {
    RigPlayer plain = Play("", rest), player = Play(kHand + kHandControls, rest);
    ASSERT_TRUE(player.ok());
    for (const double time : rest ? std::vector<double>{0} : std::vector<double>{0, 0.3, 1}) {
      player.Set("time.time", time);
      plain.Set("time.time", time);
      player.Set("ik.blend", 1);
      for (const auto& [x, y] : std::vector<std::pair<double, double>>{{0.03, -0.05}, {-0.02, -0.1}}) {
        player.Set("hand.translateX", x);
        player.Set("hand.translateY", y);
        EXPECT_LT(Between(player.World("wrist.L"), player.World("hand")), 1e-9) << time;
        for (std::size_t j = 0; j + 1 < kArm.size(); ++j) {
          EXPECT_NEAR(Between(player.World(kArm[j]), player.World(kArm[j + 1])),
                      Between(plain.World(kArm[j]), plain.World(kArm[j + 1])), 1e-12);
        }
      }
      std::map<std::string, Matrix4> solved;
      for (const std::string& joint : kArm) solved[joint] = player.World(joint);
      player.Set("ik.blend", 0);
      for (const std::string& joint : kArm) EXPECT_EQ(player.World(joint), plain.World(joint)) << joint;
      // Half way: each joint has half of its turn
      player.Set("ik.blend", 0.5);
      const auto turn = [&](const Matrix4& from, const Matrix4& to) {
        Double3 place, scale;
        Quaternion a, b;
        DecomposeTrs(from, &place, &a, &scale);
        DecomposeTrs(to, &place, &b, &scale);
        return Length(RotationVector(Conjugate(a) * b));
      };
      const std::string upper = "upperarm01.L";
      const double whole = turn(plain.World(upper), solved[upper]);
      EXPECT_GT(whole, 0.05);
      EXPECT_NEAR(turn(plain.World(upper), player.World(upper)), 0.5 * whole, 1e-9);
      EXPECT_NEAR(turn(player.World(upper), solved[upper]), 0.5 * whole, 1e-9);
    }
  }
}

TEST_F(RigConstraints, TheMiddlePointsAtAPoleThatItsConstraintPlaces) {
  RigPlayer player = Play(
      "nodes:\n"
      "  hand: {type: transform, at: wrist.L}\n"
      "  elbow: {type: transform, at: lowerarm01.L}\n"
      "  ik: {type: ikHandle, start: upperarm01.L, mid: lowerarm01.L, end: wrist.L, target: "
      "hand.worldMatrix}\n"
      "  pole: {type: poleVectorConstraint, constrained: ik, targets: [elbow]}\n"
      "controls:\n"
      "  hand.translateX: {min: -1, max: 1}\n"
      "  elbow.translateY: {min: -9, max: 9}\n",
      true);
  ASSERT_TRUE(player.ok());
  EXPECT_EQ(player.rig.graph->PlugName(
                player.rig.graph->FindConnection(*player.rig.graph->FindPlug("ik.poleVector"))->source),
            "pole.outMatrix");
  player.Set("hand.translateX", -0.1);
  for (const double y : {-3.0, 2.0}) {
    player.Set("elbow.translateY", y);
    const Double3 start = At(player.World("upperarm01.L")), way = At(player.World("wrist.L")) - start;
    const Double3 mid = At(player.World("lowerarm01.L")) - start, pole = At(player.World("elbow")) - start;
    const Double3 a = Cross(way, mid), b = Cross(way, pole);
    EXPECT_NEAR(Dot(a, b) / (Length(a) * Length(b)), 1, 1e-9);
    EXPECT_LT(Between(player.World("wrist.L"), player.World("hand")), 1e-9);
  }
}

TEST_F(RigConstraints, AConstraintTakesOverFromTheClip) {
  Rig rig = Loaded(kHand + "  turn: {type: orientConstraint, constrained: wrist.L, targets: [hand]}\n");
  const auto drivers = [&] {
    std::string text;
    for (const char* plug :
         {"upperarm01.L.offsetParentMatrix", "ik.inStartMatrix", "ik.inMidMatrix", "turn.inMatrix"})
      text += Driver(rig, plug) + " ";
    return text;
  };
  const std::string playing =
      "ik.startMatrix upperarm01.L_clip.matrix lowerarm01.L_clip.matrix wrist.L_clip.matrix ";
  EXPECT_EQ(drivers(), playing);
  EXPECT_EQ(Driver(rig, "ik.parentMatrix"), "root.worldMatrix");
  EXPECT_EQ(Driver(rig, "ik.betweenMatrix[0]"), "upperarm02.L.matrix");
  EXPECT_EQ(Driver(rig, "ik.belowMatrix[0]"), "turn.inMatrix");
  EXPECT_EQ(Driver(rig, "turn.targetMatrix[0]"), "hand.worldMatrix");
  EXPECT_EQ(Driver(rig, "turn.parentMatrix"), "lowerarm01.L.worldMatrix");
  EXPECT_EQ(Driver(rig, "wrist.L.offsetParentMatrix"), "turn.outMatrix");
  EXPECT_EQ(Held(rig, "ik.inStartMatrix").get<Matrix4>(),
            Held(rig, "upperarm01.L.restMatrix").get<Matrix4>());
  // Other clips go there, too
  ASSERT_TRUE(SetClip(&rig, std::nullopt).ok());
  EXPECT_EQ(drivers(), "ik.startMatrix    ");
  ASSERT_TRUE(SetClip(&rig, "wave").ok());
  EXPECT_EQ(drivers(), playing);
}

TEST_F(RigConstraints, WhatTheRigWritesGoesBelowTheConstraint) {
  // A connection onto the transform, a value of the constraint's own, an override
  Rig rig = Loaded(
      "nodes:\n"
      "  a: {type: composeMatrix, inputTranslate: [1, 2, 3]}\n"
      "  p: {type: pointConstraint, constrained: head, targets: root}\n"
      "  q: {type: pointConstraint, constrained: wrist.L, targets: [head], inMatrix: [1,0,0,0, 0,1,0,0, "
      "0,0,1,0, 7,0,0,1]}\n"
      "  r: {type: orientConstraint, constrained: lowerarm01.L, targets: [head]}\n"
      "connections: [a.outputMatrix -> head.offsetParentMatrix]\n"
      "overrides:\n"
      "  lowerarm01.L.offsetParentMatrix: [1,0,0,0, 0,1,0,0, 0,0,1,0, 9,0,0,1]\n");
  for (int twice = 0; twice < 2; ++twice) {
    EXPECT_EQ(Driver(rig, "p.inMatrix"), "a.outputMatrix");
    EXPECT_EQ(Driver(rig, "head.offsetParentMatrix"), "p.outMatrix");
    EXPECT_EQ(Driver(rig, "q.inMatrix"), "");
    EXPECT_EQ(Held(rig, "q.inMatrix").get<Matrix4>(), Translation({7, 0, 0}));
    EXPECT_EQ(Driver(rig, "r.inMatrix"), "");
    EXPECT_EQ(Held(rig, "r.inMatrix").get<Matrix4>(), Translation({9, 0, 0}));
    EXPECT_EQ(Driver(rig, "lowerarm01.L.offsetParentMatrix"), "r.outMatrix");
    ASSERT_TRUE(SetClip(&rig, "wave").ok());
  }
}

TEST_F(RigConstraints, WhatIsSetBelowAConstraintStaysThroughClips) {
  Rig rig = Loaded(kHand);
  const Result<Setting> setting = ParseSetting(rig, "ik.inMidMatrix=[1,0,0,0, 0,1,0,0, 0,0,1,0, 5,0,0,1]");
  ASSERT_TRUE(setting.ok()) << setting.status().ToString();
  ASSERT_TRUE(ApplySetting(&rig, *setting).ok());
  ASSERT_TRUE(SetClip(&rig, "wave").ok());
  EXPECT_EQ(Driver(rig, "ik.inMidMatrix"), "");
  EXPECT_EQ(Held(rig, "ik.inMidMatrix").get<Matrix4>(), Translation({5, 0, 0}));
  EXPECT_EQ(Driver(rig, "ik.inStartMatrix"), "upperarm01.L_clip.matrix");
}

TEST_F(RigConstraints, ControlsStayOnTopOfAConstraint) {
  RigPlayer player = Play(
      "nodes:\n"
      "  p: {type: pointConstraint, constrained: finger, targets: [head, root], \"targetWeight[1]\": 3}\n"
      "controls: {finger.translateX: {min: 0, max: 1}}\n",
      false);
  ASSERT_TRUE(player.ok());
  const Double3 place = At(player.World("head")) * 0.25 + At(player.World("root")) * 0.75;
  EXPECT_LT(Length(At(player.World("finger")) - place), 1e-12);
  player.Set("finger.translateX", 0.5);
  EXPECT_NEAR(Length(At(player.World("finger")) - place), 0.5, 1e-12);
}

TEST_F(RigConstraints, Errors) {
  const auto error = [&](const std::string& node) { return Errors("nodes:\n  c: {type: " + node + "}\n"); };
  EXPECT_EQ(error("pointConstraint, constrained: wirst.L, targets: [head]"),
            "t.yaml:4:43: unknown node \"wirst.L\" (did you mean \"wrist.L\"?)");
  EXPECT_EQ(error("pointConstraint, constrained: wrist.L, targets: [head, haed]"),
            "t.yaml:4:68: unknown node \"haed\" (did you mean \"head\"?)");
  EXPECT_EQ(error("pointConstraint, constrained: c, targets: [head]"),
            "t.yaml:4:43: \"c\" is a pointConstraint; expected a transform");
  EXPECT_EQ(error("pointConstraint, constrained: wrist.L, targets: []"),
            "t.yaml:4:61: targets: expected a list of transforms, found none");
  EXPECT_EQ(
      error("pointConstraint, constrained: wrist.L, target: [head]"),
      "t.yaml:4:52: node \"c\" (pointConstraint) has no attribute \"target\" (did you mean \"targets\"?)");
  EXPECT_EQ(error("poleVectorConstraint, constrained: wrist.L, targets: [head]"),
            "t.yaml:4:48: \"wrist.L\" is a transform; expected an ikHandle");
  EXPECT_EQ(error("ikHandle, start: upperarm01.L, end: wrist.L"),
            "t.yaml:4:3: ikHandle \"c\": expected all of start, mid, end");
  EXPECT_EQ(error("ikHandle, start: head, mid: lowerarm01.L, end: wrist.L"),
            "t.yaml:4:30: start \"head\" is no ancestor of mid \"lowerarm01.L\"");
  EXPECT_EQ(error("ikHandle, start: upperarm01.L, mid: wrist.L, end: lowerarm01.L"),
            "t.yaml:4:49: mid \"wrist.L\" is no ancestor of end \"lowerarm01.L\"");
  EXPECT_EQ(error("ikHandle, start: wrist.L, mid: wrist.L, end: finger"),
            "t.yaml:4:30: start \"wrist.L\" is no ancestor of mid \"wrist.L\"");
  EXPECT_EQ(error("ikHandle, start: nobody, mid: lowerarm01.L, end: wrist.L"),
            "t.yaml:4:30: unknown node \"nobody\" (did you mean \"body\"?)");
}

TEST_F(RigConstraints, AChainFollowsItsCurve) {
  const std::string nodes =
      "nodes:\n"
      "  rope: {type: curve, places: [[0, 2, 0], [1, 2.5, 0], [2, 2, 0]], parent: head}\n"
      "  spine: {type: splineIk, start: upperarm01.L, end: wrist.L, curve: rope";
  Rig rig = Loaded(nodes + "}\n");
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(Driver(rig, kArm[static_cast<std::size_t>(i)] + ".offsetParentMatrix"),
              fmt::format("spine.outMatrix[{}]", i));
  }
  EXPECT_EQ(Driver(rig, "spine.inMatrix[0]"), "upperarm01.L_clip.matrix");
  EXPECT_EQ(Driver(rig, "spine.parentMatrix"), "root.worldMatrix");
  EXPECT_EQ(Driver(rig, "spine.tipMatrix"), "wrist.L.matrix");
  RigPlayer plain = Play("", true), kept = Play(nodes + ", maintainOffset: on}\n", true),
            player = Play(nodes + "}\n", false);
  for (const std::string& joint : kArm) EXPECT_EQ(kept.World(joint), plain.World(joint)) << joint;
  player.Set("time.time", 0.7);
  EXPECT_LT(Length(At(player.World("upperarm01.L")) - Double3{0, 2, 0}), 1e-12);
  for (std::size_t j = 0; j + 2 < kArm.size(); ++j) {
    EXPECT_NEAR(Between(player.World(kArm[j]), player.World(kArm[j + 1])),
                Between(plain.World(kArm[j]), plain.World(kArm[j + 1])), 1e-12);
  }
  EXPECT_EQ(Driver(rig, "spine.curveMatrix"), "rope.worldMatrix");
  RigPlayer walker = Play(nodes + "}\ncontrols: {root.translateX: {min: -9, max: 9}}\n", false);
  const Double3 root = At(walker.World("root")), shoulder = At(walker.World("upperarm01.L")),
                elbow = At(walker.World("lowerarm01.L"));
  walker.Set("root.translateX", 3);
  const Double3 walked = At(walker.World("root")) - root;
  EXPECT_GT(Length(walked), 1);
  EXPECT_LT(Length(At(walker.World("upperarm01.L")) - shoulder - walked), 1e-6);
  EXPECT_LT(Length(At(walker.World("lowerarm01.L")) - elbow - walked), 1e-6);
  EXPECT_EQ(Errors("nodes:\n  s: {type: splineIk, start: head, end: wrist.L}\n"),
            "t.yaml:4:30: start \"head\" is no ancestor of end \"wrist.L\"");
  EXPECT_EQ(Errors("nodes:\n  s: {type: splineIk, start: head}\n"),
            "t.yaml:4:3: splineIk \"s\": expected all of start, end");
}

TEST_F(RigConstraints, TwistJointsTakeTheirShare) {
  const std::string nodes =
      "nodes:\n"
      "  hand: {type: transform, parent: root, at: lowerarm01.L}\n"
      "  twist: {type: twistDistribution, start: upperarm01.L, end: hand, constrained: [upperarm02.L]}\n"
      "controls: {hand.rotateX: {min: -90, max: 90}}\n";
  RigPlayer plain = Play("", true), player = Play(nodes, true);
  for (const std::string& joint : kArm) EXPECT_EQ(player.World(joint), plain.World(joint)) << joint;
  player.Set("hand.rotateX", 0.6);
  const Matrix4 moved = player.World("upperarm02.L");
  EXPECT_LT(Between(moved, plain.World("upperarm02.L")), 1e-12);
  Double3 place, scale;
  Quaternion a, b;
  DecomposeTrs(plain.World("upperarm02.L"), &place, &a, &scale);
  DecomposeTrs(moved, &place, &b, &scale);
  const Double3 turn = RotationVector(b * Conjugate(a));
  EXPECT_GT(Length(turn), 0.1);
  // About the bone
  const Double3 bone = At(plain.World("lowerarm01.L")) - At(plain.World("upperarm01.L"));
  EXPECT_NEAR(std::fabs(Dot(turn, bone)), Length(turn) * Length(bone), 1e-9);
  EXPECT_EQ(
      Errors("nodes:\n  t: {type: twistDistribution, start: upperarm01.L, end: head, constrained: "
             "[lowerarm01.L]}\n"),
      "t.yaml:4:78: \"lowerarm01.L\" hangs neither under start \"upperarm01.L\" nor under a joint that is "
      "named before it");
  for (const char* keys : {"start: upperarm01.L, end: head", "constrained: [upperarm02.L]"}) {
    EXPECT_EQ(Errors(std::string("nodes:\n  t: {type: twistDistribution, ") + keys + "}\n"),
              "t.yaml:4:3: twistDistribution \"t\": expected all of start, end, constrained");
  }
}

TEST_F(RigConstraints, ATransformIsConstrainedOnce) {
  EXPECT_EQ(Errors("nodes:\n"
                   "  a: {type: pointConstraint, constrained: head, targets: [root]}\n"
                   "  b: {type: orientConstraint, constrained: head, targets: [root]}\n"),
            "t.yaml:5:44: \"head\" is constrained twice: by \"a\" at t.yaml:4:43, too");
  EXPECT_EQ(Errors(kHand + "  b: {type: orientConstraint, constrained: lowerarm01.L, targets: [root]}\n"),
            "t.yaml:6:44: \"lowerarm01.L\" is constrained twice: by \"ik\" at t.yaml:5:50, too");
  EXPECT_EQ(Errors(kHand + "  a: {type: poleVectorConstraint, constrained: ik, targets: [root]}\n"
                           "  b: {type: poleVectorConstraint, constrained: ik, targets: [root]}\n"),
            "t.yaml:7:48: \"ik\" is constrained twice: by \"a\" at t.yaml:6:48, too");
}

TEST_F(RigConstraints, CyclesAreErrorsAtTheConstraint) {
  const std::string below =
      Errors("nodes:\n  a: {type: parentConstraint, constrained: wrist.L, targets: [finger]}\n");
  EXPECT_TRUE(Has(below, "t.yaml:4:44: ")) << below;
  EXPECT_TRUE(Has(below, "would make a cycle: ")) << below;
  const std::string hand = Errors(
      "nodes:\n"
      "  hand: {type: transform, parent: finger}\n"
      "  ik: {type: ikHandle, start: upperarm01.L, mid: lowerarm01.L, end: wrist.L, target: "
      "hand.worldMatrix}\n");
  EXPECT_TRUE(Has(hand, "t.yaml:5:31: ")) << hand;
  EXPECT_TRUE(Has(hand, "would make a cycle: ")) << hand;
  // Each of two follows the other
  const std::string pair = Errors(
      "nodes:\n"
      "  a: {type: pointConstraint, constrained: head, targets: [wrist.L]}\n"
      "  b: {type: pointConstraint, constrained: wrist.L, targets: [head]}\n");
  EXPECT_TRUE(Has(pair, "t.yaml:5:")) << pair;
  EXPECT_TRUE(Has(pair, "would make a cycle: ")) << pair;
}

TEST_F(RigConstraints, AHumansArmReachesOverItsClip) {
  const std::string human = SharedFile("assets/human.glb");
  if (human.empty()) GTEST_SKIP() << "no assets beside the checkout";
  const std::string character = "kpsa: 1\ncharacter: " + human + "\n";
  const std::string nodes =
      "nodes:\n"
      "  hand: {type: transform, at: wrist.L}\n"
      "  ik: {type: ikHandle, start: upperarm01.L, mid: lowerarm01.L, end: wrist.L, target: "
      "hand.worldMatrix}\n"
      "  turn: {type: orientConstraint, constrained: wrist.L, targets: [hand], maintainOffset: on}\n"
      "  roll: {type: twistDistribution, start: lowerarm01.L, end: hand, constrained: [lowerarm02.L]}\n"
      "controls:\n"
      "  hand.translateX: {min: -1, max: 1}\n"
      "  hand.rotateY: {min: -90, max: 90}\n";
  const auto play = [&](const std::string& text, bool rest) {
    RigOptions options;
    options.rest = rest;
    if (!rest) options.clip = std::string("body_move");
    return RigPlayer(folder.Write("h.yaml", character + text), options);
  };
  RigPlayer plain = play("", true), rest = play(nodes, true), moving = play(nodes, false);
  ASSERT_TRUE(rest.ok() && moving.ok());
  EXPECT_EQ(rest.Points(), plain.Points());
  moving.Set("hand.translateX", -0.1);
  moving.Set("hand.rotateY", 0.5);
  for (const double time : {0.0, 1.3, 4.0}) {
    moving.Set("time.time", time);
    EXPECT_LT(Between(moving.World("wrist.L"), moving.World("hand")), 1e-9) << time;
  }
}

}  // namespace
}  // namespace kpsa::engine
