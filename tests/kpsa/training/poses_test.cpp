#include "kpsa/training/poses.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "kpsa/training/branches.h"

namespace kpsa::engine {
namespace {

// A transform turned about three axes, from -1 to max.
void AddTurns(Index node, double max, std::vector<ControlRange>* controls) {
  for (int axis = 0; axis < 3; ++axis) {
    ControlRange& control = controls->emplace_back();
    control.plug = {NodeId{node}, 0};
    control.plug.component = axis;
    control.min = -1, control.max = max;
  }
}

// Two transforms turned about three axes each, and two weights of a mesh.
std::vector<ControlRange> Controls() {
  std::vector<ControlRange> controls;
  for (Index node = 0; node < 2; ++node) AddTurns(node, 2, &controls);
  for (int element = 0; element < 2; ++element) {
    ControlRange& control = controls.emplace_back();
    control.plug = {NodeId{2}, 1};
    control.plug.element = element;
    control.max = 1;
  }
  return controls;
}

// None of which carries another, as of BranchesOf.
std::vector<Branch> Apart(const std::vector<ControlRange>& controls) {
  std::vector<Branch> branches;
  for (std::size_t c = 0; c < controls.size(); ++c) {
    if (c == 0 || !OfOneNode(controls[c - 1], controls[c])) branches.push_back({.begin = c, .end = c});
    branches.back().end = c + 1;
  }
  return branches;
}

TEST(PosesTogether, TurnEachTransformAboutAllOfItsAxesWithinItsRanges) {
  const std::vector<ControlRange> controls = Controls();
  std::size_t both = 0, weights = 0;
  for (const SampledPose& pose : PosesTogether(controls, 400, 7)) {
    ASSERT_EQ(pose.values.size(), controls.size());
    for (std::size_t c = 0; c < controls.size(); ++c) {
      EXPECT_GE(pose.values[c], controls[c].min);
      EXPECT_LE(pose.values[c], controls[c].max);
    }
    for (const std::size_t first : {0u, 3u}) {  // all axes, or none
      EXPECT_EQ(pose.values[first] != 0, pose.values[first + 1] != 0);
      EXPECT_EQ(pose.values[first] != 0, pose.values[first + 2] != 0);
    }
    both += pose.values[0] != 0 && pose.values[3] != 0;
    weights += pose.values[6] != 0;
  }
  EXPECT_GT(both, 100u);
  EXPECT_GT(weights, 20u);
  EXPECT_LT(weights, 200u);
}

// A hinge, a ball joint and a hinge the other way, and a weight.
std::vector<ControlRange> HingesOfALimb() {
  std::vector<ControlRange> controls = Controls();
  controls.insert(controls.begin() + 6, controls.begin() + 3, controls.begin() + 6);
  for (std::size_t c = 6; c < 9; ++c) controls[c].plug.node = NodeId{3};
  controls[0].min = -0.1, controls[0].max = 2;
  for (const std::size_t c : {1u, 2u, 4u, 5u, 7u, 8u}) controls[c].min = -0.5, controls[c].max = 0.5;
  controls[3].min = -1, controls[3].max = 1;
  controls[6].min = -2, controls[6].max = 0.1;
  return controls;
}

TEST(PosesFolded, BendHingesTheirWayTogether) {
  const std::vector<ControlRange> controls = HingesOfALimb();
  const auto hinge = [](const SampledPose& pose, std::size_t c) { return std::fabs(pose.values[c]); };
  std::size_t fists = 0, curled[2] = {0, 0}, weights = 0;
  const std::vector<SampledPose> poses = PosesFolded(controls, Apart(controls), 400, 7);
  ASSERT_EQ(poses.size(), 400u);
  for (const SampledPose& pose : poses) {
    ASSERT_EQ(pose.values.size(), controls.size());
    for (std::size_t c = 0; c < controls.size(); ++c) {
      EXPECT_GE(pose.values[c], controls[c].min);
      EXPECT_LE(pose.values[c], controls[c].max);
    }
    EXPECT_GE(pose.values[0], 0) << "a hinge bends its way, or rests";
    EXPECT_LE(pose.values[6], 0);
    const bool folds = hinge(pose, 0) > 1.7 && hinge(pose, 6) > 1.7;
    fists += folds && std::fabs(pose.values[1]) < 0.16 && std::fabs(pose.values[7]) < 0.16;
    for (const bool up : {false, true})
      curled[up] += folds && (up ? pose.values[3] > 0.85 : pose.values[3] < -0.85);
    weights += pose.values[9] != 0;
  }
  EXPECT_GT(fists, 15u)
      << "both hinges bent nearly as far as they go, and next to nothing else of them turned";
  EXPECT_GT(curled[0], 5u);
  EXPECT_GT(curled[1], 5u);
  EXPECT_GT(weights, 20u);
  EXPECT_LT(weights, 200u);
  EXPECT_TRUE(PosesFolded({}, {}, 60, 7).empty());
}

TEST(PosesFolded, CurlChainsOneWay) {
  // Six joints that turn both ways
  std::vector<ControlRange> chain;
  for (Index node = 0; node < 6; ++node) AddTurns(node, 1, &chain);
  std::set<std::pair<int, bool>> curls;
  for (const SampledPose& pose : PosesFolded(chain, Apart(chain), 600, 7)) {
    for (int axis = 0; axis < 3; ++axis) {
      for (const bool up : {false, true}) {
        bool all = true;
        for (std::size_t node = 0; node < 6; ++node)
          all = all && (up ? 1 : -1) * pose.values[3 * node + static_cast<std::size_t>(axis)] > 0.6;
        if (all) curls.emplace(axis, up);
      }
    }
  }
  EXPECT_EQ(curls.size(), 6u) << "about each axis, both ways";
}

TEST(PosesFolded, LeaveMostOfManyAsTheyAre) {
  std::vector<ControlRange> face;
  for (Index node = 0; node < 12; ++node) AddTurns(node, 1, &face);
  std::vector<Branch> branches = Apart(face);
  for (std::size_t b = 1; b < branches.size(); ++b) branches[b].above = 0;
  const auto folded = [&face](const SampledPose& pose) {
    std::size_t count = 0;
    for (std::size_t c = 3; c < face.size(); c += 3)
      count += pose.values[c] != 0 || pose.values[c + 1] != 0 || pose.values[c + 2] != 0;
    return count;
  };
  std::size_t most = 0, head = 0;
  for (const SampledPose& pose : PosesFolded(face, branches, 200, 7)) {
    most = std::max(most, folded(pose));
    head += pose.values[0] != 0;
  }
  EXPECT_EQ(most, 5u);
  EXPECT_GT(head, 100u) << "the one they hang from turns as ever";
}

// The second transform and the second weight stand still in the clips.
ClipPoses FramesOfSome(const std::vector<ControlRange>& controls) {
  ClipPoses frames;
  for (int f = 0; f < 5; ++f) {
    std::vector<double>& frame = frames.emplace_back(controls.size(), 0.0);
    for (const std::size_t c : {0u, 1u, 2u, 6u}) frame[c] = 0.2 * f;
    frame[3] = 0.001 * f;  // next to nothing
  }
  return frames;
}

TEST(HeldControls, AreThoseThatNoClipMoves) {
  std::vector<ControlRange> controls = Controls();
  EXPECT_EQ(HeldControls(controls, FramesOfSome(controls)), (std::vector<std::size_t>{3, 4, 5, 7}));
  controls[4].by_clip = true;
  controls[5].min = controls[5].max = 0;
  EXPECT_EQ(HeldControls(controls, FramesOfSome(controls)), (std::vector<std::size_t>{3, 7}));
  EXPECT_TRUE(HeldControls(controls, {}).empty()) << "without clips nothing is held over them";
}

TEST(PosesOfKind, HoldControlsFarOutOverClips) {
  const std::vector<ControlRange> controls = Controls();
  const ClipPoses frames = FramesOfSome(controls);
  const std::set<std::size_t> held{3, 4, 5, 7};
  const auto poses = PosesOfKind(PoseKind::kHeld, controls, frames, {}, 2, 200, 7);
  ASSERT_EQ(poses.size(), 200u);
  std::set<int> clips;
  std::set<std::pair<std::size_t, bool>> far_out;  // control, whether up
  std::size_t several = 0;
  for (std::size_t p = 0; p < poses.size(); ++p) {
    EXPECT_EQ(poses[p].kind, PoseKind::kHeld);
    EXPECT_FALSE(poses[p].near_clips) << "no clip looks like that";
    clips.insert(poses[p].clip);
    std::size_t moved = 0;
    for (std::size_t c = 0; c < controls.size(); ++c) {
      const double value = poses[p].values[c];
      EXPECT_TRUE(value >= controls[c].min && value <= controls[c].max);
      if (value == 0) continue;
      EXPECT_TRUE(held.contains(c)) << c;
      ++moved;
      if (p % 2 != 0) continue;
      EXPECT_GE(std::abs(value), 0.5 * std::abs(value > 0 ? controls[c].max : controls[c].min));
      far_out.emplace(c, value > 0);
    }
    if (p % 2 == 0) {
      EXPECT_EQ(moved, 1u);
    }
    several += moved > 1;
  }
  EXPECT_EQ(clips, (std::set<int>{0, 1}));
  EXPECT_EQ(far_out.size(), 7u) << "each control at each of its ends; a weight has one";
  EXPECT_GT(several, 40u);
  EXPECT_TRUE(PosesOfKind(PoseKind::kHeld, controls, frames, {}, 0, 9, 7).empty()) << "no clips";
}

TEST(PosesAlone, HoldEachControlAtBothOfItsEnds) {
  const std::vector<ControlRange> controls = Controls();
  const std::vector<std::size_t> held{4, 7};
  const auto poses = PosesAlone(controls, held, 8, 3, 7);
  ASSERT_EQ(poses.size(), 16u);
  std::multiset<double> ends;
  for (std::size_t p = 0; p < poses.size(); ++p) {
    EXPECT_TRUE(poses[p].clip >= 0 && poses[p].clip < 3);
    for (std::size_t c = 0; c < controls.size(); ++c) {
      const double value = poses[p].values[c];
      if (c != held[p / 8]) {
        EXPECT_EQ(value, 0);
        continue;
      }
      EXPECT_GE(std::abs(value), 0.7 * (value > 0 ? controls[c].max : -controls[c].min));
      if (value == controls[c].min || value == controls[c].max) ends.insert(value);
    }
  }
  // Half of the poses are at an end; a weight has one
  EXPECT_EQ(ends, (std::multiset<double>{-1, -1, 1, 1, 1, 1, 2, 2}));
}

}  // namespace
}  // namespace kpsa::engine
