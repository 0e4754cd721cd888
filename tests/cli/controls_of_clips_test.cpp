// What controls have to be to give the poses of a clip (kpsa/training/pose_recorder.h): training mixes these.
#include <gtest/gtest.h>

#include <cmath>

#include "base/scalar_math.h"
#include "host/rig_training.h"
#include "kpsa/training/pose_recorder.h"
#include "rig/build/writer.h"
#include "tests/cli/rig_run.h"
#include "tests/support/moving_character.h"
#include "tests/support/temporary_folder.h"

namespace kpsa::engine {
namespace {

// A tip that bends by 130 degrees about Y while it swings about Z, on a root that is squashed: angles within a turn jump,
// and no control had a say in growth.
TEST(ControlsOfClips, GiveThePosesOfTheClipBack) {
  MovingCharacter character;
  std::vector<float> times, turns, sizes;
  for (int k = 0; k <= 48; ++k) {
    const float y = static_cast<float>(-65 * kPi / 180 * (1 - std::cos(k * 0.25)) / 2),
                z = 0.2f * std::sin(0.4f * static_cast<float>(k));  // half of the angles
    times.push_back(static_cast<float>(k) / 24);
    turns.insert(turns.end(), {-std::sin(y) * std::sin(z), std::sin(y) * std::cos(z),
                               std::cos(y) * std::sin(z), std::cos(y) * std::cos(z)});
    sizes.insert(sizes.end(), {1, 1 + 0.3f * std::sin(0.3f * static_cast<float>(k)), 1});
  }
  character.Animate("bend", 2, "rotation", times, turns);
  character.Animate("bend", 1, "scale", times, sizes);
  TemporaryFolder folder;
  const std::string glb = folder.Write("m.gltf", character.builder.Text());
  const Result<std::string> text = StarterRig(AcceleratedRegistry(), glb);
  ASSERT_TRUE(text.ok()) << text.status().ToString();
  Result<Rig> rig = LoadRig(AcceleratedRegistry(), folder.Write("m.yaml", *text), {});
  ASSERT_TRUE(rig.ok()) << rig.status().ToString() << *text;
  const TrainingRig training = MakeTrainingRig(&*rig, rig->accelerate.at(0));
  const TrainingClip clip{"bend", {times.begin(), times.end()}};
  Compiler compiler;
  PoseRecorder recorder(training, &compiler, {}, {});
  const Result<PoseLayout> layout = recorder.Layout();
  ASSERT_TRUE(layout.ok()) << layout.status().ToString();
  const Result<ClipPoses> controls = recorder.ControlsOfClips({clip});
  ASSERT_TRUE(controls.ok()) << controls.status().ToString();
  std::vector<SampledPose> posed;
  double apart = 0, most = 0;  // from frame to frame; from rest
  for (std::size_t t = 0; t < controls->size(); ++t) {
    posed.push_back({(*controls)[t]});
    for (std::size_t c = 0; c < training.controls.size(); ++c) {
      const ControlRange& control = training.controls[c];
      const double value = posed[t].values[c];
      EXPECT_GE(value, control.min - 1e-6) << rig->graph->PlugName(control.plug) << " " << t;
      EXPECT_LE(value, control.max + 1e-6) << rig->graph->PlugName(control.plug) << " " << t;
      most = std::max(most, std::fabs(value - control.rest));
      if (t > 0) apart = std::max(apart, std::fabs(value - posed[t - 1].values[c]));
    }
  }
  EXPECT_GT(most, 2.2);  // 130 degrees
  EXPECT_LT(apart, 0.5);
  PoseMatrix played(*layout), sampled(*layout);
  ASSERT_TRUE(recorder.AddClip(clip, &played).ok());
  ASSERT_TRUE(recorder.AddSamples(posed, {}, &sampled).ok());
  ASSERT_EQ(played.poses(), sampled.poses());
  for (std::size_t t = 0; t < played.poses(); ++t) {
    for (std::size_t i = 0; i < 3 * layout->points; ++i)
      ASSERT_NEAR(played.row(t)[i], sampled.row(t)[i], 1e-5) << t << " " << i;
  }
}

}  // namespace
}  // namespace kpsa::engine
