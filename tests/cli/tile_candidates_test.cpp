// What may be measured of a rig with a joint that moves no point, for all points and for a tile.
#include "kpsa/training/tile_candidates.h"

#include <gtest/gtest.h>

#include "host/rig_training.h"
#include "kpsa/training/training_setup.h"
#include "kpsa/training/training_signals.h"
#include "rig/build/writer.h"
#include "tests/cli/rig_run.h"
#include "tests/support/moving_character.h"
#include "tests/support/temporary_folder.h"

namespace kpsa::engine {
namespace {

// A character whose skin lists an antenna that no point weighs on.
MovingCharacter AntennaCharacter() {
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
  return character;
}

// A clip turns the antenna. Nothing guarded what moves no point: where a tile lay in its space, a clip that turned it
// farther took the tile along.
TEST(TileCandidates, JointsThatMoveNoPointCarryNone) {
  MovingCharacter character = AntennaCharacter();
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

// Where cues are measured in the space of a joint, what turns it is guarded, though it moves no point.
TEST(TileCandidates, JointsThatCuesAreMeasuredByAreGuarded) {
  MovingCharacter character = AntennaCharacter();
  TemporaryFolder folder;
  const Result<std::string> text =
      StarterRig(AcceleratedRegistry(), folder.Write("m.gltf", character.builder.Text()));
  ASSERT_TRUE(text.ok()) << text.status().ToString();
  const std::string path = folder.Write("m.yaml", *text);
  TrainOptions options;
  options.samples = 60;
  const auto trained = TrainRig(path, options, {"talk"});
  ASSERT_NE(trained, nullptr);
  auto by_antenna = std::make_shared<Subspace>(*WithGuardsOnly(*trained));
  bool found = false;
  for (CueDescription& cue : by_antenna->cues) {
    if (found || cue.kind != CueDescription::Kind::kPoint) continue;
    cue.joint = "antenna.worldMatrix";
    found = true;
  }
  ASSERT_TRUE(found);
  const auto turned = [&](std::shared_ptr<const Subspace> subspace, double degrees) {
    RigRun run(path, {.subspace = std::move(subspace), .varying = {"antenna.rotateZ"}});
    EXPECT_TRUE(run.ok()) << run.error;
    if (!run.ok()) return RunFrame();
    run.Set("antenna.rotateZ", degrees);
    return run.Evaluate();
  };
  EXPECT_TRUE(turned(WithGuardsOnly(*trained), 20).hit) << "it moves no point and is no cue's";
  EXPECT_TRUE(turned(by_antenna, 0).hit);
  const RunFrame frame = turned(by_antenna, 20);
  EXPECT_EQ(frame.full_weight, 1) << frame.text;
  EXPECT_NE(frame.text.find("antenna.matrix"), std::string::npos) << frame.text;
}

// The relative matrices of a strip on `root` and `tip` under a joint `above`, that its skin lists. `base`: the node that
// the points weigh on that do not weigh on the tip. The space is the root.
std::vector<std::string> RelativeMatricesUnder(const char* name, int base) {
  MovingCharacter character;
  nlohmann::json& root = character.builder.root;
  character.builder.Push("nodes", {{"name", "above"}, {"children", {1}}});
  root["scenes"][0]["nodes"] = {0, 3};
  std::vector<float> bind(48, 0.0f);
  for (std::size_t k = 0; k < 12; ++k) bind[16 * (k / 4) + 5 * (k % 4)] = 1;
  bind[16 + 12] = -0.5f;
  root["skins"][0]["joints"] = {base, 2, base == 1 ? 3 : 1};
  root["skins"][0]["inverseBindMatrices"] = character.builder.Accessor(bind, "MAT4");
  character.Swing("talk", 40, 2);
  TemporaryFolder folder;
  Result<Rig> rig = LoadRigOf(folder, character.builder.Text(), R"(controls:
  root.rotateZ: {min: -3deg, max: 3deg}
  tip.rotateZ: {min: -30deg, max: 30deg}
accelerate:
  strip: {points: [strip@skin], space: root, subspace: m.kpsa, tolerance: 1mm, train: {clips: [talk], samples: 60}}
)");
  EXPECT_TRUE(rig.ok()) << name << ": " << rig.status().ToString();
  if (!rig.ok()) return {};
  const std::vector<TrainingClip> clips{{"talk", {0, 0.5, 1, 1.5}}};
  const TrainOptions options;
  TrainingSetup setup(MakeTrainingRig(&*rig, rig->accelerate.at(0)), clips, options);
  const Status prepared = setup.Prepare();
  EXPECT_TRUE(prepared.ok()) << name << ": " << prepared.ToString();
  std::vector<std::string> relative;
  if (!prepared.ok()) return relative;
  for (const Signal& signal : setup.recorder->signals()) {
    if (signal.relative) relative.push_back(signal.name);
  }
  return relative;
}

// Nothing guards what turns the space with all points: seen from it, what stands above it turns the other way, and a tile
// that measured that was off by as many tolerances as one liked, all frames hits.
TEST(TileCandidates, WhatTurnsWhereTheSpaceDoesIsMeasuredWherePointsStayBehindAlone) {
  EXPECT_EQ(RelativeMatricesUnder("a joint that moves no point", 1),
            (std::vector<std::string>{"root.worldMatrix", "tip.worldMatrix"}));
  const std::vector<std::string> weighs = RelativeMatricesUnder("points that weigh on it", 3);
  EXPECT_NE(std::ranges::find(weighs, "above.worldMatrix"), weighs.end());
}

// What a clip moves that no control does is known as the clips do it, and named.
TEST(TileCandidates, WhatClipsAloneMoveIsNamed) {
  MovingCharacter character;
  character.Swing("talk", 40, 2);
  character.Swing("talk", 20, 2, 1);
  TemporaryFolder folder;
  Result<Rig> rig =
      LoadRigOf(folder, character.builder.Text(), R"(controls: {root.rotateZ: {min: -3deg, max: 3deg}}
accelerate: {strip: {points: [strip@skin], subspace: m.kpsa, tolerance: 1mm, train: {clips: [talk], samples: 60}}}
)");
  ASSERT_TRUE(rig.ok()) << rig.status().ToString();
  Compiler compiler;
  const TrainingRig training = MakeTrainingRig(&*rig, rig->accelerate.at(0));
  const std::vector<TrainingClip> clips{{"talk", {0, 0.5, 1, 1.5}}};
  const Result<TrainingSignals> signals = FindTrainingSignals(training, &compiler, clips, true);
  ASSERT_TRUE(signals.ok()) << signals.status().ToString();
  const Result<std::vector<std::string>> alone =
      MovedByClipsAlone(training, &compiler, clips, signals->watched);
  ASSERT_TRUE(alone.ok()) << alone.status().ToString();
  EXPECT_EQ(*alone, std::vector<std::string>{"tip.matrix"});
}

}  // namespace
}  // namespace kpsa::engine
