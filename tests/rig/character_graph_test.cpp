#include "rig/character/character_graph.h"

#include "base/matrix.h"
#include "tests/rig/rig_fixture.h"
#include "tests/support/shared_files.h"

namespace kpsa::engine {
namespace {

gltf::Character Parse(const GltfBuilder& builder) {
  const std::string text = builder.Text();
  Result<gltf::Character> character = gltf::LoadGltfFromMemory(
      {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}, "", "t.gltf");
  EXPECT_TRUE(character.ok()) << character.status().ToString();
  return character.ok() ? std::move(*character) : gltf::Character();
}

class CharacterGraphTest : public ::testing::Test {
 protected:
  CharacterGraph Build(const gltf::Character& character, const CharacterOptions& options = {}) {
    Result<CharacterGraph> scene = BuildCharacterGraph(character, options, &graph);
    EXPECT_TRUE(scene.ok()) << scene.status().ToString();
    return scene.ok() ? std::move(*scene) : CharacterGraph();
  }
  PlugRef Plug(const std::string& name) {
    Result<PlugRef> plug = graph.FindPlug(name);
    EXPECT_TRUE(plug.ok()) << plug.status().ToString();
    return plug.ok() ? *plug : PlugRef();
  }
  std::string Driver(const std::string& name) {
    const Result<PlugRef> plug = graph.FindPlug(name);
    if (!plug.ok()) return plug.status().ToString();
    const Connection* connection = graph.FindConnection(*plug);
    return connection == nullptr ? "" : graph.PlugName(connection->source);
  }
  std::string Error(const std::string& plug) { return graph.FindPlug(plug).status().ToString(); }

