// What may be measured of a rig with a joint that moves no point, for all points and for a tile.
#include "kpsa/training/tile_candidates.h"

#include <gtest/gtest.h>

#include "host/rig_training.h"
#include "kpsa/training/training_setup.h"
#include "rig/build/writer.h"
#include "tests/cli/rig_run.h"
#include "tests/support/moving_character.h"
#include "tests/support/temporary_folder.h"

namespace kpsa::engine {
namespace {

// The skin lists an antenna that no point weighs on, and a clip turns it. Nothing guards what moves no point: where a tile
// lay in its space, a clip that turned it farther took the tile along.
TEST(TileCandidates, JointsThatMoveNoPointCarryNone) {
  MovingCharacter character;
  nlohmann::json& root = character.builder.root;
  root["nodes"][2]["children"] = {3};
  character.builder.Push("nodes", {{"name", "antenna"}, {"translation", {0.2, 0, 0}}});
  std::vector<float> bind(48, 0.0f);
  for (std::size_t k = 0; k < 12; ++k) bind[16 * (k / 4) + 5 * (k % 4)] = 1;
  bind[16 + 12] = -0.5f, bind[32 + 12] = -0.7f;
  root["skins"][0]["joints"] = {1, 2, 3};
  root["skins"][0]["inverseBindMatrices"] = character.builder.Accessor(bind, "MAT4");
  character.Swing("talk", 40, 2);
  character.Swing("talk", 20, 2, 3);
  TemporaryFolder folder;
  const std::string glb = folder.Write("m.gltf", character.builder.Text());
  const Result<std::string> text = StarterRig(AcceleratedRegistry(), glb);
  ASSERT_TRUE(text.ok()) << text.status().ToString();
  Result<Rig> rig = LoadRig(AcceleratedRegistry(), folder.Write("m.yaml", *text), {});
  ASSERT_TRUE(rig.ok()) << rig.status().ToString() << *text;
  TrainingRig training = MakeTrainingRig(&*rig, rig->accelerate.at(0));
  std::optional<std::string> playing = "nothing asked";
  training.set_clip = [&, set = training.set_clip](std::optional<std::string_view> clip) {
    playing = clip ? std::optional<std::string>(*clip) : std::nullopt;
    return set(clip);
  };
  std::vector<TrainingClip> clips{{"talk", {0, 0.5, 1, 1.5}}};
  const TrainOptions options;
  TrainingSetup setup(training, clips, options);
  const Status prepared = setup.Prepare();
  ASSERT_TRUE(prepared.ok()) << prepared.ToString();
  const std::vector<Index> first = FirstScalars(setup.recorder->signals(), setup.layout);
  const auto entry = [&](const std::string& name) {
    for (std::size_t s = 0; s < first.size(); ++s) {
      if (setup.recorder->signals()[s].relative && setup.recorder->signals()[s].name == name) return first[s];
    }
    return kNoIndex;
  };
  EXPECT_EQ(entry("antenna.worldMatrix"), kNoIndex);
  ASSERT_NE(entry("tip.worldMatrix"), kNoIndex);
  const std::vector<Double3> positions(setup.layout.points + setup.layout.stage_points);
  const TileCandidateOptions of{setup.layout, setup.totals, setup.recorder->signals(), {}, positions, {}};
  const Result<std::vector<TileCandidates>> tiles = FindTileCandidates(setup.rig, &setup.compiler, clips, of);
  ASSERT_TRUE(tiles.ok()) << tiles.status().ToString();
  ASSERT_EQ(tiles->size(), 1u);
  EXPECT_EQ(playing, std::nullopt) << "the rig is what it was";
  EXPECT_NE(std::ranges::find((*tiles)[0].joints, entry("tip.worldMatrix")), (*tiles)[0].joints.end());
}

}  // namespace
}  // namespace kpsa::engine
