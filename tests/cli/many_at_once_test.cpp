// How much may be out of rest at once: beyond a limit frames miss, up to it they are as without one.
#include <cmath>
#include <random>

#include "kpsa/activity.h"
#include "tests/cli/hello_folder.h"
#include "tests/cli/process.h"
#include "tests/cli/rig_run.h"

namespace kpsa::engine {
namespace {

const std::string kColumn = KPSA_SCENES_DIR "/hello/hello.yaml";

TEST(ManyAtOnce, WhatIsBeyondTheLimitMissesAndAllElseIsAsWithoutOne) {
  const std::shared_ptr<const Subspace> trained = TrainRig(kColumn, QuickTraining());
  ASSERT_NE(trained, nullptr);
  // All of its controls at once are as right as each alone
  EXPECT_TRUE(std::isinf(trained->activity_limit));
  const auto reach =
      std::ranges::count_if(trained->ranges, [](const TrainedRange& r) { return r.reach > 0; });
  EXPECT_GT(reach, 3) << "what moves points has a reach";
  const auto limited = std::make_shared<Subspace>(*trained);
  limited->activity_limit = 0.5;
  RigRun free(kColumn, {.subspace = trained}), run(kColumn, {.subspace = limited});
  ASSERT_TRUE(free.ok() && run.ok()) << free.error << run.error;
  std::size_t same = 0, blends = 0, misses = 0;
  for (int step = 0; step <= 200; ++step) {
    std::vector<double> values;  // all controls from rest to an end
    for (const Control& control : run.rig.controls) values.push_back(0.005 * step * control.max);
    for (RigRun* one : {&free, &run}) one->Pose(values);
    const RunFrame a = free.Evaluate(), b = run.Evaluate();
    ASSERT_TRUE(a.hit) << step;
    if (b.hit) {
      EXPECT_TRUE(SameBytes(a.points, b.points));
      EXPECT_EQ(blends + misses, 0u) << "nearer to rest than what misses: " << step;
      ++same;
      continue;
    }
    EXPECT_EQ(b.reason, MissReason::kManyAtOnce);
    EXPECT_EQ(b.text, "more is far from rest at once than in poses that frames are like");
    (b.full_weight < 1 ? blends : misses) += 1;
  }
  EXPECT_GT(same, 50u);
  EXPECT_GT(blends, 0u) << "it comes in over a ramp";
  EXPECT_GT(misses, 20u);
}

struct Counted {
  std::size_t hits = 0, wrong = 0;
};
// Every control at one of its ends.
Counted AtEnds(const std::string& rig, const std::shared_ptr<const Subspace>& subspace) {
  Counted counted;
  RigRun exact(rig), fast(rig, {.subspace = subspace});
  EXPECT_TRUE(exact.ok() && fast.ok()) << exact.error << fast.error;
  if (!exact.ok() || !fast.ok()) return counted;
  std::mt19937 random(7);
  for (int pose = 0; pose < 40; ++pose) {
    std::vector<double> values;
    for (const Control& control : exact.rig.controls)
      values.push_back(random() % 2 == 0 ? control.min : control.max);
    for (RigRun* run : {&exact, &fast}) run->Pose(values);
    const RunFrame a = exact.Evaluate(), b = fast.Evaluate();
    counted.hits += b.hit;
    counted.wrong += LargestDistance(a.points, b.points) > subspace->tolerance;
  }
  return counted;
}

TEST(ManyAtOnce, AFaceWithAllControlsAtTheirEndsIsRightOrMisses) {
  const std::string rig = KPSA_SCENES_DIR "/face/face.yaml";
  const TemporaryFolder folder;
  const ProcessResult run = RunKpsa({"train", rig, "--samples", "800", "-o", folder / "face.kpsa"}, 600);
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(run.out.find("poses with many controls far out are wrong unnoticed"), std::string::npos)
      << run.out;
  const ProcessResult told = RunKpsa({"inspect", folder / "face.kpsa"}, 60);
  EXPECT_NE(told.out.find("most at once"), std::string::npos) << told.out;
  const Result<Subspace> read = ReadSubspace(folder / "face.kpsa");
  ASSERT_TRUE(read.ok()) << read.status().ToString();
  ASSERT_TRUE(std::isfinite(read->activity_limit));
  auto unlimited = std::make_shared<Subspace>(*read);
  unlimited->activity_limit = kInfinity;
  const Counted without = AtEnds(rig, unlimited), limited = AtEnds(rig, std::make_shared<Subspace>(*read));
  EXPECT_GT(without.wrong, 4u) << "else it shows nothing";
  EXPECT_EQ(limited.wrong, 0u);
}

}  // namespace
}  // namespace kpsa::engine
