#include "kpsa/training/poses.h"

#include <gtest/gtest.h>

#include <set>

namespace kpsa::engine {
namespace {

// Two transforms turned about three axes each, and two weights of a mesh.
std::vector<ControlRange> Controls() {
  std::vector<ControlRange> controls;
  for (Index node = 0; node < 2; ++node) {
    for (int axis = 0; axis < 3; ++axis) {
      ControlRange& control = controls.emplace_back();
      control.plug = {NodeId{node}, 0};
      control.plug.component = axis;
      control.min = -1, control.max = 2;
    }
  }
  for (int element = 0; element < 2; ++element) {
    ControlRange& control = controls.emplace_back();
    control.plug = {NodeId{2}, 1};
    control.plug.element = element;
    control.max = 1;
  }
  return controls;
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

TEST(PosesAtEnds, HaveEveryCornerOfEachTransform) {
  const std::vector<ControlRange> controls = Controls();
  std::set<int> corners[2];
  for (const SampledPose& pose : PosesAtEnds(controls, 60, 7)) {
    for (std::size_t c = 0; c < controls.size(); ++c)
      EXPECT_TRUE(pose.values[c] == controls[c].min || pose.values[c] == controls[c].max);
    for (std::size_t n = 0; n < 2; ++n) {
      int corner = 0;
      for (std::size_t axis = 0; axis < 3; ++axis) corner = 2 * corner + (pose.values[3 * n + axis] > 0);
      corners[n].insert(corner);
    }
  }
  EXPECT_EQ(corners[0].size(), 8u);
  EXPECT_EQ(corners[1].size(), 8u);
  EXPECT_TRUE(PosesAtEnds({}, 60, 7).empty());
}

}  // namespace
}  // namespace kpsa::engine
