// Scenes of an accelerated rig: what is set holds as long as it does in a scene of the plain rig.
#include <gtest/gtest.h>

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "kpsa/kpsa.h"
#include "tests/support/moving_character.h"
#include "tests/support/temporary_folder.h"

namespace {

using kpsa::Rig;
using kpsa::Scene;

// A strip with a morph target, whose weight the clip "talk" drives, and no control does.
class AcceleratedScene : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<kpsa::engine::TemporaryFolder>();
    kpsa::engine::MovingCharacter character;
    character.Swing("swing", 20, 1);
    auto& builder = character.builder;
    std::vector<float> delta;
    for (int i = 0; i < character.kPoints; ++i) delta.insert(delta.end(), {0, 0, i < 11 ? 0.1f : 0});
    auto& mesh = builder.root["meshes"][0];
    mesh["primitives"][0]["targets"] = {{{"POSITION", builder.Accessor(delta, "VEC3")}}};
    mesh["weights"] = {0};
    const std::vector<float> times{0, 0.5f, 1}, weights{0.1f, 0.4f, 0.2f};
    const int input = builder.Accessor(times, "SCALAR"), output = builder.Accessor(weights, "SCALAR");
    builder.Push("animations",
                 {{"name", "talk"},
                  {"samplers", {{{"input", input}, {"output", output}}}},
                  {"channels", {{{"sampler", 0}, {"target", {{"node", 0}, {"path", "weights"}}}}}}});
    folder_->Write("strip.glb", builder.Glb());
    folder_->Write(
        "strip.yaml",
        "kpsa: 1\ncharacter: strip.glb\ncontrols:\n  tip.rotateZ: {min: -30, max: 30}\naccelerate:\n"
        "  strip: {points: [strip@skin], subspace: strip.kpsa, tolerance: 1cm, violationRate: 10%, "
        "train: {clips: [swing], samples: 100}}\n");
    auto rig = kpsa::Library().Load(folder_->path() + "/strip.yaml");
    ASSERT_TRUE(rig) << kpsa::ToText(rig.problems());
    plain_ = std::make_unique<Rig>(*rig);
    const auto trained = plain_->Train({});
    ASSERT_TRUE(trained) << kpsa::ToText(trained.problems());
    auto fast = plain_->Accelerated();
    ASSERT_TRUE(fast) << kpsa::ToText(fast.problems());
    fast_ = std::make_unique<Rig>(*fast);
  }
  static void TearDownTestSuite() { plain_.reset(), fast_.reset(), folder_.reset(); }
  void SetUp() override { ASSERT_NE(fast_, nullptr); }
  static std::vector<float> Pull(Scene* scene) {
    const auto points = scene->Points("strip");
    EXPECT_TRUE(points) << kpsa::ToText(points.problems());
    return points ? std::vector<float>(points->begin(), points->end()) : std::vector<float>();
  }

  static inline std::unique_ptr<kpsa::engine::TemporaryFolder> folder_;
  static inline std::unique_ptr<Rig> plain_, fast_;
};

TEST_F(AcceleratedScene, LetsGoOfWhatAClipDrives) {
  Scene plain(*plain_), fast(*fast_);
  std::vector<float> posed[2], talking[2], after[2];
  int i = 0;
  for (Scene* scene : {&plain, &fast}) {
    const auto set = scene->Set("strip_blendShape.weight[0]", 1);
    ASSERT_TRUE(set) << kpsa::ToText(set.problems());
    posed[i] = Pull(scene);
    ASSERT_TRUE(scene->Play("talk"));
    scene->SetTime(0.5);
    const auto weight = scene->Values("strip_blendShape.weight[0]");
    ASSERT_TRUE(weight) << kpsa::ToText(weight.problems());
    EXPECT_NEAR((*weight)[0], 0.4, 1e-6);
    talking[i] = Pull(scene);
    ASSERT_TRUE(scene->Play(std::nullopt));
    after[i] = Pull(scene);
    ++i;
  }
  EXPECT_EQ(posed[1], posed[0]) << "which no subspace knew";
  EXPECT_EQ(talking[1], talking[0]);
  EXPECT_NE(talking[0], posed[0]);
  ASSERT_EQ(after[0].size(), after[1].size());
  for (std::size_t i = 0; i < after[0].size(); ++i) EXPECT_NEAR(after[1][i], after[0][i], 0.01) << "a hit";
}

}  // namespace
