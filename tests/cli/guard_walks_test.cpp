// Walks across the ends of trained ranges: guards bring the full evaluation in smoothly, so no step is much
// larger than the full evaluation's own.
#include <cmath>

#include "tests/cli/hello_folder.h"
#include "tests/cli/rig_run.h"

namespace kpsa::engine {
namespace {

constexpr double kWalkTolerance = 0.5e-3;

// The largest of what a step of the accelerated points exceeds the full evaluation's by, in tolerances, over
// 400 steps of a control from `inside` of its range within an end to `beyond` outside of it.
double LargestJump(RigRun* full, RigRun* fast, std::size_t control, bool up, double other,
                   std::size_t* blends) {
  constexpr int kSteps = 400;
  const Control& walked = full->rig.controls[control];
  const double extent = walked.max - walked.min;
  std::vector<float> full_before, fast_before;
  double largest = 0;
  for (int step = 0; step <= kSteps; ++step) {
    const double along = (-0.05 + 0.25 * step / kSteps) * extent;
    std::vector<double> pose;
    for (std::size_t c = 0; c < full->rig.controls.size(); ++c)
      pose.push_back(c == control ? (up ? walked.max + along : walked.min - along)
                                  : other * full->rig.controls[c].max);
    full->Pose(pose), fast->Pose(pose);
    const std::vector<float> exact = full->Evaluate().points;
    const RunFrame frame = fast->Evaluate();
    *blends += !frame.hit && !SameBytes(frame.points, exact);
    if (step > 0) {
      largest =
          std::max(largest, LargestDistance(frame.points, fast_before) - LargestDistance(exact, full_before));
    }
    full_before = exact, fast_before = frame.points;
  }
  return largest / kWalkTolerance;
}

TEST(GuardWalks, NoStepIsMuchLargerThanTheFullEvaluations) {
  const HelloFolder folder;
  TrainOptions options;
  options.samples = 400;
  options.tolerance = kWalkTolerance;
  options.violation_rate = 0.05;
  const auto trained = TrainRig(folder.rig(), options);
  ASSERT_NE(trained, nullptr);
  RigRun full(folder.rig()), fast(folder.rig(), {.subspace = trained});
  ASSERT_TRUE(fast.ok()) << fast.error;
  std::size_t blends = 0;
  for (std::size_t control = 0; control < full.rig.controls.size(); ++control) {
    for (const bool up : {false, true}) {
      for (const double other : {0.0, 0.5, -0.6})
        EXPECT_LE(LargestJump(&full, &fast, control, up, other, &blends), 0.5)
            << full.rig.controls[control].name << (up ? " up " : " down ") << other;
    }
  }
  EXPECT_GT(blends, 100u) << "the walks cross ramps";

  // The canary: where the approximation is coarse, guards without a ramp jump
  options.max_modes = 5;
  options.may_have_cues_by_tile = false;
  const auto coarse = TrainRig(folder.rig(), options);
  ASSERT_NE(coarse, nullptr);
  const auto worst = [&](std::shared_ptr<const Subspace> subspace) {
    RigRun run(folder.rig(), {.subspace = std::move(subspace)});
    double largest = 0;
    for (std::size_t control = 0; control < full.rig.controls.size(); ++control) {
      for (const bool up : {false, true})
        largest = std::max(largest, LargestJump(&full, &run, control, up, 0.5, &blends));
    }
    return largest;
  };
  const auto soft = WithThreshold(*coarse, 1e9, 2e9);
  auto steep = std::make_shared<Subspace>(*soft);
  for (TrainedRange& range : steep->ranges) range.ramp = 0;
  const double hard_jump = worst(steep);
  EXPECT_GT(hard_jump, 0.25);
  EXPECT_LT(worst(soft), 0.25 * hard_jump);
}

}  // namespace
}  // namespace kpsa::engine
