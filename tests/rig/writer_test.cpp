#include "rig/build/writer.h"

#include <algorithm>

#include "base/scalar_math.h"
#include "tests/rig/rig_fixture.h"
#include "tests/support/shared_files.h"

namespace kpsa::engine {
namespace {

class RigWriterTest : public RigFixture {
 protected:
  std::string Starter(const std::string& path, const StarterOptions& options = {}) {
    Result<std::string> text = StarterRig(StandardRegistry(), path, options);
    EXPECT_TRUE(text.ok()) << text.status().ToString();
    return text.ok() ? *text : "";
  }
  // Loads a starter rig of a character elsewhere.
  Rig Reload(const std::string& path) {
    StarterOptions options;
    options.character = path;
    const std::string text = Starter(path, options);
    Result<Rig> rig = LoadRig(StandardRegistry(), folder.Write("starter.yaml", text));
    EXPECT_TRUE(rig.ok()) << rig.status().ToString() << text;
    return rig.ok() ? std::move(*rig) : Rig();
  }
  static const Control* Find(const Rig& rig, const std::string& name) {
    for (const Control& control : rig.controls) {
      if (control.name == name) return &control;
    }
    return nullptr;
  }
};

TEST_F(RigWriterTest, RangesControlsByTheClips) {
  const std::string text = Starter(folder / "c.gltf");
  // The clip turns tip by half a turn about Z and takes the weight from its default to 1; rest is always
  // inside
  EXPECT_TRUE(Has(text, "\ncharacter: c.gltf\n")) << text;
  EXPECT_TRUE(Has(text, "  tip.rotateZ: {min: 0, max: 180}\n")) << text;
  EXPECT_FALSE(Has(text, "tip.rotateX")) << text;
  EXPECT_TRUE(Has(text, "  \"body.weight[up]\"") || Has(text, "  body.weight[up]: {min: 0, max: 1}\n"))
      << text;
  EXPECT_TRUE(Has(text, "stack: [gltf, mush]")) << text;
  EXPECT_TRUE(Has(text, "points: [body@mush]")) << text;
  EXPECT_TRUE(Has(text, "test: {clips: [wave_test1]}")) << text;
  EXPECT_TRUE(Has(text, "train: {clips: [wave_train1, wave_train2], samples: 400}")) << text;
  const Rig rig = Reload(folder / "c.gltf");
  EXPECT_EQ(rig.controls.size(), 2u);
  EXPECT_EQ(rig.scene.meshes[0].stages.back().name, "mush");
  EXPECT_TRUE(rig.notes.empty());
}

// Clips are trained on and played at the frames that they were keyed at.
TEST_F(RigWriterTest, FramesASecondAreThoseOfTheKeys) {
  const auto of_keys = [](std::vector<double> times) {
    gltf::Clip clip;
    clip.channels.emplace_back().times = std::move(times);
    return FramesOfKeys({std::move(clip)});
  };
  EXPECT_EQ(FramesOfKeys({}), 24);
  EXPECT_EQ(of_keys({0, 0.5, 1, 7}), 24) << "of 30, too, but nothing says so";
  EXPECT_EQ(of_keys({0, 1 / 24.0, 5 / 24.0}), 24);
  EXPECT_EQ(of_keys({0, 2 / 25.0}), 25);
  EXPECT_EQ(of_keys({static_cast<double>(1 / 30.0f), static_cast<double>(301 / 30.0f)}), 30);
  EXPECT_EQ(of_keys({0, 1 / 60.0}), 60);
  EXPECT_EQ(of_keys({0.0123, 1.77}), 24) << "none";
  std::vector<gltf::Clip> mixed(3);
  for (const double rate : {24.0, 30.0, 30.0}) {
    gltf::Clip& clip = mixed[rate == 24 ? 0 : mixed[1].channels.empty() ? 1 : 2];
    clip.channels.emplace_back().times = {0, 1 / rate, 7 / rate};
  }
  EXPECT_EQ(FramesOfKeys(mixed), 30) << "of most";
  mixed.pop_back();
  EXPECT_EQ(FramesOfKeys(mixed), 24) << "of as many";
  GltfBuilder builder = GltfBuilder::Character();
  EXPECT_FALSE(Has(Starter(folder.Write("whole.gltf", builder.Text())), "fps"));
  const int times = builder.Accessor(std::vector<float>{0, 1 / 30.0f, 2}, "SCALAR");
  builder.root["accessors"][times]["min"] = {0};
  builder.root["accessors"][times]["max"] = {2};
  for (nlohmann::json& sampler : builder.root["animations"][0]["samplers"]) sampler["input"] = times;
  folder.Write("c.gltf", builder.Text());
  EXPECT_TRUE(Has(Starter(folder / "c.gltf"), "\nfps: 30  #"));
  EXPECT_EQ(Reload(folder / "c.gltf").fps, 30);
}

TEST_F(RigWriterTest, AwkwardNamesAreQuoted) {
  GltfBuilder builder = GltfBuilder::Character();
  builder.root["nodes"][2]["name"] = "tip: \"left\" # \\ 1";
  builder.root["nodes"][0]["name"] = "- body, [x] {y}";
  builder.root["meshes"][0]["extras"]["targetNames"][0] = "a.b c";
  folder.Write("c.gltf", builder.Text());
  const Rig rig = Reload(folder / "c.gltf");
  ASSERT_EQ(rig.controls.size(), 2u);
  EXPECT_EQ(rig.controls[0].name, "tip: \"left\" # \\ 1.rotateZ");
  EXPECT_EQ(rig.graph->PlugName(rig.controls[1].plug), "- body, [x] {y}_blendShape.weight[a.b c]");
  EXPECT_EQ(rig.accelerate[0].points.size(), 1u);
}

TEST_F(RigWriterTest, WithoutClipsRangesAreGuesses) {
  GltfBuilder builder = GltfBuilder::Character();
  builder.root.erase("animations");
  folder.Write("c.gltf", builder.Text());
  EXPECT_TRUE(Has(Starter(folder / "c.gltf"), "these ranges are guesses"));
  const Rig rig = Reload(folder / "c.gltf");
  ASSERT_NE(Find(rig, "tip.rotateX"), nullptr);
  EXPECT_DOUBLE_EQ(Find(rig, "tip.rotateX")->max, 15 * kPi / 180);
  EXPECT_NE(Find(rig, "body.weight[up]"), nullptr);
  EXPECT_TRUE(rig.accelerate[0].test_clips.empty());
}

TEST_F(RigWriterTest, TranslationsAreInCentimetresAndIdleJointsAreLeftOut) {
  GltfBuilder builder = GltfBuilder::Character();
  const int times = builder.Accessor<float>({0, 1}, "SCALAR");
  const int moves = builder.Accessor<float>({0, 1, 0, 0.0f, 1.0204f, 0}, "VEC3");
  auto& clip = builder.root["animations"][0];
  clip["samplers"].push_back({{"input", times}, {"output", moves}});
  builder.Push("nodes", {{"name", "idle"}});
  clip["channels"].push_back({{"sampler", 2}, {"target", {{"node", 1}, {"path", "translation"}}}});
  clip["channels"].push_back({{"sampler", 2}, {"target", {{"node", 4}, {"path", "translation"}}}});
  folder.Write("c.gltf", builder.Text());
  const std::string text = Starter(folder / "c.gltf");
  EXPECT_TRUE(Has(text, "root.translateY: {min: 0, max: 2.1}") ||
              Has(text, "root.translateY: {min: 0, max: 3}"))
      << text;
  EXPECT_FALSE(Has(text, "  idle.translate")) << text;
  EXPECT_TRUE(Has(text, "carrying no point: idle")) << text;
}

TEST_F(RigWriterTest, ACharacterWithoutMeshesStillLoads) {
  GltfBuilder builder = GltfBuilder::Character();
  builder.root["scenes"][0]["nodes"] = {1};
  folder.Write("c.gltf", builder.Text());
  const Rig rig = Reload(folder / "c.gltf");
  EXPECT_TRUE(rig.scene.meshes.empty());
  const std::string text = *StarterRig(StandardRegistry(), folder / "c.gltf");
  EXPECT_NE(text.find("kpsa validate, eval, render."), std::string::npos) << text;
  EXPECT_FALSE(StarterRig(StandardRegistry(), folder / "nobody.glb").ok());
}

// The body of a character with an arm and a jaw, in which some names are taken already.
std::string Figure() {
  GltfBuilder builder = GltfBuilder::Character();
  auto& nodes = builder.root["nodes"];
  const auto add = [&](const char* name, std::size_t parent, std::vector<double> translation) {
    const int node = builder.Push("nodes", {{"name", name}, {"translation", translation}});
    nodes[parent]["children"].push_back(node);
    builder.root["skins"][0]["joints"].push_back(node);
    return static_cast<std::size_t>(node);
  };
  const std::size_t upper = add("upperarm.L", 1, {0.2, 0.5, 0}),
                    lower = add("lowerarm.L", upper, {0.3, 0, 0.05});
  add("hand.L", lower, {0.3, 0, -0.05});
  nodes[2]["name"] = "jaw";
  builder.Push("nodes", {{"name", "mush"}});
  builder.Push("nodes", {{"name", "handLGoal"}});
  builder.root["skins"][0].erase("inverseBindMatrices");
  return builder.Text();
}

// What is suggested in comments works, too.
TEST_F(RigWriterTest, SuggestionsLoadWhenTheirSignsAreTakenOut) {
  folder.Write("c.gltf", Figure());
  std::string text = Starter(folder / "c.gltf");
  EXPECT_TRUE(Has(text, "\n  mush2: {type: deltaMush")) << text;
  EXPECT_TRUE(Has(text, "#handLGoal2: {type: transform, at: hand.L}")) << text;
  EXPECT_TRUE(Has(text, "start: upperarm.L, mid: lowerarm.L, end: hand.L")) << text;
  EXPECT_TRUE(Has(text, "#handLGoal2.translateX: {min: -15, max: 15}")) << text;
  EXPECT_TRUE(Has(text, "joint: jaw, above: 0.05")) << text;
  const Rig plain = Reload(folder / "c.gltf");
  const auto at = text.find("stack: [gltf, mush2]");
  ASSERT_NE(at, std::string::npos) << text;
  text.replace(at, 20, "stack: [gltf, jawCage, mush2]");
  for (std::size_t sign = text.find('#'); sign != std::string::npos; sign = text.find('#', sign)) {
    if (text[sign + 1] != ' ') {
      text.erase(sign, 1);
    } else {
      ++sign;
    }
  }
  const Result<Rig> rig = LoadRig(StandardRegistry(), folder.Write("all.yaml", text));
  ASSERT_TRUE(rig.ok()) << rig.status().ToString() << text;
  EXPECT_EQ(rig->controls.size(), plain.controls.size() + 3);
  EXPECT_EQ(rig->scene.meshes[0].stages.size(), plain.scene.meshes[0].stages.size() + 1);
  EXPECT_TRUE(rig->graph->FindNode("handLGoal2Ik").ok());
  EXPECT_TRUE(rig->notes.empty());
}

TEST_F(RigWriterTest, ControlsAreGrouped) {
  GltfBuilder builder = GltfBuilder::Character();
  builder.root["nodes"][1]["name"] = "spine";
  builder.root["nodes"][2]["name"] = "hand.R";
  builder.root["meshes"][0]["extras"]["targetNames"][0] = "blink.L";
  builder.root.erase("animations");
  folder.Write("c.gltf", builder.Text());
  const std::string text = Starter(folder / "c.gltf");
  std::size_t last = 0;
  for (const char* part : {"  # Body\n  spine.rotateX", "  # Arm, right\n  hand.R.rotateX",
                           "  # Shapes of body, left\n  body.weight[blink.L]"}) {
    const std::size_t at = text.find(part);
    ASSERT_NE(at, std::string::npos) << part << "\n" << text;
    EXPECT_GT(at, last) << part;
    last = at;
  }
}

TEST_F(RigWriterTest, EveryAssetGetsARigThatLoads) {
  if (SharedFile("assets/head.glb").empty()) GTEST_SKIP() << "no assets beside the checkout";
  for (const char* name :
       {"head.glb", "human.glb", "robot.glb", "Fox.glb", "MorphStressTest.gltf", "SimpleSkin.gltf",
        "rigged_simple.gltf", "box_animated.gltf", "AnimatedMorphCube/AnimatedMorphCube.gltf"}) {
    SCOPED_TRACE(name);
    const Rig rig = Reload(SharedFile(std::string("assets/") + name));
    EXPECT_FALSE(rig.controls.empty());
    ASSERT_EQ(rig.accelerate.size(), 1u);
    EXPECT_EQ(rig.accelerate[0].points.size(), rig.scene.meshes.size());
    EXPECT_EQ(rig.accelerate[0].test_clips.size(), 1u);
    for (const Control& control : rig.controls) EXPECT_LT(control.min, control.max) << control.name;
  }
}

TEST_F(RigWriterTest, TheHead) {
  const std::string path = SharedFile("assets/head.glb");
  if (path.empty()) GTEST_SKIP() << "no assets beside the checkout";
  const Rig rig = Reload(path);
  EXPECT_EQ(rig.graph->name(*rig.accelerate[0].space), "head");
  EXPECT_EQ(rig.accelerate[0].test_clips, std::vector<std::string>{"face_talk"});
  EXPECT_EQ(rig.accelerate[0].train_clips, std::vector<std::string>{"face_extreme"});
  const Control* jaw = Find(rig, "jaw.rotateX");
  ASSERT_NE(jaw, nullptr);
  EXPECT_NEAR(jaw->min, -25 * kPi / 180, 1e-9);
  EXPECT_NEAR(jaw->max, 4 * kPi / 180, 1e-9);
  EXPECT_EQ(Find(rig, "tongue00.rotateX"), nullptr);  // no geometry
  EXPECT_NE(Find(rig, "head_mesh.weight[mouth-open]"), nullptr);
  EXPECT_GT(rig.controls.size(), 80u);
}

}  // namespace
}  // namespace kpsa::engine
