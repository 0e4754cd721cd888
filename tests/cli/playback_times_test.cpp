// What kpsa train times for its prediction: frames of clips, in plans like those of kpsa bench.
#include "host/checks/playback_times.h"

#include "cli/common.h"
#include "host/checks/subspace_check.h"
#include "tests/cli/hello_folder.h"
#include "tests/cli/process.h"
#include "tests/cli/rig_run.h"

namespace kpsa::engine {
namespace {

class Playback : public ::testing::Test {
 protected:
  static void SetUpTestSuite() { trained_ = TrainRig(kHello, QuickTraining(), {"wave"}); }
  static void TearDownTestSuite() { trained_.reset(); }
  void SetUp() override {
    ASSERT_NE(trained_, nullptr);
    Result<Rig> rig = LoadRig(AcceleratedRegistry(), kHello, {});
    ASSERT_TRUE(rig.ok()) << rig.status().ToString();
    rig_ = std::make_unique<Rig>(std::move(*rig));
    Result<std::vector<TrainingClip>> clips = ClipFrames(*rig_, {"wave"});
    ASSERT_TRUE(clips.ok());
    clips_ = std::move(*clips);
  }
  Result<PlaybackTimes> Time(const std::shared_ptr<const Subspace>& subspace,
                             const std::vector<TrainingClip>& clips) {
    Flags flags;
    flags.file = kHello;
    return TimePlayback(OpenerOf(flags), rig_->accelerate[0], subspace, clips, {});
  }
  static inline std::shared_ptr<const Subspace> trained_;
  std::unique_ptr<Rig> rig_;
  std::vector<TrainingClip> clips_;
};

TEST_F(Playback, TimeAloneVaries) {
  ASSERT_TRUE(SetClip(rig_.get(), "wave").ok());
  const Result<PlaybackPlans> plans =
      MakePlaybackPlans(rig_.get(), rig_->accelerate[0], trained_, trained_->tolerance);
  ASSERT_TRUE(plans.ok()) << plans.status().ToString();
  for (const auto& plan : {plans->full, plans->accelerated}) {
    EXPECT_NE(plan->FindVarying(rig_->scene.time), kNoIndex);
    for (const Control& control : rig_->controls)
      EXPECT_EQ(plan->FindVarying(control.plug), kNoIndex) << control.name;
  }
  EXPECT_EQ(plans->full->outputs().size(), 1u);
  EXPECT_EQ(plans->full_weight, 1u);
}

TEST_F(Playback, ClipsAreTimedAndTakeThePlaceOfPoses) {
  const Result<PlaybackTimes> times = Time(trained_, clips_);
  ASSERT_TRUE(times.ok()) << times.status().ToString();
  EXPECT_EQ(times->frames, 40u);
  EXPECT_GT(times->hits, 0u);
  EXPECT_GT(times->full_ms, 0);
  EXPECT_GT(times->hit_ms, 0);

  SubspaceCheckOptions options;
  options.poses = 4;
  options.played = {40, 20, 3, 2};
  for (const bool clips : {true, false}) {
    if (!clips) options.played = {};
    SetUp();  // the check rewrites the rig
    const Result<SubspaceCheck> check =
        CheckSubspace(rig_.get(), rig_->accelerate[0], trained_, clips_, options);
    ASSERT_TRUE(check.ok()) << check.status().ToString();
    EXPECT_EQ(check->clip_frames, clips ? 40u : 0u);
    EXPECT_EQ(check->full_ms == 3 && check->accelerated_ms == 2, clips);
    EXPECT_GT(check->full_ms, 0);
    EXPECT_GT(check->accelerated_ms, 0);
  }
}

TEST_F(Playback, WhereNoFrameHitsAllAreReconstructed) {
  auto never = std::make_shared<Subspace>(*trained_);
  never->tolerance = 0;
  const Result<PlaybackTimes> times = Time(never, clips_);
  ASSERT_TRUE(times.ok()) << times.status().ToString();
  EXPECT_EQ(times->hits, times->frames);
  const Result<PlaybackTimes> none = Time(trained_, {});
  ASSERT_TRUE(none.ok());
  EXPECT_EQ(none->frames, 0u);
  EXPECT_EQ(none->hits, 0u);
}

}  // namespace
}  // namespace kpsa::engine
