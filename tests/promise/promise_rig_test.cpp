#include "bench/promise_rig.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>

#include "bench/promise_poses.h"
#include "tests/support/temporary_folder.h"

namespace kpsa::engine {
namespace {

const std::string kHello = KPSA_SCENES_DIR "/hello/hello.yaml";

class PromiseRigTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    Result<std::unique_ptr<PromiseRig>> rig = PromiseRig::Open(kHello);
    ASSERT_TRUE(rig.ok()) << rig.status().ToString();
    rig_ = std::move(*rig);
    Result<PromiseTraining> training = rig_->Train(rig_->tolerance(), 3);
    ASSERT_TRUE(training.ok()) << training.status().ToString();
    training_ = std::make_unique<PromiseTraining>(std::move(*training));
  }
  static void TearDownTestSuite() { training_.reset(), rig_.reset(); }
  void SetUp() override { ASSERT_NE(training_, nullptr); }

  static inline std::unique_ptr<PromiseRig> rig_;
  static inline std::unique_ptr<PromiseTraining> training_;
};

TEST_F(PromiseRigTest, TrainsAsTheProgramDoes) {
  TemporaryFolder folder;
  const std::string file = folder / "hello.kpsa";
  const std::string command =
      "'" KPSA_PROGRAM "' train '" + kHello + "' --seed 3 -q -o '" + file + "' > /dev/null";
  ASSERT_EQ(std::system(command.c_str()), 0);
  const Result<Subspace> other = ReadSubspace(file, KeptModes::kSkip);
  ASSERT_TRUE(other.ok()) << other.status().ToString();
  const Subspace& mine = training_->subspace();
  EXPECT_EQ(mine.rig_hash, other->rig_hash);
  EXPECT_EQ(mine.tolerance, other->tolerance);
  EXPECT_EQ(mine.violation_rate, other->violation_rate);
  EXPECT_EQ(mine.cue_mean, other->cue_mean);
  ASSERT_EQ(mine.calibration.size(), other->calibration.size());
  for (std::size_t i = 0; i < mine.calibration.size(); ++i) {
    EXPECT_EQ(mine.calibration[i].score, other->calibration[i].score) << i;
    EXPECT_EQ(mine.calibration[i].error, other->calibration[i].error) << i;
  }
}

// A full miss passes the full evaluation on, bit for bit: any distance would be between different poses.
TEST_F(PromiseRigTest, ComparesTheSamePose) {
  std::size_t hits = 0, misses = 0;
  for (const TrialKind kind : kTrialKinds) {
    const Result<std::vector<PromisePose>> poses = DrawPoses(rig_.get(), kind, 200, 5);
    ASSERT_TRUE(poses.ok()) << poses.status().ToString();
    const auto outcomes = rig_->Try(*poses, {training_.get(), 1});
    ASSERT_TRUE(outcomes.ok()) << outcomes.status().ToString();
    ASSERT_EQ(outcomes->size(), 1u);
    ASSERT_EQ(outcomes->front().size(), poses->size());
    for (const PromiseOutcome& outcome : outcomes->front()) {
      if (outcome.verdict == PromiseVerdict::kMiss) {
        ++misses;
        EXPECT_EQ(outcome.error, 0);
      } else if (outcome.verdict == PromiseVerdict::kHit) {
        ++hits;
        EXPECT_GT(outcome.error, 0);
        EXPECT_LT(outcome.error, 100 * rig_->tolerance());
      }
    }
  }
  EXPECT_GT(hits, 100u);
  EXPECT_GT(misses, 50u);
}

// A step's error changes by no more than the errors before and after it, and far beyond the range all steps
// are misses, whose error is 0.
TEST_F(PromiseRigTest, MeasuresJumps) {
  constexpr std::size_t kSteps = 50;
  const double end = rig_->controls()[0].max;
  const PromisePose rest = rig_->Rest();
  const std::vector<PromiseWalk> walks{
      {rest, 0, 0.2, 0.2}, {rest, 0, 2 * end, 2.5 * end}, {rest, 0, 0, 0.9 * end}, {rest, 0, 0, 2 * end}};
  const auto walked = rig_->Walk(walks, kSteps, {training_.get(), 1});
  ASSERT_TRUE(walked.ok()) << walked.status().ToString();
  const std::vector<PromiseJump>& jumps = walked->front();
  EXPECT_EQ(jumps[0].excess, 0) << "nothing moves";
  EXPECT_EQ(jumps[1].excess, 0) << "misses";
  EXPECT_FALSE(jumps[1].accepted);
  EXPECT_TRUE(jumps[3].accepted);
  EXPECT_GT(jumps[2].excess, 0) << "hits";
  std::vector<PromisePose> poses(kSteps + 1, rest);
  for (std::size_t s = 0; s <= kSteps; ++s) poses[s].values[0] = 2 * end * static_cast<double>(s) / kSteps;
  const auto tried = rig_->Try(poses, {training_.get(), 1});
  ASSERT_TRUE(tried.ok());
  const std::vector<PromiseOutcome>& outcomes = tried->front();
  EXPECT_EQ(outcomes.front().verdict, PromiseVerdict::kHit);
  EXPECT_EQ(outcomes.back().verdict, PromiseVerdict::kMiss);
  double most = 0;
  for (std::size_t s = 1; s <= kSteps; ++s) most = std::max(most, outcomes[s - 1].error + outcomes[s].error);
  EXPECT_GT(jumps[3].excess, 0);
  EXPECT_LE(jumps[3].excess, most);
}

// Trainings beside each other are what each is alone.
TEST_F(PromiseRigTest, TriesSeveralTrainingsAtOnce) {
  Result<PromiseTraining> coarse = rig_->Train(5 * rig_->tolerance(), 3);
  ASSERT_TRUE(coarse.ok()) << coarse.status().ToString();
  const Result<std::vector<PromisePose>> poses = DrawPoses(rig_.get(), TrialKind::kMargin, 100, 5);
  ASSERT_TRUE(poses.ok());
  std::vector<PromiseTraining> both{*training_, *coarse};
  const auto together = rig_->Try(*poses, both);
  ASSERT_TRUE(together.ok()) << together.status().ToString();
  for (std::size_t t = 0; t < both.size(); ++t) {
    const auto alone = rig_->Try(*poses, {&both[t], 1});
    ASSERT_TRUE(alone.ok());
    for (std::size_t p = 0; p < poses->size(); ++p) {
      EXPECT_EQ((*together)[t][p].verdict, alone->front()[p].verdict) << t << " " << p;
      EXPECT_EQ((*together)[t][p].error, alone->front()[p].error) << t << " " << p;
    }
  }
}

TEST(PromiseRig, RefusesWhatHasNothingToTry) {
  const Result<std::unique_ptr<PromiseRig>> character =
      PromiseRig::Open(std::string(KPSA_SCENES_DIR) + "/hello/hello.glb");
  ASSERT_FALSE(character.ok());
  EXPECT_NE(character.status().ToString().find("no accelerate entry"), std::string::npos);
  EXPECT_FALSE(PromiseRig::Open(std::string(KPSA_SCENES_DIR) + "/nobody.yaml").ok());
}

}  // namespace
}  // namespace kpsa::engine
