// What clips move and no control does is posed apart in training (kpsa/training/clip_controls.h).
#include "kpsa/training/clip_controls.h"

#include "base/scalar_math.h"
#include "host/rig_training.h"
#include "rig/build/starter_training.h"
#include "tests/cli/rig_run.h"
#include "tests/support/moving_character.h"
#include "tests/support/temporary_folder.h"

namespace kpsa::engine {
namespace {

constexpr double kTalkTolerance = 2e-3;
constexpr int kTalkTargets = 4, kTalkFrames = 49;

// A strip with morph targets that bend, widen and curl it, over each other. In the clip talk their weights are alike in pairs;
// in other each goes its own way. The tip swings, and the mesh is keyed to stay where it is.
MovingCharacter Talker() {
  MovingCharacter character;
  nlohmann::json& primitive = character.builder.root["meshes"][0]["primitives"][0];
  for (int k = 0; k < kTalkTargets; ++k) {
    std::vector<float> deltas;
    for (int i = 0; i < MovingCharacter::kPoints; ++i) {
      const float along = static_cast<float>(i / 2) / 10, side = static_cast<float>(i % 2) - 0.5f;
      const float wave = 0.1f * std::sin(3 * along + static_cast<float>(k));
      deltas.insert(deltas.end(),
                    {k == 3 ? wave : 0, k % 2 == 0 ? side * wave : 0, k % 2 == 1 ? wave : 0.02f * wave});
    }
    primitive["targets"].push_back({{"POSITION", character.builder.Accessor(deltas, "VEC3")}});
  }
  for (const bool apart : {false, true}) {
    std::vector<float> times, weights, still;
    for (int t = 0; t < kTalkFrames; ++t) {
      times.push_back(static_cast<float>(t) / 24);
      still.insert(still.end(), {0, 0, 0});
      for (int k = 0; k < kTalkTargets; ++k) {
        const int as = apart ? 2 * k + 1 : k % 2 + 1;
        weights.push_back(0.5f - 0.5f * std::cos(0.26f * static_cast<float>(t * as)));
      }
    }
    const char* clip = apart ? "other" : "talk";
    character.Animate(clip, 0, "weights", times, weights);
    character.Animate(clip, 1, "translation", times, still);
    character.Swing(clip, 40, 2);
  }
  return character;
}

std::string TalkerRig(const std::string& controls, const std::string& samples) {
  return controls +
         "accelerate: {strip: {points: [strip@skin], subspace: m.kpsa, tolerance: 2mm, train: {clips: "
         "[talk]" +
         samples + "}}}\n";
}
constexpr const char* kTalkerControls = "controls: {root.rotateZ: {min: -3deg, max: 3deg}}\n";
const std::string kTalkerRig = TalkerRig(kTalkerControls, ", samples: 400");

class ClipControls : public ::testing::Test {
 protected:
  void SetUp() override {
    path_ = folder_ / "m.yaml";
    Result<Rig> rig = LoadRigOf(folder_, Talker().builder.Text(), kTalkerRig);
    ASSERT_TRUE(rig.ok()) << rig.status().ToString();
    rig_ = std::make_unique<Rig>(std::move(*rig));
    training_ = MakeTrainingRig(rig_.get(), rig_->accelerate.at(0));
    Result<std::vector<TrainingClip>> clips = ClipFrames(*rig_, {"talk"});
    ASSERT_TRUE(clips.ok()) << clips.status().ToString();
    clips_ = std::move(*clips);
  }
  std::vector<std::string> Names(const std::vector<ControlRange>& controls) const {
    std::vector<std::string> names;
    for (const ControlRange& control : controls) names.push_back(rig_->graph->AuthoredName(control.plug));
    return names;
  }
  // Of the frames of the clip other that hit.
  double WorstHit(const TrainingRig& training) {
    TrainOptions options;
    options.samples = 600;
    options.tolerance = kTalkTolerance;
    Result<Subspace> subspace = Train(training, clips_, options);
    EXPECT_TRUE(subspace.ok()) << subspace.status().ToString();
    if (!subspace.ok()) return kInfinity;
    RigRunOptions full, fast;
    full.clip = fast.clip = "other";
    fast.subspace = std::make_shared<const Subspace>(std::move(*subspace));
    RigRun truth(path_, full), run(path_, fast);
    EXPECT_TRUE(truth.ok() && run.ok()) << truth.error << run.error;
    if (!truth.ok() || !run.ok()) return kInfinity;
    double worst = 0;
    for (int t = 0; t < kTalkFrames; ++t) {
      truth.SetTime(t / 24.0), run.SetTime(t / 24.0);
      const RunFrame frame = run.Evaluate();
      if (frame.full_weight < 1)
        worst = std::max(worst, LargestDistance(truth.Evaluate().points, frame.points));
    }
    return worst;
  }

