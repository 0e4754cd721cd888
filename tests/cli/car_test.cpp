// The bundled car, through the program: both rigs are sound, and their stacks evaluate.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "tests/cli/process.h"
#include "tests/cli/rig_run.h"
#include "tests/support/temporary_folder.h"

namespace kpsa::engine {
namespace {

const std::string kCar = KPSA_SCENES_DIR "/car/car.yaml", kCarHeavy = KPSA_SCENES_DIR "/car/car_heavy.yaml";

TEST(Car, BothRigsValidateWithoutWarnings) {
  for (const std::string& rig : {kCar, kCarHeavy}) {
    const ProcessResult run = RunKpsa({"validate", rig, "--json"});
    EXPECT_EQ(run.exit_code, 0) << run.err;
    EXPECT_EQ(run.err, "");
    const nlohmann::json facts = nlohmann::json::parse(run.out, nullptr, false);
    ASSERT_FALSE(facts.is_discarded());
    EXPECT_EQ(facts["valid"], true) << run.out;
    EXPECT_EQ(facts["notes"].size(), 0u) << run.out;
  }
}

TEST(Car, TheTestClipEvaluates) {
  const TemporaryFolder folder;
  for (const std::string& rig : {kCar, kCarHeavy}) {
    const ProcessResult run = RunKpsa(
        {"eval", rig, "--clip", "talk", "--frames", "0:40:20", "-o", folder / "a.npz", "--force", "--json"});
    EXPECT_EQ(run.exit_code, 0) << run.err;
  }
}

// Controls of every kind of deformer reach points.
TEST(Car, EveryControlMovesPoints) {
  for (const std::string& rig : {kCar, kCarHeavy}) {
    RigRun run(rig);
    ASSERT_TRUE(run.ok()) << run.error;
    const RunFrame rest = run.Evaluate();
    std::vector<double> pose;
    for (const Control& control : run.rig.controls) pose.push_back(control.value);
    for (std::size_t c = 0; c < pose.size(); ++c) {
      std::vector<double> moved = pose;
      moved[c] = run.rig.controls[c].max;
      run.Pose(moved);
      const RunFrame frame = run.Evaluate();
      EXPECT_GT(LargestDistance(rest.points, frame.points), 0.002) << rig << " " << run.rig.controls[c].name;
      for (float v : frame.points) ASSERT_TRUE(std::isfinite(v)) << run.rig.controls[c].name;
    }
  }
}

}  // namespace
}  // namespace kpsa::engine
