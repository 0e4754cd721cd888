// Learning in the background: misses are handed in while frames are evaluated, and a new version comes out.
#include "kpsa/training/learner.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <thread>

#include "graph/frames.h"
#include "kpsa/training_record.h"
#include "tests/cli/hello_folder.h"
#include "tests/cli/process.h"
#include "tests/cli/rig_run.h"

namespace kpsa::engine {
namespace {

// hello with a clip that sways a joint which never moves in training.
class BackgroundLearning : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<HelloFolder>();
    folder_->AddSway();
    TrainOptions options = QuickTraining();
    options.samples = 200, options.calibration_poses = 200;
    trained_ = TrainRig(folder_->rig(), options);
    ASSERT_NE(trained_, nullptr);
  }
  static void TearDownTestSuite() { trained_.reset(), folder_.reset(); }

  static Result<LearnerRig> OpenRig() {
    RigOptions rest;
    rest.rest = true;
    Result<Rig> loaded = LoadRig(AcceleratedRegistry(), folder_->rig(), rest);
    if (!loaded.ok()) return loaded.status();
    const auto rig = std::make_shared<Rig>(std::move(*loaded));
    LearnerRig opened;
    opened.owner = rig;
    opened.training = MakeTrainingRig(rig.get(), rig->accelerate[0]);
    opened.frames = [rig](const std::string& clip) -> Result<TrainingClip> {
      Result<std::vector<TrainingClip>> frames = ClipFrames(*rig, {clip});
      if (!frames.ok()) return frames.status();
      return std::move(frames->front());
    };
    return opened;
  }
  // The frames of a clip.
  static std::vector<RunFrame> Play(RigRun* run, const std::string& clip) {
    const Result<std::vector<TrainingClip>> frames = ClipFrames(run->rig, {clip});
    EXPECT_TRUE(frames.ok()) << frames.status().ToString();
    std::vector<RunFrame> played;
    for (const double time : frames->front().times) {
      run->SetTime(time);
      played.push_back(run->Evaluate());
    }
    return played;
  }
  static std::vector<Miss> MissesOf(RigRun* run, const std::string& clip) {
    const std::vector<double> times = ClipFrames(run->rig, {clip})->front().times;
    const std::vector<RunFrame> frames = Play(run, clip);
    std::vector<Miss> misses;
    for (std::size_t f = 0; f < frames.size(); ++f) {
      if (!frames[f].hit) misses.push_back({clip, times[f]});
    }
    return misses;
  }
  static std::string BytesOf(const Subspace& subspace) {
    const std::string path = *folder_ / "bytes.kpsa";
    EXPECT_TRUE(WriteSubspace(subspace, path).ok());
    return TemporaryFolder::Read(path);
  }

  static inline std::unique_ptr<HelloFolder> folder_;
  static inline std::shared_ptr<const Subspace> trained_;
};

