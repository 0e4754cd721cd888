// What of a stack makes less than a tolerance in a clip, and what it costs: kpsa bench --idle.
#include "host/bench/idle.h"

#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "cli/common.h"
#include "tests/cli/hello_folder.h"
#include "tests/cli/process.h"

namespace kpsa::engine {
namespace {

// hello.yaml with a cage that nothing moves, and two clusters that move all points by 0.3 mm each where the
// column is bent most.
class Idle : public ::testing::Test {
 protected:
  Idle() {
    folder.Edit(
        "  mush: {type: deltaMush, iterations: 10}\n",
        "  mush: {type: deltaMush, iterations: 10}\n"
        "  still: {type: lattice, divisions: [2, 2, 2], members: all}\n"
        "  shift: {type: remapValue, input: upper.poseRotateZ, inputMin: 0, inputMax: -60, outputMin: 0, "
        "outputMax: 0.03}\n"
        "  handA: {type: transform, translateX: shift.outValue}\n"
        "  handB: {type: transform, translateX: shift.outValue}\n"
        "  moveA: {type: cluster, matrix: handA.worldMatrix}\n"
        "  moveB: {type: cluster, matrix: handB.worldMatrix}\n");
    folder.Edit("stack: [skin, cage, mush]", "stack: [skin, cage, still, moveA, moveB, mush]");
    flags.file = folder.rig();
  }
  IdleDeformers Measure(double tolerance) const {
    const Result<IdleDeformers> idle = MeasureIdle(OpenerOf(flags), {"wave"}, tolerance, kFullMs, {});
    EXPECT_TRUE(idle.ok()) << idle.status().ToString();
    return idle.ok() ? *idle : IdleDeformers();
  }

  HelloFolder folder;
  Flags flags;
  const std::map<std::string, double> kFullMs = {{"column_skinCluster", 1},
                                                 {"cage", 2},
                                                 {"squeeze", 0.25},
                                                 {"still", 4},
                                                 {"moveA", 8},
                                                 {"moveB", 8},
                                                 {"mush", 8},
                                                 {"upper", 0.75}};
};

TEST_F(Idle, WhatMovesNothingIsOffAtAnyTolerance) {
  const IdleDeformers idle = Measure(0);
  EXPECT_EQ(idle.Off(), std::vector<std::string>{"still"});
  EXPECT_EQ(idle.difference, 0);
  EXPECT_DOUBLE_EQ(idle.ms_per_frame, 4);
  EXPECT_DOUBLE_EQ(idle.share, 4.0 / 32);
  ASSERT_EQ(idle.deformers.size(), 6u);
  for (std::size_t d = 1; d < 6; ++d)
    EXPECT_LE(idle.deformers[d - 1].difference, idle.deformers[d].difference) << idle.deformers[d].name;
  for (const IdleDeformers::Deformer& each : idle.deformers) {
    if (each.type == "cluster") {
      EXPECT_NEAR(each.difference, 3e-4, 3e-5) << each.name;
    }
    if (each.type == "skinCluster") {
      EXPECT_GT(each.difference, 0.1);
    }
  }
}

// Each alone is within the tolerance, both are not.
TEST_F(Idle, DeformersThatAddUpAreNotOffTogether) {
  const IdleDeformers one = Measure(4.5e-4), both = Measure(8e-4);
  const auto clusters = [](const IdleDeformers& idle) {
    std::size_t count = 0;
    for (const std::string& name : idle.Off()) count += name.starts_with("move");
    return count;
  };
  EXPECT_EQ(clusters(one), 1u);
  EXPECT_LE(one.difference, 4.5e-4);
  EXPECT_EQ(clusters(both), 2u);
  EXPECT_GT(both.difference, 5e-4);
}

// What only they need is not evaluated either.
TEST_F(Idle, TheCostIsThatOfAllThatNobodyElseNeeds) {
  const IdleDeformers all = Measure(10);
  EXPECT_EQ(all.Off().size(), 6u);
  EXPECT_DOUBLE_EQ(all.share, 1);
}

TEST_F(Idle, BenchAndReportTell) {
  const auto run = [&](std::vector<std::string> arguments) {
    const ProcessResult result = RunKpsa(arguments);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return result.out;
  };
  run({"train", folder.rig(), "--force", "--samples", "100", "--calibration", "60", "-q"});
  const std::string text = run({"bench", folder.rig(), "--runs", "1", "-q", "--idle"});
  EXPECT_NE(text.find("% of the full cost makes less than 0.5 mm on 48 frames"), std::string::npos) << text;
  EXPECT_NE(text.find("still"), std::string::npos) << text;
  const std::string json = run({"bench", folder.rig(), "--runs", "1", "-q", "--idle", "--json"});
  const nlohmann::json bench = nlohmann::json::parse(json);
  EXPECT_EQ(bench["idle"]["deformers"].size(), 6u);
  EXPECT_EQ(bench["idle"]["deformers"][0]["name"], "still");
  EXPECT_TRUE(bench["idle"]["deformers"][0]["off"]);
  const std::string table = run({"report", folder.Write("b.json", json)});
  EXPECT_NE(table.find("| full cost within it |"), std::string::npos) << table;
  EXPECT_NE(table.find("| still"), std::string::npos) << table;
  // Where it is not asked for, nothing is said
  const nlohmann::json silent =
      nlohmann::json::parse(run({"bench", folder.rig(), "--runs", "1", "-q", "--json"}));
  EXPECT_TRUE(silent["idle"].is_null());
}

}  // namespace
}  // namespace kpsa::engine
