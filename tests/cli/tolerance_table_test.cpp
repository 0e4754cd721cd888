// What kpsa train and kpsa bench say of other tolerances, and of stacks that are too cheap to accelerate.
#include "cli/tolerance_table.h"

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "cli/stack_cost.h"
#include "kpsa/kpsa_node.h"
#include "tests/cli/hello_folder.h"
#include "tests/cli/process.h"

namespace kpsa::engine {
namespace {

using Json = nlohmann::json;

constexpr double kFull = 1, kHit = 0.1;  // ms

// A share of hits that grows with the tolerance, up to `most` at 4 mm.
ToleranceModel Growing(double most) {
  return [most](double tolerance) {
    ToleranceRow row;
    row.tolerance = tolerance;
    row.hits = most * std::min(1.0, tolerance / 4e-3);
    row.speedup = SpeedupWithMisses(kFull, kHit, row.hits);
    return row;
  };
}

const ToleranceWords kWords = {"poses", "more of them help", false};

TEST(ToleranceTable, ToleranceInForceAmongRoundOnes) {
  EXPECT_EQ(TolerancesAround(0.4e-3), (std::vector<double>{1e-4, 2e-4, 4e-4, 6e-4, 8e-4, 1.5e-3, 3e-3}));
  EXPECT_EQ(TolerancesAround(1.13e-3),
            (std::vector<double>{3e-4, 6e-4, 1.13e-3, 1.5e-3, 2.5e-3, 5e-3, 1e-2}));
  EXPECT_EQ(TolerancesAround(1.0), (std::vector<double>{0.25, 0.5, 1, 1.5, 2, 4, 8}));
  EXPECT_TRUE(TolerancesAround(0).empty() && TolerancesAround(kAnyError).empty());
  EXPECT_EQ(ToleranceText(MakeToleranceTable(0, 1, 10, Growing(1)), kWords), "");
}

TEST(ToleranceTable, MissesCostBoth) {
  EXPECT_DOUBLE_EQ(SpeedupWithMisses(1, 0.1, 1), 10);
  EXPECT_DOUBLE_EQ(SpeedupWithMisses(1, 0.1, 0.5), 1 / 0.6);
  EXPECT_DOUBLE_EQ(SpeedupWithMisses(1, 0.1, 0), 1 / 1.1);
  EXPECT_EQ(SpeedupWithMisses(1, 0.1, 0, false), 1) << "nothing is measured";
  EXPECT_TRUE(std::isnan(SpeedupWithMisses(1, 0, 1)) && std::isnan(SpeedupWithMisses(0, 0, 1)));
}

TEST(ToleranceTable, ExpectsTheHitsOfPosesThatAreMadeOfClips) {
  std::vector<CalibrationPair> pairs;
  for (int i = 0; i < 400; ++i) {
    const bool near_clips = i % 2 == 0, bad = i % 40 == 0 || i % 8 == 1;  // 10 of 200, and 50
    pairs.push_back({bad ? 2.0 : 1.0, bad ? 1e-2 : 1e-4, 0, i < 300 ? 0 : 1, {}, 0, near_clips && i < 300});
  }
  const Calibration of_clips = Calibrate(pairs, 1e-3, 0.01, 1);
  EXPECT_EQ(of_clips.near_clips, 150u);
  EXPECT_DOUBLE_EQ(ExpectedHitRate(of_clips), 1 - 8.0 / 150);
  for (CalibrationPair& pair : pairs) pair.near_clips = false;
  const Calibration without = Calibrate(pairs, 1e-3, 0.01, 1);
  EXPECT_EQ(without.threshold.tau, of_clips.threshold.tau) << "the promise is of all";
  EXPECT_NEAR(ExpectedHitRate(without), 1 - (8 + 37.5) / 300, 2e-3) << "of the sampled ones";
}

TEST(ToleranceTable, SaysWhichToleranceGainsALot) {
  const ToleranceTable table = MakeToleranceTable(1e-3, 4e-3, 0, Growing(0.98));
  ASSERT_EQ(table.rows.size(), 7u);
  EXPECT_EQ(table.rows[table.in_force].tolerance, 1e-3);
  EXPECT_EQ(ToleranceAdvice(table, kWords),
            "at 4 mm (accelerate: tolerance) 98 % of poses would hit: 8.3x instead of 1.2x");
  const std::string text = ToleranceText(table, kWords);
  EXPECT_NE(text.find("     1 mm          24.5 %                 1.2x  in force\n"), std::string::npos)
      << text;
  EXPECT_EQ(text.find("--speedup"), std::string::npos) << text;
}

TEST(ToleranceTable, SaysNothingWhereEnoughHitOrNothingGains) {
  EXPECT_EQ(ToleranceAdvice(MakeToleranceTable(4e-3, 4e-3, 0, Growing(1)), kWords), "");
  EXPECT_EQ(ToleranceAdvice(MakeToleranceTable(4e-3, 4e-3, 0, Growing(0.6)), kWords), "");
  // What hits is no faster
  const auto slow = [](double tolerance) {
    ToleranceRow row = Growing(1)(tolerance);
    row.speedup = SpeedupWithMisses(kFull, 2 * kFull, row.hits);
    return row;
  };
  EXPECT_EQ(ToleranceAdvice(MakeToleranceTable(1e-3, 4e-3, 0, slow), kWords), "");
}

TEST(ToleranceTable, SaysWhereNoToleranceHelps) {
  EXPECT_EQ(ToleranceAdvice(MakeToleranceTable(1e-3, 4e-3, 0, Growing(0.4)), kWords),
            "fewer than half of the poses hit at any tolerance here: more of them help");
}

TEST(ToleranceTable, FindsTheSmallestToleranceForASpeedup) {
  const auto reach = [](double wanted, double most) {
    return *MakeToleranceTable(1e-3, 4e-3, wanted, Growing(most)).reached;
  };
  const ReachedSpeedup two = reach(2, 1);  // from 60 % on: 2.4 mm
  EXPECT_TRUE(two.reached);
  EXPECT_DOUBLE_EQ(two.row.tolerance, 2.4e-3);
  EXPECT_DOUBLE_EQ(two.row.hits, 0.6);
  EXPECT_DOUBLE_EQ(reach(2.01, 1).row.tolerance, 2.6e-3);
  EXPECT_DOUBLE_EQ(reach(0.95, 1).row.tolerance, 1.9e-4) << "also below the one in force";
  const ReachedSpeedup eleven = reach(11, 1);
  EXPECT_FALSE(eleven.reached);
  EXPECT_DOUBLE_EQ(eleven.row.tolerance, 4e-3);
  EXPECT_DOUBLE_EQ(eleven.row.speedup, 10);

  const auto text = [](double wanted) {
    return ToleranceText(MakeToleranceTable(1e-3, 4e-3, wanted, Growing(1)), kWords);
  };
  EXPECT_NE(text(2).find("--speedup 2: 2.4 mm, where 60.0 % of poses hit (2.0x); set `tolerance: 2.4 mm`"),
            std::string::npos)
      << text(2);
  EXPECT_NE(text(11).find("--speedup 11: no tolerance reaches it; the most is 10.0x, from 4 mm on"),
            std::string::npos)
      << text(11);
  // Where the small ones allow no hit and are as fast as nothing, those next to them are slower
  const auto from_one = [](double tolerance) {
    ToleranceRow row = Growing(1)(tolerance);
    row.hits = std::max(0.0, row.hits - 0.25);
    row.speedup = SpeedupWithMisses(kFull, kHit, row.hits, tolerance >= 1e-3);
    return row;
  };
  EXPECT_DOUBLE_EQ(MakeToleranceTable(1e-3, 4e-3, 0.95, from_one).reached->row.tolerance, 1e-6);
  EXPECT_DOUBLE_EQ(MakeToleranceTable(1e-3, 4e-3, 1.1, from_one).reached->row.tolerance, 1.8e-3);
  // Nothing was timed
  const auto untimed = [](double tolerance) { return ToleranceRow{tolerance, 1}; };
  const ToleranceTable table = MakeToleranceTable(1e-3, 4e-3, 2, untimed);
  EXPECT_NE(ToleranceText(table, kWords).find("nothing was timed"), std::string::npos);
  EXPECT_TRUE(ToleranceJson<Json>(table, kWords)["wanted_speedup"]["speedup"].is_null());
}

TEST(StackCost, LittleIsLittleInTimeOrInShare) {
  EXPECT_TRUE((FrameCost{10e3, 8e3, 5.6e3}.little()));
  EXPECT_NEAR((FrameCost{10e3, 8e3, 5.6e3}.saving()), 2.4e3, 1e-9);
  EXPECT_EQ((FrameCost{10e3, 4e3, 6e3}.saving()), 0);
  EXPECT_EQ((FrameCost{10e3, 4e3, 6e3}.bound()), 1);
  EXPECT_FALSE((FrameCost{100e3, 90e3, 6e3}.little()));
  EXPECT_TRUE((FrameCost{1e6, 100e3, 6e3}.little())) << "1.1x";
  StackCost cost;
  EXPECT_FALSE(cost.worth_it());
  cost.timed = {100e3, 90e3, 6e3};
  EXPECT_TRUE(cost.worth_it()) << "as of a plugin that says nothing of what it costs";
}

// hello, trained.
class Tolerances : public ::testing::Test {
 protected:
  static Json Run(const std::vector<std::string>& arguments) {
    const ProcessResult run = RunKpsa(arguments, 60, folder_->path());
    EXPECT_EQ(run.exit_code, 0) << run.err;
    return run.exit_code == 0 ? Json::parse(run.out) : Json();
  }
  static void SetUpTestSuite() {
    folder_ = std::make_unique<HelloFolder>();
    trained_ = Run({"train", "hello.yaml", "--speedup", "0.9", "--json", "-q"});
  }
  static void TearDownTestSuite() { folder_.reset(); }
  static inline std::unique_ptr<HelloFolder> folder_;
  static inline Json trained_;
};

TEST_F(Tolerances, OfTrainingAreThoseOfItsPosesAndTimes) {
  const Json& table = trained_["tolerances"];
  ASSERT_EQ(table["rows"].size(), 7u);
  const double full = trained_["predicted"]["full_ms"], accelerated = trained_["predicted"]["accelerated_ms"];
  double hits = 0;
  std::size_t in_force = 0;
  for (const Json& row : table["rows"]) {
    EXPECT_GE(row["hit_rate"], hits) << "more hit at a larger tolerance";
    hits = row["hit_rate"];
    if (hits > 0 || row["speedup"] != 1) {  // where the tolerance allows none, nothing is measured
      EXPECT_NEAR(row["speedup"], full / (accelerated + (1 - hits) * full), 1e-9);
    }
    if (!row["in_force"].get<bool>()) continue;
    ++in_force;
    EXPECT_EQ(row["tolerance"], 5e-4);
    EXPECT_EQ(row["hit_rate"], trained_["calibration"]["hit_rate"]);
    EXPECT_EQ(row["speedup"], trained_["predicted"]["speedup"]);
  }
  EXPECT_EQ(in_force, 1u);
  EXPECT_LT(table["rows"][0]["hit_rate"], hits);
  const Json& wanted = table["wanted_speedup"];
  EXPECT_EQ(wanted["wanted"], 0.9);
  EXPECT_EQ(wanted["reached"], wanted["speedup"].get<double>() >= 0.9);
}

// A table of the rig's bench against the benches at its tolerances.
TEST_F(Tolerances, OfTheBenchAreWhatItMeasuresThere) {
  folder_->Write("two.yaml",
                 "kpsa: 1\nreferences:\n  a: {file: hello.yaml}\n"
                 "  b: {file: hello.yaml, translate: [1, 0, 0], start: 20}\n");
  for (const std::string rig : {"hello.yaml", "two.yaml"}) {
    const Json bench = Run({"bench", rig, "--runs", "1", "--json", "-q"});
    std::size_t between = 0;  // rows where some frames hit and some do not
    ASSERT_EQ(bench["tolerances"]["rows"].size(), 7u);
    for (const Json& row : bench["tolerances"]["rows"]) {
      const std::string tolerance = fmt::format("{}", row["tolerance"].get<double>());
      const Json there = Run({"bench", rig, "--runs", "1", "--json", "-q", "--tolerance", tolerance});
      EXPECT_EQ(row["hit_rate"], there["hit_rate"]) << rig << " " << tolerance;
      if (const Json& worst = there["promise"]["worst_accepted"]; worst.is_null()) {
        EXPECT_FALSE(row.contains("worst_accepted")) << rig << " " << tolerance;
      } else {
        EXPECT_NEAR(row["worst_accepted"], worst["tolerances"], 1e-3) << rig << " " << tolerance;
      }
      between += row["hit_rate"] > 0 && row["hit_rate"] < 1;
      EXPECT_GT(row["speedup"], 0);
    }
    EXPECT_GT(between, 0u) << bench["tolerances"];
  }
}

TEST_F(Tolerances, AreTimedWhereNoFrameHits) {
  const Json bench = Run(
      {"bench", "hello.yaml", "--runs", "1", "--json", "-q", "--tolerance", "0.01mm", "--speedup", "0.5"});
  EXPECT_EQ(bench["hit_rate"], 0);
  const Json& table = bench["tolerances"];
  const double full = bench["full"]["ms_per_frame"];
  for (const Json& row : table["rows"]) {
    EXPECT_GT(row["speedup"], 0);
    EXPECT_LE(row["speedup"], 1 / (1 - row["hit_rate"].get<double>())) << "full: " << full;
  }
  EXPECT_TRUE(table["wanted_speedup"].contains("speedup")) << table;
  // Where every frame is accepted, or none ever
  for (const char* tolerance : {"any", "0"}) {
    EXPECT_TRUE(Run({"bench", "hello.yaml", "--runs", "1", "--json", "-q", "--tolerance",
                     tolerance})["tolerances"]["rows"]
                    .empty());
  }
}

TEST_F(Tolerances, SpeedupIsANumberAboveZero) {
  for (const char* command : {"train", "bench"}) {
    for (const char* speedup : {"fast", "0", "-2", "nan"}) {
      const ProcessResult run = RunKpsa({command, "hello.yaml", "--speedup", speedup}, 60, folder_->path());
      EXPECT_EQ(run.exit_code, 2) << command << speedup;
      EXPECT_NE(run.err.find("--speedup"), std::string::npos) << run.err;
    }
  }
}

// hello.glb with the last vertices of its mesh, and a triangle of them: so few that they cost little under
// sanitizers, too.
std::string FewPoints(std::size_t count) {
  GlbParts glb(HelloFolder::Glb());
  const Json primitive = glb.json["meshes"][0]["primitives"][0];
  for (const auto& [name, number] : primitive["attributes"].items()) {
    Json& accessor = glb.json["accessors"][number.get<std::size_t>()];
    const std::size_t left_out = accessor["count"].get<std::size_t>() - count;
    accessor["byteOffset"] = left_out * (name == "JOINTS_0" ? 4 : name == "WEIGHTS_0" ? 16 : 12);
    accessor["count"] = count;
  }
  glb.json["accessors"][primitive["indices"].get<std::size_t>()]["count"] = 3;
  return glb.Bytes();
}

TEST(TrainNothing, AStackThatCostsLittleIsTrainedByForceOnly) {
  const HelloFolder folder;
  folder.Write("hello.glb", FewPoints(200));
  folder.Edit("stack: [skin, cage, mush]", "stack: [skin]");
  folder.Edit("points: [column@mush]", "points: [column@skin]");
  folder.Edit("  - squeeze.outValue -> cage.points[0,2,0].x\n  - squeeze.outValue -> cage.points[0,2,1].x\n",
              "");
  folder.Edit("connections:\n", "");
  folder.Edit("  cage: {type: lattice, divisions: [2, 5, 2], members: all}\n", "");
  folder.Edit("  mush: {type: deltaMush, iterations: 10}\n", "");
  folder.Edit("variants:\n  light: {mush.envelope: 0}\n", "");
  const auto train = [&](std::vector<std::string> more) {
    std::vector<std::string> arguments = {"train", "hello.yaml",    "-q", "--samples",
                                          "60",    "--calibration", "40"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return RunKpsa(arguments, 60, folder.path());
  };
  const ProcessResult refused = train({});
  EXPECT_EQ(refused.exit_code, 1) << refused.err;
  EXPECT_TRUE(refused.out.starts_with("hello.yaml: a frame of this stack costs ")) << refused.out;
  for (const char* words : {"could be saved: not worth it\n", "of which column_skinCluster ", "graph ",
                            "reconstruct 200 points takes 5.4 us at least", "--force"})
    EXPECT_NE(refused.out.find(words), std::string::npos) << refused.out;
  const ProcessResult json = train({"--json"});
  EXPECT_EQ(json.exit_code, 1);
  const Json document = Json::parse(json.out);
  EXPECT_TRUE(document["subspace"].is_null());
  EXPECT_EQ(document["not_worth_it"]["points"], 200);
  EXPECT_LT(document["not_worth_it"]["stated"]["saving_ms"], 0.02);
  EXPECT_EQ(document["not_worth_it"]["deformers"][0]["name"], "column_skinCluster");
  EXPECT_FALSE(std::filesystem::exists(folder / "hello.kpsa"));

  const ProcessResult forced = train({"--force"});
  EXPECT_EQ(forced.exit_code, 0) << forced.err;
  EXPECT_TRUE(std::filesystem::exists(folder / "hello.kpsa"));
  EXPECT_EQ(train({}).exit_code, 2) << "an existing subspace";
}

}  // namespace
}  // namespace kpsa::engine
