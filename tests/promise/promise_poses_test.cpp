#include "bench/promise_poses.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

namespace kpsa::engine {
namespace {

std::unique_ptr<PromiseRig> Open(const std::string& name) {
  Result<std::unique_ptr<PromiseRig>> rig =
      PromiseRig::Open(std::string(KPSA_SCENES_DIR) + "/" + name + "/" + name + ".yaml");
  EXPECT_TRUE(rig.ok()) << rig.status().ToString();
  return rig.ok() ? std::move(*rig) : nullptr;
}

std::vector<PromisePose> Draw(PromiseRig* rig, TrialKind kind, std::size_t count, std::uint64_t seed) {
  Result<std::vector<PromisePose>> poses = DrawPoses(rig, kind, count, seed);
  EXPECT_TRUE(poses.ok()) << poses.status().ToString();
  return poses.ok() ? std::move(*poses) : std::vector<PromisePose>();
}

TEST(PromisePoses, MixturesMoveThreeToSixControlsWithinTheirRanges) {
  const std::unique_ptr<PromiseRig> rig = Open("face");
  std::set<std::size_t> counts;
  for (const PromisePose& pose : Draw(rig.get(), TrialKind::kMixtures, 200, 1)) {
    EXPECT_LT(pose.clip, 0);
    std::size_t moved = 0;
    for (std::size_t c = 0; c < pose.values.size(); ++c) {
      const ControlRange& control = rig->controls()[c];
      EXPECT_GE(pose.values[c], control.min);
      EXPECT_LE(pose.values[c], control.max);
      moved += pose.values[c] != control.rest;
    }
    counts.insert(moved);
  }
  EXPECT_EQ(counts, (std::set<std::size_t>{3, 4, 5, 6}));
}

TEST(PromisePoses, MarginIsBeyondEndsByATenthOfTheRangeAtMost) {
  const std::unique_ptr<PromiseRig> rig = Open("hello");
  std::size_t below = 0, above = 0;
  for (const PromisePose& pose : Draw(rig.get(), TrialKind::kMargin, 200, 1)) {
    std::size_t beyond = 0;
    for (std::size_t c = 0; c < pose.values.size(); ++c) {
      const ControlRange& control = rig->controls()[c];
      const double range = control.max - control.min;
      EXPECT_GE(pose.values[c], control.min - 0.1 * range);
      EXPECT_LE(pose.values[c], control.max + 0.1 * range);
      below += pose.values[c] < control.min;
      above += pose.values[c] > control.max;
      beyond += pose.values[c] < control.min || pose.values[c] > control.max;
    }
    EXPECT_GE(beyond, 1u);
    EXPECT_LE(beyond, 3u);
  }
  EXPECT_GT(below, 50u);
  EXPECT_GT(above, 50u);
}

TEST(PromisePoses, ClipsPlayBetweenTheirFrames) {
  const std::unique_ptr<PromiseRig> rig = Open("face");
  ASSERT_EQ(rig->clips().size(), 3u) << "two that are trained on, and the test clip";
  std::set<int> clips;
  std::size_t halves = 0;
  const std::vector<PromisePose> poses = Draw(rig.get(), TrialKind::kClips, 300, 1);
  for (const PromisePose& pose : poses) {
    clips.insert(pose.clip);
    const std::vector<double>& times = rig->clips()[static_cast<std::size_t>(pose.clip)].times;
    EXPECT_GE(pose.time, times.front());
    EXPECT_LE(pose.time, times.back());
    const double frame = pose.time * rig->fps();
    EXPECT_GT(std::abs(frame - std::round(frame)), 1e-3);
    halves += std::abs(frame - std::floor(frame) - 0.5) < 1e-6;
  }
  EXPECT_EQ(clips, (std::set<int>{0, 1, 2}));
  EXPECT_EQ(halves, poses.size() / 2);
}

TEST(PromisePoses, SeedsDecide) {
  const std::unique_ptr<PromiseRig> rig = Open("hello");
  for (const TrialKind kind : kTrialKinds) {
    const std::vector<PromisePose> once = Draw(rig.get(), kind, 40, 1), again = Draw(rig.get(), kind, 40, 1),
                                   other = Draw(rig.get(), kind, 40, 2);
    ASSERT_EQ(once.size(), 40u) << TrialKindName(kind);
    const auto same = [](const PromisePose& a, const PromisePose& b) {
      return a.clip == b.clip && a.time == b.time && a.values == b.values;
    };
    EXPECT_TRUE(std::equal(once.begin(), once.end(), again.begin(), again.end(), same));
    EXPECT_FALSE(std::equal(once.begin(), once.end(), other.begin(), other.end(), same));
  }
}

TEST(PromisePoses, WalksGoFromWithinAnEndToBeyondIt) {
  const std::unique_ptr<PromiseRig> face = Open("face");
  std::set<std::size_t> walked;
  for (const std::uint64_t seed : {1, 2}) {
    const Result<std::vector<PromiseWalk>> walks = DrawWalks(face.get(), 12, seed);
    ASSERT_TRUE(walks.ok());
    EXPECT_EQ(walks->size(), 12u);
    for (const PromiseWalk& walk : *walks) {
      walked.insert(walk.control);
      const ControlRange& control = face->controls()[walk.control];
      const double range = control.max - control.min;
      const bool up = walk.to > walk.from;
      const double end = up ? control.max : control.min, sign = up ? 1 : -1;
      EXPECT_NEAR(walk.from, end - sign * 0.05 * range, 1e-9);
      EXPECT_NEAR(walk.to, end + sign * 0.2 * range, 1e-9);
      EXPECT_LT(walk.pose.clip, 0);
    }
  }
  EXPECT_EQ(walked.size(), 24u) << "another seed takes other controls";
  const std::unique_ptr<PromiseRig> hello = Open("hello");
  const Result<std::vector<PromiseWalk>> walks = DrawWalks(hello.get(), 12, 1);
  ASSERT_TRUE(walks.ok());
  EXPECT_EQ(walks->size(), hello->controls().size());
}

}  // namespace
}  // namespace kpsa::engine