TEST_F(BackgroundLearning, WhatMissedHitsInTheNextVersionAndEvaluatorsStayAsTheyAre) {
  RigRun run(folder_->rig(), {.subspace = trained_, .clip = "sway"});
  ASSERT_TRUE(run.ok()) << run.error;
  const std::vector<RunFrame> before = Play(&run, "sway");
  const std::vector<Miss> misses = MissesOf(&run, "sway");
  ASSERT_GT(misses.size(), before.size() / 2);

  Learner learner(trained_, OpenRig);
  EXPECT_EQ(learner.TakeNewest(), nullptr);
  EXPECT_FALSE(learner.Learn()) << "there is nothing";
  // From several threads, in any order, and more than once
  std::vector<std::thread> threads;
  std::atomic<std::size_t> added = 0;
  for (std::size_t k = 0; k < 4; ++k) {
    threads.emplace_back([&, k] {
      for (std::size_t i = 0; i < misses.size(); ++i)
        added += learner.Add(misses[(i * 7 + k * 5) % misses.size()]) ? 1 : 0;
    });
  }
  for (std::thread& thread : threads) thread.join();
  const std::size_t handed = learner.state().kept;
  EXPECT_EQ(added, handed);
  EXPECT_EQ(learner.state().known, 4 * misses.size() - handed);
  EXPECT_TRUE(learner.Learn());
  while (learner.state().learning) {
    const std::vector<RunFrame> meanwhile = Play(&run, "sway");
    for (std::size_t f = 0; f < before.size(); ++f)
      ASSERT_TRUE(SameBytes(meanwhile[f].points, before[f].points)) << f;
  }
  const Status learnt = learner.Wait();
  ASSERT_TRUE(learnt.ok()) << learnt.ToString();
  const std::shared_ptr<const Subspace> newer = learner.TakeNewest();
  ASSERT_NE(newer, nullptr);
  EXPECT_EQ(learner.TakeNewest(), nullptr) << "taken";
  EXPECT_EQ(learner.state().versions, 1u);
  EXPECT_EQ(learner.state().kept, 0u);
  EXPECT_EQ(run.accelerated.config->data().subspace, trained_);
  EXPECT_EQ(MissesOf(&run, "sway"), misses) << "until the new version is adopted";

  RigRun adopted(folder_->rig(), {.subspace = newer, .clip = "sway"});
  ASSERT_TRUE(adopted.ok()) << adopted.error;
  EXPECT_LE(10 * MissesOf(&adopted, "sway").size(), misses.size());
  EXPECT_FALSE(learner.Add(misses.front())) << "learnt";
  EXPECT_FALSE(learner.Learn());

  // The same misses by the program, and from the other end: the same bytes
  ASSERT_TRUE(WriteSubspace(*trained_, *folder_ / "old.kpsa").ok());
  const ProcessResult run_learn = RunKpsa(
      {"learn", "hello.yaml", "--kpsa", "old.kpsa", "--clip", "sway", "-o", "new.kpsa", "--force", "-q"}, 120,
      folder_->path());
  ASSERT_EQ(run_learn.exit_code, 0) << run_learn.err;
  const std::string bytes = TemporaryFolder::Read(*folder_ / "new.kpsa");
  EXPECT_GT(bytes.size(), 10'000u);
  EXPECT_EQ(BytesOf(*newer), bytes);
}

// All at once: frames on several threads, each step of them recorded, misses that these threads hand in, a training in
// the background on threads of its own, and versions that are taken up between requests.
TEST_F(BackgroundLearning, WhileFramesOnManyThreadsAreRecorded) {
  const std::vector<double> times = [] {
    RigRun run(folder_->rig(), {.clip = "sway"});
    return ClipFrames(run.rig, {"sway"})->front().times;
  }();
  Learner learner(trained_, OpenRig, {.threads = 2});
  std::shared_ptr<const Subspace> played = trained_;
  std::vector<std::size_t> missed;  // by version
  std::size_t requests = 0;
  for (int version = 0; version < 2; ++version) {
    RigRun run(folder_->rig(), {.subspace = played, .clip = "sway"});
    ASSERT_TRUE(run.ok()) << run.error;
    const std::vector<RunFrame> alone = Play(&run, "sway");
    missed.push_back(static_cast<std::size_t>(
        std::ranges::count_if(alone, [](const RunFrame& frame) { return !frame.hit; })));
    Profile profile(*run.plan);
    profile.keep_events = true;
    FrameOptions options;
    options.threads = 3, options.block = 2, options.profile = &profile;
    const auto request = [&] {
      profile.Clear();
      const Status status = EvaluateFrames(
          run.plan, times.size(), options,
          [&](std::size_t frame, Evaluator& evaluator) {
            evaluator.Set(run.plan->FindVarying(run.rig.scene.time), times[frame]);
          },
          [&](std::size_t frame, const Evaluator& evaluator, const Status& evaluated) {
            const RunFrame got = run.Frame(evaluator);
            EXPECT_TRUE(SameBytes(got.points, alone[frame].points)) << frame;
            if (!got.hit) learner.Add({"sway", times[frame]});
            return evaluated;
          });
      EXPECT_TRUE(status.ok()) << status.ToString();
      EXPECT_GE(profile.events().size(), times.size());
      ++requests;
    };
    request();
    if (version == 1) break;
    ASSERT_TRUE(learner.Learn());
    do {
      request();
    } while (learner.state().learning);
    const Status learnt = learner.Wait();
    ASSERT_TRUE(learnt.ok()) << learnt.ToString();
    played = learner.TakeNewest();
    ASSERT_NE(played, nullptr);
  }
  EXPECT_GE(requests, 3u);
  EXPECT_GT(missed[0], times.size() / 2);
  EXPECT_LE(10 * missed[1], missed[0]);
}

TEST_F(BackgroundLearning, MissesAreBoundedAndNeverKeptTwice) {
  Learner learner(trained_, OpenRig, {.most_misses = 3});
  EXPECT_TRUE(learner.Add({"sway", 0.1}));
  EXPECT_TRUE(learner.Add({"sway", 0.2}));
  EXPECT_FALSE(learner.Add({"sway", 0.1}));
  EXPECT_FALSE(learner.Add({"sway", kInfinity}));
  EXPECT_TRUE(learner.Add({"", 0, {{"upper.rotate.x", 1.05}}}));
  EXPECT_FALSE(learner.Add({"wave", 0.1}));
  EXPECT_FALSE(learner.Add({"sway", 0.2}));
  const Learner::State state = learner.state();
  EXPECT_EQ(state.kept, 3u);
  EXPECT_EQ(state.known, 2u);
  EXPECT_EQ(state.dropped, 2u);
  EXPECT_FALSE(state.learning);
}

TEST_F(BackgroundLearning, WhatFailsIsToldAndItsMissesAreKept) {
  int opened = 0;
  const auto open = [&]() -> Result<LearnerRig> {
    if (++opened == 1) return Status::Invalid("the rig is away");
    return OpenRig();
  };
  bool go_on = false;
  Learner learner(trained_, open, {.progress = [&](const char*, double) { return go_on; }});
  const auto fails_with = [&](const std::string& words) {
    ASSERT_TRUE(learner.Learn());
    const Status status = learner.Wait();
    ASSERT_FALSE(status.ok());
    EXPECT_NE(status.ToString().find(words), std::string::npos) << status.ToString();
    EXPECT_EQ(learner.state().last.ToString(), status.ToString());
    EXPECT_EQ(learner.TakeNewest(), nullptr);
    EXPECT_EQ(learner.state().versions, 0u);
  };
  EXPECT_TRUE(learner.Add({"sway", 0.5}));
  fails_with("the rig is away");
  EXPECT_EQ(learner.state().kept, 1u);
  fails_with("interrupted");
  EXPECT_EQ(learner.state().kept, 1u);
  EXPECT_FALSE(learner.Add({"sway", 0.5})) << "it is kept";
  go_on = true;
  EXPECT_TRUE(learner.Add({"swya", 0.5}));
  fails_with("did you mean \"sway\"");
}

TEST_F(BackgroundLearning, ItsEndGivesUpWhatIsBeingLearnt) {
  std::weak_ptr<void> owner;
  std::atomic<bool> training = false;
  {
    Learner learner(trained_,
                    [&] {
                      Result<LearnerRig> rig = OpenRig();
                      if (rig.ok()) owner = rig->owner;
                      return rig;
                    },
                    {.progress = [&](const char*, double) {
                      training = true;
                      training.notify_all();
                      return true;
                    }});
    ASSERT_TRUE(learner.Add({"sway", 0.5}));
    ASSERT_TRUE(learner.Learn());
    EXPECT_FALSE(learner.Learn()) << "one at a time";
    training.wait(false);
  }
  EXPECT_TRUE(owner.expired());
  const Learner unused(trained_, OpenRig);  // and of one that never learns
}

TEST_F(BackgroundLearning, LearnsPosesOfControls) {
  // Farther than the ranges of the controls and the margins beyond, which is a miss
  RigRun run(folder_->rig(), {.subspace = trained_});
  ASSERT_TRUE(run.ok()) << run.error;
  std::vector<std::vector<double>> poses;
  for (const double x : {0.95, 1.0, 1.05}) {
    std::vector<double> values;
    for (const Control& control : run.rig.controls)
      values.push_back(run.rig.graph->PlugName(control.plug) == "upper.rotate.x" ? x : 0);
    poses.push_back(values);
  }
  const auto misses = [&](RigRun* of) {
    std::size_t count = 0;
    for (const auto& pose : poses) {
      of->Pose(pose);
      count += of->Evaluate().hit ? 0 : 1;
    }
    return count;
  };
  ASSERT_EQ(misses(&run), poses.size());
  Learner learner(trained_, OpenRig, {.threads = 2});
  EXPECT_TRUE(learner.Add({"", 0, {{"upper.rotate.x", 1.05}}}));
  EXPECT_TRUE(learner.Learn());
  const Status learnt = learner.Wait();
  ASSERT_TRUE(learnt.ok()) << learnt.ToString();
  const std::shared_ptr<const Subspace> newer = learner.TakeNewest();
  RigRun adopted(folder_->rig(), {.subspace = newer});
  ASSERT_TRUE(adopted.ok()) << adopted.error;
  EXPECT_EQ(misses(&adopted), 0u);
  const TrainingRecord record = ParseTraining(newer->training);
  EXPECT_EQ(record.learnt_poses, (std::vector<Miss>{{"", 0, {{"upper.rotate.x", 1.05}}}}));
  EXPECT_TRUE(record.learnt.empty());
  // Over a clip, with the clip
  EXPECT_TRUE(learner.Add({"wave", 0.5, {{"upper.rotate.x", 1.05}}}));
  EXPECT_TRUE(learner.Add({"", 0, {{"upper.rotate.q", 0.8}}}));
  EXPECT_TRUE(learner.Learn());
  EXPECT_NE(learner.Wait().ToString().find("upper.rotate.q"), std::string::npos);
}

}  // namespace
}  // namespace kpsa::engine
