// VRM characters: expressions as controls, node constraints as nodes, and all that may be wrong with either.
#include "base/scalar_math.h"
#include "tests/rig/rig_player.h"

namespace kpsa::engine {
namespace {

using nlohmann::json;

// The builder's character with a second target on its mesh, shown by a second node as well: nodes 0 body, 1
// root, 2 tip, 3 plain, 4 twin. Target `up` moves vertex 1 by z 2, `side` by x 4.
GltfBuilder Faces() {
  GltfBuilder b = GltfBuilder::Character();
  const int side = b.Accessor<float>({0, 0, 0, 4, 0, 0, 0, 0, 0}, "VEC3");
  json& mesh = b.root["meshes"][0];
  mesh["primitives"][0]["targets"].push_back({{"POSITION", side}});
  mesh["extras"]["targetNames"] = {"up", "side"};
  mesh["weights"] = {0.25, 0};
  b.root.erase("animations");
  b.root["nodes"].push_back({{"name", "twin"}, {"mesh", 0}});
  b.root["scenes"][0]["nodes"].push_back(4);
  return b;
}
json Bind(int node, int index, double weight) {
  return {{"node", node}, {"index", index}, {"weight", weight}};
}

class VrmTest : public RigFixture {
 protected:
  std::string Write(const GltfBuilder& b) { return folder.Write("c.vrm", b.Glb()); }
  // Where expressions and the like are controls.
  std::string Rigged(const GltfBuilder& b, const std::vector<std::string>& controls) {
    Write(b);
    std::string text = "kpsa: 1\ncharacter: c.vrm\ncontrols:\n";
    for (const std::string& control : controls) text += "  \"" + control + "\": {min: 0, max: 1}\n";
    return folder.Write("t.yaml", text);
  }
  gltf::Character Load(const GltfBuilder& b) {
    Result<gltf::Character> c = gltf::LoadGltf(Write(b));
    EXPECT_TRUE(c.ok()) << c.status().ToString();
    return c.ok() ? std::move(*c) : gltf::Character();
  }
};

// The displacement of vertex 1 from where it is without any weight, by the mesh's axes (morph, before the
// skin).
Double3 Displaced(RigPlayer* player, std::size_t mesh) {
  return player->Points("morph", mesh)[player->PointOf(1, mesh)] - Double3{1, 0, 0};
}

TEST_F(VrmTest, ExpressionsOfVersion1) {
  GltfBuilder b = Faces();
  b.root["extensions"]["VRMC_vrm"] = {
      {"specVersion", "1.0"},
      {"expressions",
       {{"preset",
         {{"happy",
           {{"morphTargetBinds", {Bind(0, 0, 0.5), Bind(0, 1, 1), Bind(4, 1, 0.25)}},
            {"overrideBlink", "block"}}},
          {"blink", {{"morphTargetBinds", {Bind(0, 0, 1)}}}},
          {"neutral", json::object()}}},
        {"custom", {{"wink wink", {{"isBinary", true}, {"morphTargetBinds", {Bind(0, 1, 0.5)}}}}}}}}};
  const gltf::Character c = Load(b);
  EXPECT_TRUE(c.warnings.empty());
  ASSERT_EQ(c.expressions.size(), 4u);
  RigPlayer player(Rigged(b, {"expressions.weight[happy]", "expressions.weight[blink]",
                              "expressions.weight[wink wink]", "body.weight[up]"}));
  ASSERT_TRUE(player.ok());
  EXPECT_EQ(Displaced(&player, 0), (Double3{0, 0, 0.5}));  // its own weight, 0.25 of 2
  player.Set("expressions.weight[blink]", 0.5);
  EXPECT_EQ(Displaced(&player, 0), (Double3{0, 0, 1.5}));
  EXPECT_EQ(Displaced(&player, 1), (Double3{0, 0, 0.5}));  // blink is bound on the other node only
  player.Set("expressions.weight[happy]", 0.5);            // which blocks it
  EXPECT_EQ(Displaced(&player, 0), (Double3{2, 0, 1}));
  EXPECT_EQ(Displaced(&player, 1), (Double3{0.5, 0, 0.5}));
  player.Set("expressions.weight[wink wink]", 0.5);
  EXPECT_EQ(Displaced(&player, 0), (Double3{2, 0, 1}));
  player.Set("expressions.weight[wink wink]", 0.75);  // 0.5 + 0.5 of side
  EXPECT_EQ(Displaced(&player, 0), (Double3{4, 0, 1}));
  player.Set("expressions.weight[happy]", 1);  // the sum stays within 1
  EXPECT_EQ(Displaced(&player, 0), (Double3{4, 0, 1.5}));
  player.Set("body.weight[up]", 1);
  EXPECT_EQ(Displaced(&player, 0), (Double3{4, 0, 2}));
}

TEST_F(VrmTest, ExpressionsOfVersion0) {
  GltfBuilder b = Faces();
  const auto bind = [](int mesh, int index, double weight) -> json {
    return {{"mesh", mesh}, {"index", index}, {"weight", weight}};
  };
  b.root["extensions"]["VRM"] = {
      {"blendShapeMaster",
       {{"blendShapeGroups",
         {{{"name", "Joy"}, {"presetName", "joy"}, {"binds", {bind(0, 0, 75), bind(0, 1, 100)}}},
          {{"name", "Odd"}, {"presetName", "unknown"}, {"binds", {bind(0, 1, 50)}}, {"materialValues", {1}}},
          {{"name", "Odd"}, {"presetName", "unknown"}, {"binds", {bind(0, 7, 50), bind(-1, 0, 50)}}},
          {{"name", ""}}}}}}};
  const gltf::Character c = Load(b);
  ASSERT_EQ(c.expressions.size(), 4u);
  EXPECT_EQ(c.expressions[2].name, "Odd#2");
  EXPECT_EQ(c.expressions[3].name, "expression3");
  ASSERT_EQ(c.warnings.size(), 2u);
  EXPECT_TRUE(Has(c.warnings[0], "2 part(s) of VRM's extensions")) << c.warnings[0];
  EXPECT_TRUE(Has(c.warnings[0], "VRM.blendShapeMaster.blendShapeGroups[2].binds[0], ...")) << c.warnings[0];
  EXPECT_TRUE(Has(c.warnings[1], "materials")) << c.warnings[1];
  RigPlayer player(Rigged(b, {"expressions.weight[joy]", "expressions.weight[Odd]"}));
  ASSERT_TRUE(player.ok());
  player.Set("expressions.weight[joy]", 0.5);
  for (const std::size_t mesh : {0, 1})  // wherever the mesh is shown
    EXPECT_EQ(Displaced(&player, mesh), (Double3{2, 0, (0.25 + 0.375) * 2})) << mesh;
  player.Set("expressions.weight[Odd]", 0.25);
  EXPECT_EQ(Displaced(&player, 0), (Double3{2.5, 0, 1.25}));
}

TEST_F(VrmTest, ClipsAndCombinationsGoTogetherWithExpressions) {
  GltfBuilder b = Faces();
  const int times = b.Accessor<float>({0, 1}, "SCALAR"),
            morph = b.Accessor<float>({0, 0, 0.5f, 0.25f}, "SCALAR");
  b.Push("animations", {{"name", "talk"},
                        {"samplers", {{{"input", times}, {"output", morph}}}},
                        {"channels", {{{"sampler", 0}, {"target", {{"node", 0}, {"path", "weights"}}}}}}});
  b.root["extensions"]["VRMC_vrm"]["expressions"]["preset"]["aa"]["morphTargetBinds"] =
      json::array({Bind(0, 0, 1)});
  RigPlayer player(Rigged(b, {"expressions.weight[aa]"}));
  ASSERT_TRUE(player.ok());
  player.Set("time.time", 1);
  EXPECT_EQ(Displaced(&player, 0), (Double3{1, 0, 1}));
  player.Set("expressions.weight[aa]", 0.25);
  EXPECT_EQ(Displaced(&player, 0), (Double3{1, 0, 1.5}));

  Rigged(b, {});
  RigOptions still;
  still.rest = true;
  RigPlayer combined(
      folder.Write("u.yaml",
                   "kpsa: 1\ncharacter: c.vrm\ncontrols: {\"body.weight[side]\": {min: 0, max: 1}}\n"
                   "overrides:\n  body.combinations: {up: {targets: [side]}}\n"),
      still);
  ASSERT_TRUE(combined.ok());
  combined.Set("body.weight[side]", 0.5);
  EXPECT_EQ(Displaced(&combined, 0), (Double3{2, 0, 1}));
}

TEST_F(VrmTest, ConstraintsFollowTheirSources) {
  GltfBuilder b = Faces();
  json& nodes = b.root["nodes"];
  // 5 arm (source), 6 twist: half of its roll about x; 7 copy: its rotation; 8 eye looks at it; 9 on 7: a
  // chain
  const auto with = [](json node, const char* kind, json constraint) {
    node["extensions"]["VRMC_node_constraint"] = {{"specVersion", "1.0"},
                                                  {"constraint", {{kind, constraint}}}};
    return node;
  };
  nodes.push_back({{"name", "arm"}, {"translation", {0, 3, 0}}});
  nodes.push_back(with({{"name", "twist"}}, "roll", {{"source", 5}, {"rollAxis", "X"}, {"weight", 0.5}}));
  nodes.push_back(with({{"name", "copy"}, {"translation", {1, 0, 0}}}, "rotation", {{"source", 5}}));
  nodes.push_back(with({{"name", "eye"}}, "aim", {{"source", 5}, {"aimAxis", "PositiveZ"}}));
  nodes.push_back(with({{"name", "chain"}}, "rotation", {{"source", 7}}));
  for (int i = 5; i < 10; ++i) b.root["scenes"][0]["nodes"].push_back(i);
  const gltf::Character c = Load(b);
  EXPECT_TRUE(c.warnings.empty());
  EXPECT_EQ(c.constraints.size(), 4u);
  RigPlayer player(Rigged(b, {"arm.rotateX", "arm.translateY", "arm.translateZ"}));
  ASSERT_TRUE(player.ok());
  EXPECT_EQ(Driver(player.rig, "twist.offsetParentMatrix"), "twist_constraint.outMatrix");
  EXPECT_EQ(player.World("copy"), Translation({1, 0, 0}));
  player.Set("arm.rotateX", kPi / 2);
  const auto axis = [&](const char* node, int column) {
    const Matrix4 m = player.World(node);
    return Double3{m(0, column), m(1, column), m(2, column)};
  };
  const auto near = [](Double3 a, Double3 e) { return Length(a - e) < 1e-9; };
  const double half = std::sqrt(0.5);
  EXPECT_TRUE(near(axis("twist", 1), {0, half, half}));
  EXPECT_TRUE(near(axis("copy", 1), {0, 0, 1}));
  EXPECT_TRUE(near(axis("copy", 3), {1, 0, 0}));
  EXPECT_TRUE(near(axis("chain", 1), {0, 0, 1}));
  EXPECT_TRUE(near(axis("eye", 2), {0, 1, 0}));
  player.Set("arm.translateY", -3);
  player.Set("arm.translateZ", 2);
  EXPECT_TRUE(near(axis("eye", 2), {0, 0, 1}));
}

// A clip still moves what is constrained; a rig's own constraint goes on top.
TEST_F(VrmTest, ConstraintsUnderClipsAndRigs) {
  GltfBuilder b = Faces();
  const int times = b.Accessor<float>({0, 1}, "SCALAR"),
            places = b.Accessor<float>({0, 0, 0, 0, 0, 5}, "VEC3");
  b.Push("animations",
         {{"name", "go"},
          {"samplers", {{{"input", times}, {"output", places}}}},
          {"channels", {{{"sampler", 0}, {"target", {{"node", 4}, {"path", "translation"}}}}}}});
  b.root["nodes"][4]["extensions"]["VRMC_node_constraint"]["constraint"]["rotation"] = {{"source", 1}};
  RigPlayer player(Rigged(b, {"root.rotateZ"}));
  ASSERT_TRUE(player.ok());
  player.Set("time.time", 1);
  player.Set("root.rotateZ", kPi / 2);
  const Matrix4 m = player.World("twin");
  EXPECT_NEAR(m(2, 3), 5, 1e-12);
  EXPECT_NEAR(m(1, 0), 1, 1e-12);

  Rigged(b, {});
  RigPlayer point(
      folder.Write("u.yaml",
                   "kpsa: 1\ncharacter: c.vrm\ncontrols: {root.rotateZ: {min: -1, max: 1}}\nnodes:\n"
                   "  p: {type: pointConstraint, constrained: twin, targets: [root]}\n"));
  ASSERT_TRUE(point.ok());
  EXPECT_EQ(Driver(point.rig, "twin.offsetParentMatrix"), "p.outMatrix");
  EXPECT_EQ(Driver(point.rig, "p.inMatrix"), "twin_constraint.outMatrix");
  point.Set("root.rotateZ", kPi / 2);
  EXPECT_NEAR(point.World("twin")(1, 0), 1, 1e-12);
  EXPECT_NEAR(point.World("twin")(1, 3), 1, 1e-12);  // root's place
}

TEST_F(VrmTest, RigsMayHaveSuchConstraintsThemselves) {
  RigPlayer player(folder.Write(
      "t.yaml",
      "kpsa: 1\ncharacter: c.gltf\ncontrols: {root.rotateZ: {min: -1, max: 1}}\nnodes:\n"
      "  turn: {type: vrmRotationConstraint, constrained: tip, sourceMatrix: root.matrix, weight: 0.5}\n"));
  ASSERT_TRUE(player.ok());
  EXPECT_EQ(Driver(player.rig, "turn.inMatrix"), "tip_clip.matrix");
  player.Set("root.rotateZ", kPi / 3);
  EXPECT_NEAR(player.World("tip")(1, 0), 1, 1e-12);  // 60 degrees, and half as many
}

TEST_F(VrmTest, WhatNamesNothingIsLeftOut) {
  GltfBuilder b = Faces();
  const auto constrain = [&](std::size_t node, const json& constraint) {
    b.root["nodes"][node]["extensions"]["VRMC_node_constraint"] = constraint;
  };
  const std::vector<json> bad = {3,
                                 json::object(),
                                 {{"constraint", 4}},
                                 {{"constraint", {{"rotation", {{"source", 99}}}}}},
                                 {{"constraint", {{"rotation", {{"source", 2}}}}}},  // itself
                                 {{"constraint", {{"roll", {{"source", 1}}}}}},
                                 {{"constraint", {{"roll", {{"source", 1}, {"rollAxis", "W"}}}}}},
                                 {{"constraint", {{"aim", {{"source", 1}, {"aimAxis", "X"}}}}}},
                                 {{"constraint", {{"rotation", {{"source", 1}, {"weight", "x"}}}}}}};
  for (const json& constraint : bad) {
    constrain(2, constraint);
    const gltf::Character c = Load(b);
    EXPECT_TRUE(c.constraints.empty()) << constraint;
    ASSERT_EQ(c.warnings.size(), 1u) << constraint;
    EXPECT_TRUE(Has(c.warnings[0], "nodes[2].extensions.VRMC_node_constraint")) << c.warnings[0];
  }
  // Round in a circle: one of them gives way
  constrain(2, {{"constraint", {{"rotation", {{"source", 4}}}}}});
  constrain(4, {{"constraint", {{"rotation", {{"source", 2}}}}}});
  constrain(1, {{"constraint", {{"aim", {{"source", 3}, {"aimAxis", "NegativeX"}}}}}});  // its own child
  RigPlayer player(Write(b));
  ASSERT_TRUE(player.ok());
  EXPECT_EQ(player.Points(0).size(), 3u);
  ASSERT_EQ(player.rig.scene.notes.size(), 1u);
  EXPECT_TRUE(Has(player.rig.scene.notes[0], "2 node constraint(s) would follow what follows them"))
      << player.rig.scene.notes[0];

  // Extensions of any other shape
  for (const json& any :
       {json(3), json::array({1}), json{{"expressions", 3}}, json{{"expressions", {{"preset", {1}}}}},
        json{{"expressions", {{"preset", {{"happy", 7}}}}}},
        json{{"expressions",
              {{"custom", {{"a", {{"morphTargetBinds", {7, {{"node", 1}}, Bind(0, 9, 1)}}}}}}}}},
        json{{"blendShapeMaster", {{"blendShapeGroups", {4, {{"binds", {3}}}}}}}}}) {
    GltfBuilder odd = Faces();
    odd.root["extensions"]["VRMC_vrm"] = any;
    Load(odd);
    odd.root["extensions"] = {{"VRM", any}};
    Load(odd);
  }
}

TEST_F(VrmTest, TooManyConstraintsAreRefused) {
  GltfBuilder b = Faces();
  for (int i = 0; i < 1001; ++i) {
    b.root["nodes"].push_back(
        {{"extensions", {{"VRMC_node_constraint", {{"constraint", {{"rotation", {{"source", 1}}}}}}}}}});
  }
  const Result<Rig> rig = LoadRig(StandardRegistry(), Write(b));
  ASSERT_FALSE(rig.ok());
  EXPECT_TRUE(Has(rig.status().ToString(), "has 1001 node constraints; at most 1000"))
      << rig.status().ToString();
}

}  // namespace
}  // namespace kpsa::engine
