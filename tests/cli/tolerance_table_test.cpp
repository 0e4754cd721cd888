// What kpsa train and kpsa bench say of other tolerances, and of stacks that are too cheap to accelerate.
#include <filesystem>
#include <nlohmann/json.hpp>

#include "tests/cli/hello_folder.h"
#include "tests/cli/process.h"

namespace kpsa::engine {
namespace {

using Json = nlohmann::json;

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
    trained_ = Run({"train", "hello.yaml", "--force", "--speedup", "0.9", "--json", "-q"});
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
