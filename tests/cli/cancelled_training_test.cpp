// A whole training ends by itself wherever it is asked to, not at its stages alone, and leaves the rig as it was.
#include "base/cancel.h"
#include "tests/cli/hello_folder.h"
#include "tests/cli/process.h"
#include "tests/cli/rig_run.h"
#include "tests/support/countdown.h"

namespace kpsa::engine {
namespace {

TEST(CancelledTrainings, EndWhereTheyAreAskedTo) {
  RigOptions rest;
  rest.rest = true;
  Result<Rig> rig = LoadRig(AcceleratedRegistry(), kHello, rest);
  ASSERT_TRUE(rig.ok()) << rig.status().ToString();
  const Result<std::vector<TrainingClip>> clips = ClipFrames(*rig, {"wave"});
  ASSERT_TRUE(clips.ok());
  TrainOptions options = QuickTraining();
  int stages = 0;
  options.progress = [&](const char*, double) { return ++stages > 0; };
  const auto train = [&](const Countdown& countdown) {
    const CancelScope scope(&countdown);
    return Train(MakeTrainingRig(&*rig, rig->accelerate[0]), *clips, options);
  };
  const Countdown never;
  const Result<Subspace> whole = train(never);
  ASSERT_TRUE(whole.ok()) << whole.status().ToString();
  const long long all = never.questions();
  EXPECT_GT(all, 20 * stages) << "far more often than stages are told";
  for (int part = 0; part < 4; ++part) {
    const Countdown countdown(part * (all - 1) / 3);
    const Result<Subspace> ended = train(countdown);
    ASSERT_FALSE(ended.ok()) << part;
    EXPECT_EQ(ended.status().kind(), ErrorKind::kInterrupted) << part << " " << ended.status().ToString();
  }
  const Result<Subspace> again = train(Countdown());
  ASSERT_TRUE(again.ok()) << again.status().ToString();
  EXPECT_EQ(again->cues.size(), whole->cues.size()) << "the rig is what it was";
}

}  // namespace
}  // namespace kpsa::engine
