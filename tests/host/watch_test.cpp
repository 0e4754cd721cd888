// Calls that take long tell how far they are, and end when somebody wants them to.
#include "host/watch.h"

#include <gtest/gtest.h>

#include <atomic>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "graph/profile.h"
#include "host/bench/idle.h"
#include "host/open_rig.h"
#include "host/profile_run.h"
#include "host/rig_frames.h"
#include "kpsa/kpsa_node.h"
#include "nodes/standard_nodes.h"

namespace kpsa::engine {
namespace {

constexpr const char* kHelloYaml = KPSA_SCENES_DIR "/hello/hello.yaml";

Result<std::unique_ptr<OpenRig>> OpenHello(const RigChange& change) {
  auto open = std::make_unique<OpenRig>();
  AddStandardNodes(open->registry);
  AddKpsaNode(open->registry);
  Result<Rig> rig = LoadRig(open->registry, kHelloYaml, {});
  if (!rig.ok()) return rig.status();
  open->rig = std::move(*rig);
  KPSA_RETURN_IF_ERROR(SetClip(&open->rig, change.clip.value_or("wave")));
  return open;
}

class Watched : public ::testing::Test {
 protected:
  void SetUp() override {
    Result<std::unique_ptr<OpenRig>> open = OpenHello({});
    ASSERT_TRUE(open.ok()) << open.status().ToString();
    open_ = std::move(*open);
    Compiler compiler;
    auto plan = CompileFor(rig(), &compiler, ShownPoints(rig()));
    ASSERT_TRUE(plan.ok()) << plan.status().ToString();
    plan_ = std::move(*plan);
    Result<std::vector<double>> times = ClipTimes(rig());
    ASSERT_TRUE(times.ok());
    times_ = std::move(*times);
    ASSERT_GT(times_.size(), 2u);
  }
  const Rig& rig() const { return open_->rig; }
  static Status Nothing(std::size_t, const Evaluator&) { return Status(); }

  std::unique_ptr<OpenRig> open_;
  std::shared_ptr<const Plan> plan_;
  std::vector<double> times_;
  std::atomic<bool> cancel_{false};
};

TEST_F(Watched, FramesCountUpToAll) {
  std::vector<std::size_t> done;
  RigFrameOptions options;
  options.watch.progress = [&](std::size_t now, std::size_t all) {
    EXPECT_EQ(all, times_.size());
    done.push_back(now);
  };
  ASSERT_TRUE(EvaluateTimes(rig(), plan_, times_, options, Nothing).ok());
  ASSERT_EQ(done.size(), times_.size());
  for (std::size_t f = 0; f < done.size(); ++f) EXPECT_EQ(done[f], f + 1);
}

TEST_F(Watched, FramesEndWhereTheyAreCancelled) {
  RigFrameOptions options;
  options.threads = 1;
  options.watch.cancel = &cancel_;
  std::size_t frames = 0;
  const Status status =
      EvaluateTimes(rig(), plan_, times_, options, [&](std::size_t, const Evaluator&) -> Status {
        cancel_ = ++frames == 2;
        return Status();
      });
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.kind(), ErrorKind::kInterrupted);
  EXPECT_LT(frames, times_.size());
}

TEST_F(Watched, MeasuringIsCancelled) {
  cancel_ = true;
  const Watch watch{{}, &cancel_};
  Profile profile(*plan_);
  const Result<Measured> measured = Measure(rig(), plan_, times_, false, watch, &profile);
  ASSERT_FALSE(measured.ok());
  EXPECT_EQ(measured.status().kind(), ErrorKind::kInterrupted);
  Evaluator evaluator(plan_);
  EXPECT_EQ(EvaluateTo(rig(), 3, &evaluator, watch).kind(), ErrorKind::kInterrupted);
  const RigOpener opener{kHelloYaml, OpenHello, [](const OpenRig& open) { return ClipTimes(open.rig); }};
  const Result<IdleDeformers> idle = MeasureIdle(opener, {"wave"}, 1e-3, {}, watch);
  ASSERT_FALSE(idle.ok());
  EXPECT_EQ(idle.status().kind(), ErrorKind::kInterrupted);
}

TEST_F(Watched, WithoutAClipTimeZeroIsAll) {
  const std::vector<double> clip = times_;
  EXPECT_EQ(clip.front(), 0);
  for (std::size_t f = 1; f < clip.size(); ++f)
    EXPECT_EQ(FrameNumber(clip[f], rig().fps), static_cast<std::int64_t>(f));
  ASSERT_TRUE(SetClip(&open_->rig, std::nullopt).ok());
  const Result<std::vector<double>> rest = ClipTimes(rig());
  ASSERT_TRUE(rest.ok());
  EXPECT_EQ(*rest, std::vector<double>{0.0});
}

}  // namespace
}  // namespace kpsa::engine
