// What training turns though no control or hardly one does (kpsa/training/tilts.h).
#include "kpsa/training/tilts.h"

#include <fmt/format.h>

#include <cmath>

#include "host/rig_training.h"
#include "tests/cli/hello_folder.h"
#include "tests/cli/rig_run.h"

namespace kpsa::engine {
namespace {

constexpr double kDegree = 3.14159265358979323846 / 180;

class Tilts : public ::testing::Test {
 protected:
  // hello with another control of its upper joint, in the place of "upper.rotateX".
  TrainingRig With(const std::string& controls) {
    folder_.Edit("  upper.rotateX: {min: -30, max: 30}\n", controls);
    Result<Rig> rig = LoadRig(AcceleratedRegistry(), folder_.rig(), {});
    EXPECT_TRUE(rig.ok()) << rig.status().ToString();
    rig_ = std::make_unique<Rig>(std::move(*rig));
    return MakeTrainingRig(rig_.get(), rig_->accelerate[0]);
  }
  const ControlRange& Of(const TrainingRig& rig, const std::string& plug) const {
    for (const ControlRange& control : rig.controls) {
      if (rig_->graph->PlugName(control.plug) == plug) return control;
    }
    ADD_FAILURE() << plug;
    return rig.controls.front();
  }
  HelloFolder folder_;
  std::unique_ptr<Rig> rig_;
};

TEST_F(Tilts, AThirdAxisThatHardlyTurnsTurnsAsFarAsTheOthersCompose) {
  const TrainingRig rig =
      With("  upper.rotateX: {min: -6, max: 6}\n  upper.rotateY: {min: -0.1, max: 0.1}\n");
  const TrainingRig with = WithTilts(rig);
  ASSERT_EQ(with.controls.size(), rig.controls.size()) << "all three axes have controls";
  const ControlRange& third = Of(with, "upper.rotate.y");
  EXPECT_NEAR(third.tilt, 0.03, 1e-12) << "6 by 52.5 degrees are more than is ever trained";
  EXPECT_NEAR(third.max, 0.1 * kDegree, 1e-9) << "the range is the rig's";
  EXPECT_EQ(Of(with, "upper.rotate.x").tilt, 0);
  EXPECT_EQ(Of(with, "upper.rotate.z").tilt, 0);
  // Half of the poses turn it, up to its tilt to both sides; nothing else changes
  std::vector<SampledPose> poses(400);
  for (SampledPose& pose : poses) pose.values.assign(rig.controls.size(), 0.001);
  AddTilts(with.controls, rig.controls.size(), 7, &poses);
  std::size_t turned = 0;
  double lo = 0, hi = 0;
  for (const SampledPose& pose : poses) {
    ASSERT_EQ(pose.values.size(), rig.controls.size());
    for (std::size_t c = 0; c < pose.values.size(); ++c) {
      if (with.controls[c].tilt == 0) {
        EXPECT_EQ(pose.values[c], 0.001);
        continue;
      }
      turned += pose.values[c] != 0.001;
      lo = std::min(lo, pose.values[c]), hi = std::max(hi, pose.values[c]);
    }
  }
  EXPECT_NEAR(static_cast<double>(turned), 200, 60);
  EXPECT_NEAR(lo, -0.03, 0.003);
  EXPECT_NEAR(hi, 0.03, 0.003);
}

TEST_F(Tilts, AThirdAxisWithARangeOfItsOwnHasNone) {
  const TrainingRig rig = With("  upper.rotateX: {min: -6, max: 6}\n  upper.rotateY: {min: -20, max: 20}\n");
  for (const ControlRange& control : WithTilts(rig).controls) EXPECT_EQ(control.tilt, 0);
}

TEST_F(Tilts, AThirdAxisWithoutAControlGetsOne) {
  const TrainingRig rig = With("  upper.rotateX: {min: -30, max: 30}\n"), with = WithTilts(rig);
  ASSERT_EQ(with.controls.size(), rig.controls.size() + 1);
  EXPECT_EQ(rig_->graph->PlugName(with.controls.back().plug), "upper.rotate.y");
}

// On top of a clip a shift goes where the clip has turned the joint.
TEST_F(Tilts, AJointThatTurnsAndShiftsAlongOneAxisShiftsALittleAlongTheOthers) {
  const TrainingRig rig =
                        With("  upper.rotateX: {min: -30, max: 30}\n  upper.translateY: {min: -2, max: 2}\n"),
                    with = WithTilts(rig);
  const ControlRange& along = Of(rig, "upper.translate.y");
  for (const char* plug : {"upper.translate.x", "upper.translate.z"}) {
    const ControlRange& across = Of(with, plug);
    EXPECT_NEAR(across.max, 0.05 * (along.max - along.min), 1e-12);
    EXPECT_EQ(across.min, -across.max);
  }
  EXPECT_EQ(Of(with, "upper.translate.y").tilt, 0);
}

TEST_F(Tilts, AJointThatShiftsAlongAllAxesShiftsAsTheRigSays) {
  const TrainingRig rig = With(
      "  upper.rotateX: {min: -30, max: 30}\n  upper.translateX: {min: -1, max: 1}\n"
      "  upper.translateY: {min: -2, max: 2}\n  upper.translateZ: {min: 0, max: 900}\n");
  const TrainingRig with = WithTilts(rig);
  for (const char* axis : {"x", "y", "z"})
    EXPECT_EQ(Of(with, fmt::format("upper.translate.{}", axis)).tilt, 0);
}

TEST_F(Tilts, AHandleThatOnlyShiftsIsLeftAsItIs) {
  const TrainingRig rig = With("  lower.translateY: {min: -2, max: 2}\n");
  for (const ControlRange& control : WithTilts(rig).controls)
    EXPECT_NE(rig_->graph->PlugName(control.plug), "lower.translate.x");
}

}  // namespace
}  // namespace kpsa::engine
