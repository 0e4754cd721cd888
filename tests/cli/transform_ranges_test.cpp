// Ranges of a transform's matrix hold wherever all of its controls are within theirs (kpsa/training/transform_ranges.h).
#include "kpsa/training/transform_ranges.h"

#include "host/rig_training.h"
#include "kpsa/training/training_setup.h"
#include "tests/cli/rig_run.h"
#include "tests/support/moving_character.h"
#include "tests/support/temporary_folder.h"

namespace kpsa::engine {
namespace {

TEST(TransformRanges, HoldAtAllCorners) {
  MovingCharacter character;
  TemporaryFolder folder;
  Result<Rig> rig = LoadRigOf(folder, character.builder.Text(), R"(controls:
  root.rotateZ: {min: -3deg, max: 3deg}
  tip.rotateX: {min: -20deg, max: 70deg}
  tip.rotateY: {min: -50deg, max: 10deg}
  tip.rotateZ: {min: -40deg, max: 30deg}
  tip.scaleX: {min: 0.5, max: 2}
accelerate: {strip: {points: [strip@skin], subspace: m.kpsa, tolerance: 1mm, train: {samples: 60}}}
)");
  ASSERT_TRUE(rig.ok()) << rig.status().ToString();
  const TrainingRig training = MakeTrainingRig(&*rig, rig->accelerate.at(0));
  const std::vector<TrainingClip> clips;
  const TrainOptions options;
  TrainingSetup setup(training, clips, options);
  const Status prepared = setup.Prepare();
  ASSERT_TRUE(prepared.ok()) << prepared.ToString();

  const std::size_t count = setup.rig.controls.size();
  const auto record = [&](const std::vector<SampledPose>& poses, PoseMatrix* matrix) {
    const Status recorded = setup.recorder->AddSamples(poses, {}, matrix);
    ASSERT_TRUE(recorded.ok()) << recorded.ToString();
  };
  SampledPose rest;
  for (const ControlRange& control : setup.rig.controls) rest.values.push_back(control.rest);
  PoseMatrix at_rest(setup.layout), within(setup.layout);
  record({rest}, &at_rest);
  std::vector<SampledPose> poses;
  for (int p = 0; p < 9 * 9 * 9; ++p) {
    const int places[] = {4, p % 9, p / 9 % 9, p / 81, p % 5 * 2};  // the root at rest
    SampledPose& pose = poses.emplace_back(rest);
    for (std::size_t c = 0; c < count && c < 5; ++c) {
      const ControlRange& control = setup.rig.controls[c];
      pose.values[c] = control.min + (control.max - control.min) * places[c] / 8;
    }
  }
  record(poses, &within);

  const auto ranges_with = [&](bool corners) {
    RangeFinder finder(setup.layout);
    finder.Widen(at_rest);
    if (corners) {
      const Status widened =
          WidenByTransforms(setup.rig, setup.guards, setup.layout, setup.recorder.get(), &finder);
      EXPECT_TRUE(widened.ok()) << widened.ToString();
    }
    return finder;
  };
  const RangeFinder finder = ranges_with(true), without = ranges_with(false);
  RangeFinder wide = finder;
  wide.Widen(within);
  RangeFinder::Options of;
  of.tolerance = 1e-9, of.diagonal = 1, of.inverse_rest_stretch = setup.inverse_rest_stretch;
  const auto made = [&](const RangeFinder& f) {
    return f.Make(setup.rig, &setup.compiler, setup.guards, of);
  };
  const auto ranges = made(finder), all = made(wide), few = made(without);
  ASSERT_TRUE(ranges.ok() && all.ok() && few.ok());
  std::size_t of_tip = 0, moved = 0;
  for (std::size_t i = 0; i < ranges->size(); ++i) {
    const TrainedRange& range = (*ranges)[i];
    if (!range.plug.starts_with("tip.matrix")) continue;
    ++of_tip;
    moved += range.hi > (*few)[i].hi || range.lo < (*few)[i].lo;
    const double extent = (*all)[i].hi - (*all)[i].lo;
    EXPECT_LE(range.lo, (*all)[i].lo + 0.02 * extent) << range.plug;
    EXPECT_GE(range.hi, (*all)[i].hi - 0.02 * extent) << range.plug;
  }
  EXPECT_EQ(of_tip, 12u);
  EXPECT_EQ(moved, 9u) << "and no entry of the translation";
}

}  // namespace
}  // namespace kpsa::engine