  TemporaryFolder folder_;
  std::string path_;
  std::unique_ptr<Rig> rig_;
  TrainingRig training_;
  std::vector<TrainingClip> clips_;
};

TEST_F(ClipControls, AreWhatMovesInTheClips) {
  const std::vector<std::string> names = Names(training_.by_clips);
  EXPECT_EQ(names, (std::vector<std::string>{"tip.rotateZ", "strip_blendShape.weight[0]",
                                             "strip_blendShape.weight[1]", "strip_blendShape.weight[2]",
                                             "strip_blendShape.weight[3]"}));
  ASSERT_EQ(training_.by_clips.size(), names.size());
  EXPECT_NEAR(training_.by_clips[0].max, 40 * kPi / 180, 1e-3);
  EXPECT_NEAR(training_.by_clips[0].min, -40 * kPi / 180, 1e-3);
  EXPECT_TRUE(training_.by_clips[0].shown) << "a clip moves the joint underneath its control";
  EXPECT_FALSE(training_.by_clips[0].by_clip);
  EXPECT_NEAR(training_.by_clips[1].max, 1, 1e-2);
  EXPECT_TRUE(training_.by_clips[1].by_clip) << "a clip drives the weight itself";
  const Result<TrainingRig> with = WithClipControls(training_, clips_);
  ASSERT_TRUE(with.ok()) << with.status().ToString();
  EXPECT_EQ(with->controls.size(), training_.controls.size() + names.size());
}

// Joints that move no point are not posed.
TEST_F(ClipControls, AreOnlyWhatThePointsDependOn) {
  MovingCharacter character = Talker();
  character.builder.root["scenes"][0]["nodes"].push_back(
      character.builder.Push("nodes", {{"name", "prop"}, {"translation", {0, 0, 2}}}));
  character.Swing("talk", 20, 2, 3);
  Result<Rig> rig = LoadRigOf(folder_, character.builder.Text(), kTalkerRig);
  ASSERT_TRUE(rig.ok()) << rig.status().ToString();
  const TrainingRig training = MakeTrainingRig(&*rig, rig->accelerate.at(0));
  EXPECT_EQ(training.by_clips.size(), training_.by_clips.size() + 1);
  const Result<TrainingRig> with = WithClipControls(training, clips_);
  ASSERT_TRUE(with.ok()) << with.status().ToString();
  EXPECT_EQ(with->controls.size(), training.controls.size() + training_.by_clips.size());
}

// Where the rig says nothing, and no more than a number that it says.
TEST_F(ClipControls, AreSampledAsInitWould) {
  const auto samples = [&](const std::string& yaml) -> std::size_t {
    const Result<Rig> rig = LoadRigOf(folder_, Talker().builder.Text(), yaml);
    EXPECT_TRUE(rig.ok()) << rig.status().ToString();
    return rig.ok() ? TrainOptionsOf(*rig, rig->accelerate.at(0)).samples : 0;
  };
  const auto as_init = [](std::size_t controls) {
    return static_cast<std::size_t>(StarterSamples(controls, kTalkFrames));
  };
  EXPECT_EQ(samples(TalkerRig(kTalkerControls, "")), as_init(1 + 5));
  EXPECT_EQ(samples(TalkerRig("", "")), as_init(5)) << "a rig without controls";
  EXPECT_EQ(samples(TalkerRig(kTalkerControls, ", samples: 0")), 0u);
  EXPECT_EQ(samples(TalkerRig(kTalkerControls, ", samples: 70")), 70u);
}

// Known as talk moves them alone, they were wrong and hit in another clip that parts them.
TEST_F(ClipControls, AreKnownApart) {
  TrainingRig without = training_;
  without.by_clips.clear();
  EXPECT_GT(WorstHit(without), 2 * kTalkTolerance) << "no harder than before";
  EXPECT_LE(WorstHit(training_), kTalkTolerance);
}

}  // namespace
}  // namespace kpsa::engine
