// How far beyond the trained ranges a subspace is trusted: as far as it holds the tolerance there, joint by
// joint.
#include <cmath>

#include "tests/cli/hello_folder.h"
#include "tests/cli/rig_run.h"

namespace kpsa::engine {
namespace {

// The share of a control's range by which it is beyond its upper end, where the guards begin to ask for the
// full evaluation; 1 where they do not within its whole range.
double GuardedFrom(RigRun* fast, std::size_t control) {
  const Control& moved = fast->rig.controls[control];
  for (int step = 1; step <= 50; ++step) {
    const double beyond = 0.02 * step;
    std::vector<double> pose;
    for (std::size_t c = 0; c < fast->rig.controls.size(); ++c)
      pose.push_back(c == control ? moved.max + beyond * (moved.max - moved.min) : 0);
    fast->Pose(pose);
    if (fast->Evaluate().full_weight > 0) return beyond;
  }
  return 1;
}

TEST(RangeMargins, AreAsWideAsTheToleranceIsKept) {
  const HelloFolder folder;
  RigRun full(folder.rig());
  std::vector<double> guarded_from;
  for (const double tolerance : {0.02e-3, 20e-3}) {
    TrainOptions options = QuickTraining();
    options.tolerance = tolerance;
    const auto trained = TrainRig(folder.rig(), options);
    ASSERT_NE(trained, nullptr);
    RigRun fast(folder.rig(), {.subspace = WithGuardsOnly(*trained)});
    ASSERT_TRUE(fast.ok()) << fast.error;
    const std::size_t bend = 0;  // upper.rotateX
    guarded_from.push_back(GuardedFrom(&fast, bend));
    // What no guard asks for is right
    const Control& moved = fast.rig.controls[bend];
    std::vector<double> pose(fast.rig.controls.size(), 0);
    pose[bend] = moved.max + 0.9 * guarded_from.back() * (moved.max - moved.min);
    full.Pose(pose), fast.Pose(pose);
    const double distance = LargestDistance(fast.Evaluate().points, full.Evaluate().points);
    EXPECT_LT(distance, tolerance);
    EXPECT_GT(distance, 0);
  }
  EXPECT_LT(guarded_from[0], 0.1);
  EXPECT_GT(guarded_from[1], 0.25) << "a third of the range, but for the ramp";
  EXPECT_LT(guarded_from[1], 0.7) << "and no farther than was tried";
}

}  // namespace
}  // namespace kpsa::engine
