// Controls that no clip moves, over clips: what an animator holds is right or misses, and what no subspace tells is left
// at rest instead of spoiling the clips.
#include <algorithm>
#include <cmath>

#include "kpsa/training_record.h"
#include "tests/cli/hello_folder.h"
#include "tests/cli/rig_run.h"

namespace kpsa::engine {
namespace {

// The column with a wave along it, and many controls beside: each by itself is moved in one of a hundred samples. `wave`:
// its controls.
std::string RigWithWave(const HelloFolder& folder, const std::string& wave) {
  std::string nodes =
      "  ripple: {type: sine, matrix: lower.worldMatrix, wavelength: 0.3, amplitude: 0.03, dropoff: 0}\n";
  std::string connections, controls;
  for (int i = 0; i < 40; ++i) {
    nodes += fmt::format("  grip{}: {{type: transform, at: [0, {}, 0]}}\n", i, 2 * i);
    nodes += fmt::format("  soft{}: {{type: softMod, matrix: grip{}.worldMatrix, falloffRadius: 6}}\n", i, i);
    controls += fmt::format("  grip{}.translateX: {{min: -1, max: 1}}\n", i);
  }
  std::string stack = "ripple";
  for (int i = 0; i < 40; ++i) stack += fmt::format(", soft{}", i);
  folder.Edit("  mush: {", nodes + "  mush: {");
  folder.Edit("[skin, cage, mush]", "[skin, cage, " + stack + ", mush]");
  return folder.Edit("controls:\n", "controls:\n" + wave + controls);
}

struct Held {
  std::size_t frames = 0, hits = 0, beyond = 0;
};
// The clip, with a control at a value.
Held Play(const std::string& rig, const std::shared_ptr<const Subspace>& subspace, const std::string& control,
          double value) {
  Held held;
  RigRunOptions options;
  options.clip = "wave";
  RigRun exact(rig, options);
  options.subspace = subspace;
  RigRun fast(rig, options);
  EXPECT_TRUE(exact.ok() && fast.ok()) << exact.error << fast.error;
  if (!exact.ok() || !fast.ok()) return held;
  for (RigRun* run : {&exact, &fast}) run->Set(control, value);
  for (double time = 0; time < 1.9; time += 0.05) {
    for (RigRun* run : {&exact, &fast}) run->SetTime(time);
    const RunFrame a = exact.Evaluate(), b = fast.Evaluate();
    ++held.frames;
    held.hits += b.hit;
    held.beyond += LargestDistance(a.points, b.points) > subspace->tolerance;
  }
  return held;
}

TEST(HeldControlsOfRigs, AreRightOrMissOverClips) {
  const HelloFolder folder;
  const std::string rig = RigWithWave(folder, "  ripple.amplitude: {min: 0, max: 0.06}\n");
  const std::shared_ptr<const Subspace> trained = TrainRig(rig, QuickTraining(), {"wave"});
  ASSERT_NE(trained, nullptr);
  const auto of_kind = std::ranges::count_if(trained->calibration, [](const CalibrationPair& pair) {
    return pair.kind == static_cast<int>(PoseKind::kHeld);
  });
  EXPECT_EQ(of_kind, 400);
  // At its ends a quarter of the frames was wrong and accepted: with 41 controls, few poses of a kind
  const std::vector<std::string> left = ParseTraining(trained->training).at_rest;
  EXPECT_TRUE(std::ranges::count(left, "ripple.amplitude") == 1);
  EXPECT_LT(left.size(), 10u) << "most grips are followed";
  const Held at_rest = Play(rig, trained, "ripple.amplitude", 0.03);
  EXPECT_GT(at_rest.hits, at_rest.frames / 2);
  EXPECT_LE(at_rest.beyond, at_rest.frames / 10);
  for (const double amplitude : {0.0, 0.045, 0.06}) {
    const Held held = Play(rig, trained, "ripple.amplitude", amplitude);
    EXPECT_EQ(held.hits, 0u) << amplitude;
    EXPECT_EQ(held.beyond, 0u) << amplitude;
  }
  std::string followed;
  for (int g = 0; g < 40 && followed.empty(); ++g) {
    const std::string grip = fmt::format("grip{}.translateX", g);
    if (std::ranges::count(left, grip) == 0) followed = grip;
  }
  for (const double grip : {-0.01, 0.01}) {
    const Held held = Play(rig, trained, followed, grip);
    EXPECT_GT(held.hits, held.frames / 2) << followed;
    EXPECT_LE(held.beyond, held.frames / 6) << followed;
  }
}

}  // namespace
}  // namespace kpsa::engine
