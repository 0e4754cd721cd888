// Every deformer through a rig file, on a small character: a tube along y with the joints root (at its foot)
// and tip (half way up), and the morph targets smile, smile_half, open and smileOpen.
#include <cmath>

#include "base/scalar_math.h"
#include "tests/rig/rig_player.h"

namespace kpsa::engine {
namespace {

constexpr int kRings = 9, kSides = 8;

std::string Tube() {
  GltfBuilder b;
  std::vector<float> positions, weights, deltas[4];
  std::vector<std::uint8_t> joints;
  std::vector<std::uint16_t> indices;
  for (int ring = 0; ring < kRings; ++ring) {
    for (int side = 0; side < kSides; ++side) {
      const double y = 2.0 * ring / (kRings - 1), angle = 2 * kPi * side / kSides;
      for (double c : {0.25 * Cos(angle), y, 0.25 * Sin(angle)}) positions.push_back(static_cast<float>(c));
      const float tip = static_cast<float>(std::clamp(y - 0.5, 0.0, 1.0));
      joints.insert(joints.end(), {0, 1, 0, 0});
      weights.insert(weights.end(), {1 - tip, tip, 0, 0});
      const float top = y > 1.4 ? 0.1f : 0;
      deltas[0].insert(deltas[0].end(), {top, 0, 0});
      deltas[1].insert(deltas[1].end(), {0, 0, top});
      deltas[2].insert(deltas[2].end(), {0, top, 0});
      deltas[3].insert(deltas[3].end(), {0, 0, -2 * top});
      if (ring + 1 == kRings) continue;
      const int next = (side + 1) % kSides, at = kSides * ring;
      for (int i :
           {at + side, at + side + kSides, at + next, at + next, at + side + kSides, at + next + kSides})
        indices.push_back(static_cast<std::uint16_t>(i));
    }
  }
  std::vector<float> inverse_binds(32, 0.f);
  for (std::size_t i = 0; i < 2; ++i) {
    for (std::size_t k = 0; k < 4; ++k) inverse_binds[16 * i + 5 * k] = 1;
  }
  inverse_binds[16 + 13] = -1;
  nlohmann::json targets;
  for (const std::vector<float>& delta : deltas) targets.push_back({{"POSITION", b.Accessor(delta, "VEC3")}});
  b.Push("meshes", {{"extras", {{"targetNames", {"smile", "smile_half", "open", "smileOpen"}}}},
                    {"primitives",
                     {{{"attributes",
                        {{"POSITION", b.Accessor(positions, "VEC3")},
                         {"JOINTS_0", b.Accessor(joints, "VEC4")},
                         {"WEIGHTS_0", b.Accessor(weights, "VEC4")}}},
                       {"indices", b.Accessor(indices, "SCALAR")},
                       {"targets", targets}}}}});
  b.Push("skins", {{"joints", {1, 2}}, {"inverseBindMatrices", b.Accessor(inverse_binds, "MAT4")}});
  b.Push("nodes", {{"name", "tube"}, {"mesh", 0}, {"skin", 0}});
  b.Push("nodes", {{"name", "root"}, {"children", {2}}});
  b.Push("nodes", {{"name", "tip"}, {"translation", {0, 1, 0}}});
  b.Push("scenes", {{"nodes", {0, 1}}});
  b.root["scene"] = 0;
  return b.Text();
}

class RigDeformers : public RigFixture {
 protected:
  RigDeformers() { folder.Write("c.gltf", Tube()); }
  std::string Write(const std::string& text) const {
    return folder.Write("t.yaml", "kpsa: 1\ncharacter: c.gltf\n" + text);
  }
};

// The vertex at a ring and a side, and where it is at rest.
Index Vertex(int ring, int side) { return static_cast<Index>(kSides * ring + side); }

const std::string kEverything = R"(nodes:
  axis: {type: transform, parent: root, at: [0, 1, 0]}
  grip: {type: transform, parent: tip, at: [0, 1.5, 0]}
  crease: {type: curve, vertices: [32, 34, 36, 38], parent: tip}
  brim: {type: curve, vertices: "64:71", closed: on, parent: tip}
  bender: {type: bend, matrix: axis.worldMatrix, parent: root}
  fix: {type: blendShape, targets: [open, smile_half], parent: tip, 'weight[open]': 0.5}
  wires: {type: wire, curves: [crease, brim], dropoff: 0.6, dropoffDistance: [0.5], crossingEffect: 0.25}
  twister: {type: twist, matrix: grip.worldMatrix, endAngle: 30}
  squasher: {type: squash, matrix: grip.worldMatrix, factor: 0.3, falloff: {at: grip, radius: 2}}
  flarer: {type: flare, matrix: grip.worldMatrix, endFlareX: 1.5}
  siner: {type: sine, matrix: grip.worldMatrix, amplitude: 0.05}
  waver: {type: wave, matrix: grip.worldMatrix, amplitude: 0.05, maxRadius: 2}
  cage: {type: lattice, parent: tip, divisions: [2, 4, 2], interpolation: bspline, localInfluence: [2, 3, 2], outside: falloff, outsideFalloffDist: 0.5, members: {joint: tip, above: 0.4}}
  grow: {type: cluster, matrix: grip.worldMatrix, parent: tip, members: {joint: tip, above: 0.9}}
  poke: {type: softMod, matrix: grip.worldMatrix, parent: tip, falloffRadius: 0.4}
  mush: {type: deltaMush, iterations: 4, distanceWeight: 0.5, displacement: 0.8}
  wrinkle: {type: tension, compressScale: 0.2, stretchScale: -0.1}
deform: [{meshes: [tube], stack: [morph, bender, skin, fix, wires, twister, squasher, flarer, siner, waver, cage, grow, poke, mush, wrinkle]}]
connections:
  - tip.translateX -> crease.cv[1].y
overrides:
  tube_skinCluster.skinningMethod: dualQuaternion
  tube.inbetweens: {smile: {0.5: smile_half}}
  tube_blendShape.combinations: {smileOpen: {targets: [smile, open], method: lowestWeighting}}
  cage.points[1,2,0].x: 1.4
  brim.cv[3].y: 0.2
controls:
  tip.rotateX: {min: -120, max: 120}
  tip.translateX: {min: -1, max: 1}
  root.rotateZ: {min: -180, max: 180}
  root.translateX: {min: -9, max: 9}
  grip.rotateY: {min: -90, max: 90}
  bender.curvature: {min: -90, max: 90}
  'tube.weight[smile]': {min: 0, max: 1}
  'tube.weight[open]': {min: 0, max: 1}
)";

const std::vector<std::string> kStages = {"morph",   "bender",   "skin",   "fix",   "wires",
                                          "twister", "squasher", "flarer", "siner", "waver",
                                          "cage",    "grow",     "poke",   "mush",  "wrinkle"};

void Pose(RigPlayer* player) {
  player->Set("tip.rotateX", 0.8);
  player->Set("tip.translateX", 0.05);
  player->Set("grip.rotateY", 0.4);
  player->Set("bender.curvature", 0.3);
  player->Set("tube.weight[smile]", 0.75);
  player->Set("tube.weight[open]", 0.5);
}

TEST_F(RigDeformers, EveryOneActs) {
  RigPlayer player(Write(kEverything));
  ASSERT_TRUE(player.ok());
  Pose(&player);
  std::vector<Double3> before = player.Points("morph");
  for (std::size_t i = 1; i < kStages.size(); ++i) {
    const std::vector<Double3> after = player.Points(kStages[i]);
    const double moved = MaxDistance(before, after);
    EXPECT_GT(moved, 1e-3) << kStages[i];
    EXPECT_LT(moved, 3) << kStages[i];
    before = after;
  }
}

// The whole stack goes with the character: handles, parents and curves follow it.
TEST_F(RigDeformers, AllOfThemGoWithTheCharacter) {
  RigPlayer player(Write(kEverything));
  ASSERT_TRUE(player.ok());
  Pose(&player);
  std::vector<std::vector<Double3>> expected;
  for (const std::string& stage : kStages) expected.push_back(player.Points(stage));
  const Matrix4 root = player.World("root");
  player.Set("root.rotateZ", 1.1);
  player.Set("root.translateX", 3);
  const Matrix4 motion = player.World("root") * InverseOrIdentity(root);
  for (std::size_t i = 0; i < kStages.size(); ++i) {
    const bool world = i >= 2;
    for (Double3& p : expected[i]) p = world ? TransformPoint(motion, p) : p;
    EXPECT_LT(MaxDistance(player.Points(kStages[i]), expected[i]), 5e-6) << kStages[i];
  }
}

TEST_F(RigDeformers, SomePointsHaveTheBitsOfAll) {
  Result<Rig> rig = LoadRig(StandardRegistry(), Write(kEverything + "  tip.rotateY: {min: 0, max: 90}\n"));
  ASSERT_TRUE(rig.ok()) << rig.status().ToString();
  Compiler compiler;
  const auto points = [&](const PlugRef& plug, const PointSet& set) {
    Request request;
    for (const Control& control : rig->controls) request.varying.push_back(control.plug);
    request.outputs.push_back({plug, set});
    Result<std::shared_ptr<const Plan>> plan = compiler.Compile(*rig->graph, request);
    EXPECT_TRUE(plan.ok()) << plan.status().ToString();
    Evaluator evaluator(*plan);
    for (const Control& control : rig->controls) {
      const Result<PlugHandle> handle = evaluator.FindVarying(*rig->graph, control.plug);
      EXPECT_TRUE(handle.ok());
      EXPECT_TRUE(evaluator.Set(*handle, control.unit == Unit::kLength ? 0.1 : 0.4).ok());
    }
    EXPECT_TRUE(evaluator.Evaluate().ok());
    const ConstPointsView view = evaluator.Points(0);
    std::vector<float> values;
    for (std::size_t i = 0; i < view.count; ++i) {
      for (const float* component : {view.x, view.y, view.z}) {
        if (component != nullptr) values.push_back(component[i]);
      }
    }
    return values;
  };
  const std::vector<Index> few = {3, 17, 40, 71};
  for (const char* name : {"wrinkle.outPoints[0]", "wrinkle.stretch[0]", "wrinkle.compress[0]"}) {
    const PlugRef plug = *rig->graph->FindPlug(name);
    const std::vector<float> all = points(plug, {}), some = points(plug, PointSet::Of(few, 72));
    const std::size_t width = all.size() / 72;
    std::vector<float> expected;
    for (Index p : few) {
      expected.insert(expected.end(), all.begin() + static_cast<std::ptrdiff_t>(width * p),
                      all.begin() + static_cast<std::ptrdiff_t>(width * (p + 1)));
    }
    EXPECT_EQ(some, expected) << name;
    EXPECT_GT(*std::max_element(all.begin(), all.end()), 0.0f) << name;
  }
}

TEST_F(RigDeformers, ShapesOfTheFileTakeRulesFromOverrides) {
  RigPlayer player(Write(R"(overrides:
  tube.inbetweens: {smile: {0.5: smile_half}}
  tube_blendShape.combinations: {smileOpen: {targets: [smile, open]}}
controls:
  'tube.weight[smile]': {min: 0, max: 1}
  'tube.weight[open]': {min: 0, max: 1}
)"));
  ASSERT_TRUE(player.ok());
  EXPECT_EQ(Driver(player.rig, "tube.weight[smileOpen]"), "tube_blendShape_smileOpen.outputWeight");
  const Index p = player.PointOf(Vertex(kRings - 1, 0));
  const auto moved = [&](double smile, double open) {
    player.Set("tube.weight[smile]", smile);
    player.Set("tube.weight[open]", open);
    return player.Points("morph")[p] - Double3{0.25, 2, 0};
  };
  const auto near = [](Double3 a, Double3 b) { return Length(a - b) < 1e-6; };
  EXPECT_TRUE(near(moved(0, 0), {0, 0, 0}));
  EXPECT_TRUE(near(moved(0.5, 0), {0, 0, 0.1}));
  EXPECT_TRUE(near(moved(0.75, 0), {0.05, 0, 0.05}));
  EXPECT_TRUE(near(moved(1, 0), {0.1, 0, 0}));
  EXPECT_TRUE(near(moved(1, 0.5), {0.1, 0.05, -0.1}));
  EXPECT_TRUE(near(moved(0.5, 0.5), {0, 0.05, 0.1 - 0.05}));
}

// After the skin, displacements are in world axes, or turn with a parent.
TEST_F(RigDeformers, ShapesAfterTheSkinTurnWithTheirParent) {
  for (const bool parent : {false, true}) {
    RigPlayer player(Write(std::string("nodes: {fix: {type: blendShape, targets: [smile, open]") +
                           (parent ? ", parent: tip" : "") + R"(, 'weight[open]': 2}}
deform: [{meshes: [tube], stack: [gltf, fix]}]
controls: {tip.rotateZ: {min: 0, max: 90}}
)"));
    ASSERT_TRUE(player.ok());
    player.Set("tip.rotateZ", kPi / 2);
    const Index p = player.PointOf(Vertex(kRings - 1, 0));
    const Double3 moved = player.Points("fix")[p] - player.Points("skin")[p];
    EXPECT_LT(Length(moved - (parent ? Double3{-0.2, 0, 0} : Double3{0, 0.2, 0})), 1e-6);
  }
}

// A corrective shape where the surface is pressed together.
TEST_F(RigDeformers, TensionWeighsShapes) {
  RigPlayer player(Write(R"(nodes:
  wrinkle: {type: tension}
  fix: {type: blendShape, targets: [open], 'weight[open]': 1}
connections: ["wrinkle.compress[0] -> fix.pointWeights[0]"]
deform: [{meshes: [tube], stack: [gltf, wrinkle, fix]}]
controls: {tip.scaleY: {min: 0, max: 2}}
)"));
  ASSERT_TRUE(player.ok());
  for (double scale : {1.0, 0.25, 1.5}) {
    player.Set("tip.scaleY", scale);
    const std::vector<Double3> before = player.Points("skin"), after = player.Points("fix");
    for (Index v = 0; v < kRings * kSides; ++v) {
      const Double3 moved = after[player.PointOf(v)] - before[player.PointOf(v)];
      const bool corrected = v >= 7 * kSides && scale < 1, still = v < 6 * kSides || scale >= 1;
      EXPECT_NEAR(moved.y, corrected ? 0.036 : 0, corrected ? 0.006 : still ? 0 : 0.05) << v << " " << scale;
    }
  }
}

TEST_F(RigDeformers, SkinsBlendByAWeightMap) {
  folder.Write("w.json", R"({"kpsa": "weights", "version": 1, "mesh": "tube", "points": 72,
 "maps": {"dq": {"default": 0, "indices": [32], "values": [1]}, "bad": {"default": 2, "indices": [], "values": []}}})");
  const auto points = [&](const std::string& overrides) {
    RigPlayer player(Write("overrides: {" + overrides + "}\ncontrols: {tip.rotateY: {min: 0, max: 180}}\n"));
    EXPECT_TRUE(player.ok());
    player.Set("tip.rotateY", 2.5);
    std::vector<Double3> by_vertex;
    const std::vector<Double3> all = player.Points();
    for (Index v = 0; v < kRings * kSides; ++v) by_vertex.push_back(all[player.PointOf(v)]);
    return by_vertex;
  };
  const std::vector<Double3> linear = points("tip.translateX: 0"),
                             dual = points("tube_skinCluster.skinningMethod: dualQuaternion"),
                             mixed = points(
                                 "tube_skinCluster.skinningMethod: weightBlended, "
                                 "tube_skinCluster.blendWeights: \"w.json#dq\"");
  EXPECT_LT(std::hypot(linear[32].x, linear[32].z), 0.1);  // pressed together
  EXPECT_NEAR(std::hypot(dual[32].x, dual[32].z), 0.25, 1e-6);
  for (std::size_t v = 0; v < linear.size(); ++v) EXPECT_EQ(mixed[v], v == 32 ? dual[v] : linear[v]) << v;
  EXPECT_TRUE(Has(Errors("overrides:\n  tube.blendWeights: \"w.json#bad\"\n"),
                  "t.yaml:4:22: blendWeights: 2 is outside of 0 to 1"));
  EXPECT_TRUE(Has(Errors("overrides:\n  tube.blendWeights: \"w.json#dp\"\n"), "t.yaml:4:22: "));
}

TEST_F(RigDeformers, ExplainsBadShapes) {
  const std::string text = Errors(R"(nodes:
  a: {type: blendShape}
  b: {type: blendShape, targets: [smlie]}
  c: {type: blendShape, targets: [smile, smile]}
  d:
    type: blendShape
    targets: [smile, open]
    inbetweens:
      smile: {0: open, 1.5: open}
      opne: {0.5: smile}
      open: {0.5: open}
    combinations:
      smile: {targets: [open, nobody]}
      open: {targets: [smile], method: sum}
      both: {target: [smile]}
deform: [{meshes: [tube], stack: [b, gltf, d]}]
overrides:
  tube.combinations:
    smile: {targets: [open]}
    open: {targets: [smileOpen]}
    smileOpen: {targets: [smile]}
  tube_blendShape.inbetweens: {smile: {0.5: open, 50%: smile_half}}
  tube.inbetweens: {}
)");
  EXPECT_TRUE(Has(text, "t.yaml:4:3: blendShape \"a\": the key \"targets\" is missing")) << text;
  EXPECT_TRUE(Has(text, "t.yaml:5:35: targets: \"smlie\" is no target of tube (did you mean \"smile\"?)"))
      << text;
  EXPECT_TRUE(Has(text, "t.yaml:6:42: targets: \"smile\" is named twice: here and at t.yaml:6:35")) << text;
  EXPECT_TRUE(Has(text, "t.yaml:11:15: an in-between of \"smile\" at 0: expected a weight of more than 0"))
      << text;
  EXPECT_TRUE(Has(text, "t.yaml:11:24: an in-between of \"smile\" at 1.5")) << text;
  EXPECT_TRUE(Has(text, "t.yaml:12:7: \"d\" has no target \"opne\" (did you mean \"open\"?)")) << text;
  EXPECT_TRUE(Has(text, "t.yaml:13:19: \"open\" cannot be its own in-between")) << text;
  EXPECT_TRUE(Has(text, "t.yaml:15:31: \"d\" has no target \"nobody\"")) << text;
  EXPECT_TRUE(Has(text, "t.yaml:16:40: method: expected multiply, lowestWeighting, smooth, found \"sum\""))
      << text;
  EXPECT_TRUE(Has(text, "t.yaml:17:7: \"d\" has no target \"both\"")) << text;
  EXPECT_TRUE(Has(text, "combination \"both\": the key \"targets\" is missing")) << text;
  EXPECT_TRUE(Has(text, "t.yaml:23:5: ") && Has(text, "would make a cycle: ")) << text;
  EXPECT_TRUE(Has(text, "\"smile\" has two in-betweens at 0.5")) << text;
  EXPECT_TRUE(
      Has(text, "t.yaml:25:3: tube_blendShape.inbetweens is overridden twice: here and at t.yaml:24:3"))
      << text;
  EXPECT_EQ(Errors("overrides: {tube.inbetweens: {}, tube.combinations: {}}\n"), "no error");
}

TEST_F(RigDeformers, ExplainsBadWiresAndStacks) {
  const std::string text = Errors(R"(nodes:
  lips: {type: curve, vertices: [0, 1]}
  a: {type: wire, curves: [lips, nobody]}
  b: {type: wire, curves: lips}
  c: {type: wire, curve: lips, curves: [lips]}
  d: {type: wire, curves: [tip]}
  t: {type: tension}
  cage: {type: lattice}
deform: [{points: cage.points, stack: [t]}, {meshes: [tube], stack: [gltf, cage]}]
)");
  EXPECT_TRUE(Has(text, "t.yaml:5:34: unknown node \"nobody\"")) << text;
  EXPECT_TRUE(Has(text, "t.yaml:6:27: curves: expected a list of curves")) << text;
  EXPECT_TRUE(Has(text, "t.yaml:7:32: \"c\" has a curve, too: write all of them in curves")) << text;
  EXPECT_TRUE(Has(text, "t.yaml:8:28: \"tip\" is a transform; expected a curve")) << text;
  EXPECT_TRUE(Has(text, "\"t\" measures the edges of a mesh, and cage.points has none")) << text;
}

}  // namespace
}  // namespace kpsa::engine