  Graph graph{StandardRegistry()};
};

TEST_F(CharacterGraphTest, ConnectsTheHierarchyAndTheStack) {
  const gltf::Character character = Parse(GltfBuilder::Character());
  const CharacterGraph scene = Build(character);
  EXPECT_EQ(Driver("tip.parentMatrix"), "node3.worldMatrix");
  EXPECT_EQ(Driver("node3.parentMatrix"), "root.worldMatrix");
  EXPECT_EQ(Driver("root.parentMatrix"), "");
  EXPECT_EQ(graph.FindValue(Plug("root.offsetParentMatrix"))->get<Matrix4>(), Translation({0, 1, 0}));
  EXPECT_EQ(graph.FindValue(Plug("root.restMatrix"))->get<Matrix4>(), Translation({0, 1, 0}));
  EXPECT_EQ(Driver("body_blendShape.inPoints"), "body_mesh.points");
  EXPECT_EQ(Driver("body_skinCluster.inPoints"), "body_blendShape.outPoints[0]");
  EXPECT_EQ(Driver("body_skinCluster.matrix[0]"), "root.worldMatrix");
  EXPECT_EQ(Driver("body_skinCluster.matrix[1]"), "tip.worldMatrix");
  ASSERT_EQ(scene.meshes.size(), 1u);
  const CharacterMesh& mesh = scene.meshes[0];
  EXPECT_EQ(graph.PlugName(mesh.points), "body_skinCluster.outPoints[0]");
  EXPECT_TRUE(mesh.world);
  ASSERT_EQ(mesh.stages.size(), 2u);
  EXPECT_EQ(mesh.stages[0].name, "morph");
  EXPECT_FALSE(mesh.stages[0].world);
  EXPECT_EQ(mesh.FindStage("gltf"), &mesh.stages[1]);
  EXPECT_EQ(mesh.FindStage("skin"), &mesh.stages[1]);
  EXPECT_EQ(mesh.FindStage("mush"), nullptr);
  EXPECT_EQ(mesh.primitives[0].key, "body/0");
  EXPECT_EQ(mesh.primitives[0].vertex_count, 3u);
  EXPECT_EQ(mesh.mesh().data().primitives[0].material, "Skin");
}

TEST_F(CharacterGraphTest, FindsMorphWeightsOnTheMeshNode) {
  const gltf::Character character = Parse(GltfBuilder::Character());
  Build(character);
  EXPECT_EQ(graph.PlugName(Plug("body.weight[up]")), "body_blendShape.weight[up]");
  EXPECT_EQ(Plug("body.weight[up]"), Plug("body_blendShape.weight[0]"));
  EXPECT_DOUBLE_EQ(graph.FindValue(Plug("body.weight[up]"))->AsDouble(), 0.5);
  EXPECT_TRUE(Has(Error("body.weight[upp]"), "did you mean \"up\"?")) << Error("body.weight[upp]");
  EXPECT_TRUE(Has(Error("body.weigth[up]"), "did you mean \"weight\"?")) << Error("body.weigth[up]");
}

TEST_F(CharacterGraphTest, PlaysAndChangesClips) {
  GltfBuilder builder = GltfBuilder::Character();
  builder.root["animations"].push_back(builder.root["animations"][0]);
  builder.root["animations"][1]["name"] = "other";
  builder.root["animations"][1]["channels"].erase(1);
  const gltf::Character character = Parse(builder);
  CharacterGraph scene = Build(character);
  EXPECT_EQ(*scene.clip, "wave");
  EXPECT_EQ(Driver("tip.offsetParentMatrix"), "tip_clip.matrix");
  EXPECT_EQ(Driver("body.weight[up]"), "body_clipWeights.output[0]");
  EXPECT_EQ(Driver("tip_clip.time"), "time.time");
  const auto* keys = graph.FindValue(Plug("tip_clip.keys"))->asset<AnimationKeys>();
  ASSERT_NE(keys, nullptr);
  EXPECT_EQ(keys->data().rotation.times, (std::vector<double>{0, 1, 3}));
  EXPECT_TRUE(keys->data().translation.times.empty());

  ASSERT_TRUE(SetClip(character, "other", &scene, &graph).ok());
  EXPECT_EQ(Driver("tip.offsetParentMatrix"), "tip_clip.matrix");
  EXPECT_EQ(Driver("body.weight[up]"), "");
  ASSERT_TRUE(SetClip(character, std::nullopt, &scene, &graph).ok());
  EXPECT_EQ(Driver("tip.offsetParentMatrix"), "");
  EXPECT_FALSE(scene.clip.has_value());
  EXPECT_FALSE(graph.FindNode("tip_clip").ok());
  EXPECT_EQ(graph.FindValue(Plug("tip.offsetParentMatrix"))->get<Matrix4>(),
            character.nodes[2].LocalMatrix());
  const std::string unknown = SetClip(character, "weve", &scene, &graph).ToString();
  EXPECT_TRUE(Has(unknown, "has no clip \"weve\" (did you mean \"wave\"?); its clips are wave, other"))
      << unknown;
}

TEST_F(CharacterGraphTest, WithoutAClipNothingIsAnimated) {
  const gltf::Character character = Parse(GltfBuilder::Character());
  CharacterOptions options;
  options.rest = true;
  const CharacterGraph scene = Build(character, options);
  EXPECT_EQ(Driver("tip.offsetParentMatrix"), "");
  EXPECT_TRUE(scene.clip_nodes.empty());
}

TEST_F(CharacterGraphTest, SharedNamesAreNumberedAndFoundByPath) {
  GltfBuilder builder = GltfBuilder::Character();
  builder.root["nodes"][2]["name"] = "root";
  builder.root["nodes"].push_back({{"name", "time"}});
  builder.root["nodes"].push_back({{"name", "root#1"}});
  builder.root["nodes"].push_back({{"name", "body_mesh"}});
  const gltf::Character character = Parse(builder);
  Build(character);
  EXPECT_TRUE(Has(Error("root.translateX"), "\"root\" is the name of several nodes: write root#1# or root#2"))
      << Error("root.translateX");
  const std::string below = "/node3/root.translateX";
  EXPECT_EQ(Plug("root#2.translateX").node, Plug("/root" + below).node);
  EXPECT_NE(Plug("root#1.translateX").node,
            Plug("/root.translateX").node);  // somebody is really called root#1
  EXPECT_EQ(graph.name(Plug("/root.translateX").node), "root#1#");
  EXPECT_EQ(graph.def(Plug("time.time").node).name, "time");
  EXPECT_EQ(graph.def(Plug("time#4.translateX").node).name, "transform");
  EXPECT_EQ(graph.def(Plug("body_mesh.translateX").node).name, "transform");  // the file's names go first
  EXPECT_EQ(graph.def(Plug("body_mesh#0.mesh").node).name, "mesh");
}

TEST_F(CharacterGraphTest, UnskinnedMeshesFollowTheirNode) {
  GltfBuilder builder = GltfBuilder::Character();
  builder.root["nodes"][0].erase("skin");
  const gltf::Character character = Parse(builder);
  const CharacterGraph scene = Build(character);
  EXPECT_EQ(Driver("body_transformGeometry.matrix"), "body.worldMatrix");
  EXPECT_EQ(Driver("body_transformGeometry.inPoints"), "body_blendShape.outPoints[0]");
  EXPECT_EQ(scene.meshes[0].stages.back().name, "transform");
  EXPECT_EQ(scene.meshes[0].FindStage("skin"), &scene.meshes[0].stages.back());
  EXPECT_TRUE(scene.meshes[0].world);
}

TEST_F(CharacterGraphTest, OnlyTheSceneHasMeshesButJointsMayLieOutside) {
  GltfBuilder builder = GltfBuilder::Character();
  builder.Push("nodes", {{"name", "hidden"}, {"mesh", 0}, {"skin", 0}});
  builder.root["scenes"][0]["nodes"] = {0};  // the joints are not shown
  const gltf::Character character = Parse(builder);
  const CharacterGraph scene = Build(character);
  ASSERT_EQ(scene.meshes.size(), 1u);
  EXPECT_EQ(scene.meshes[0].name, "body");
  EXPECT_EQ(Driver("body_skinCluster.matrix[0]"), "root.worldMatrix");
}

TEST_F(CharacterGraphTest, PrimitivesWithoutInfluencesFollowTheNode) {
  GltfBuilder builder = GltfBuilder::Character();
  nlohmann::json rigid = builder.root["meshes"][0]["primitives"][0];
  rigid["attributes"].erase("JOINTS_0");
  rigid["attributes"].erase("WEIGHTS_0");
  builder.root["meshes"][0]["primitives"].push_back(rigid);
  const gltf::Character character = Parse(builder);
  const CharacterGraph scene = Build(character);
  EXPECT_EQ(scene.meshes[0].mesh().point_count(), 6u);  // equal positions, but nothing else
  EXPECT_EQ(scene.meshes[0].influences->joint_count(), 3u);
  EXPECT_EQ(Driver("body_skinCluster.matrix[2]"), "body.worldMatrix");
}

TEST_F(CharacterGraphTest, InstancesShareTheirGeometry) {
  GltfBuilder builder = GltfBuilder::Character();
  builder.Push("nodes", {{"name", "twin"}, {"mesh", 0}, {"skin", 0}});
  builder.root["scenes"][0]["nodes"].push_back(4);
  const gltf::Character character = Parse(builder);
  const CharacterGraph scene = Build(character);
  ASSERT_EQ(scene.meshes.size(), 2u);
  EXPECT_EQ(scene.meshes[0].geometry.mesh, scene.meshes[1].geometry.mesh);
  EXPECT_NE(scene.meshes[0].skin_cluster, scene.meshes[1].skin_cluster);
  EXPECT_EQ(scene.meshes[1].primitives[0].key, "twin/0");
}

TEST_F(CharacterGraphTest, DeepHierarchies) {
  gltf::Character character;
  constexpr Index kDepth = 100'000;
  character.nodes.resize(kDepth);
  gltf::Clip clip;
  clip.id = clip.name = "all";
  for (Index i = 0; i < kDepth; ++i) {
    character.nodes[i].name = i % 3 == 0 ? "bone" : "";  // shared and unnamed ones
    if (i > 0) {
      character.nodes[i].parent = i - 1;
      character.nodes[i - 1].children = {i};
    }
    character.nodes[i].translation = {0, 0.001, 0};
    character.order.push_back(i);
    gltf::Channel channel;
    channel.node = i;
    channel.times = {0};
    channel.values = {0, 0.001, 0};
    clip.channels.push_back(channel);
  }
  character.clips.push_back(clip);
  const CharacterGraph scene = Build(character);
  EXPECT_EQ(scene.transforms.size(), kDepth);
  EXPECT_EQ(scene.clip_nodes.size(), kDepth);
  EXPECT_EQ(Driver("node99998.parentMatrix"), "node99997.worldMatrix");
}

TEST_F(CharacterGraphTest, RefusesMoreThanItCanHold) {
  gltf::Character character = Parse(GltfBuilder::Character());
  character.skins[0].joints.resize(kMaxSkinJoints + 1);
  EXPECT_TRUE(Has(BuildCharacterGraph(character, {}, &graph).status().ToString(), "joints; at most"));
}

TEST_F(CharacterGraphTest, RobotHasMeshesAndJointsOfOneName) {
  const std::string path = SharedFile("assets/robot.glb");
  if (path.empty()) GTEST_SKIP() << "no assets beside the checkout";
  Result<gltf::Character> character = gltf::LoadGltf(path);
  ASSERT_TRUE(character.ok());
  const CharacterGraph scene = Build(*character);
  EXPECT_EQ(scene.meshes.size(), 14u);
  bool head = false;
  for (const CharacterMesh& mesh : scene.meshes) {
    if (mesh.name != "Head") continue;
    head = true;
    EXPECT_EQ(mesh.gltf_node, 49u);
    EXPECT_EQ(graph.name(mesh.transform), "Head#49");
    EXPECT_EQ(mesh.primitives.size(), 3u);
    EXPECT_LT(mesh.mesh().point_count(), mesh.vertex_count);  // hard edges were split
  }
  EXPECT_TRUE(head);
  EXPECT_TRUE(Has(Error("Head.translateX"), "is the name of several nodes: write Head#"))
      << Error("Head.translateX");
  EXPECT_TRUE(graph.FindNode("Head_skinCluster").ok());
}

}  // namespace
}  // namespace kpsa::engine
