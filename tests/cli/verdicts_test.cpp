// Every frame is a hit, a blend or a miss with its reason, whichever command tells of it. On the bundled
// hello rig with thresholds that make all three happen in its clip.
#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "picture/rig_picture.h"
#include "tests/cli/hello_folder.h"
#include "tests/cli/process.h"
#include "tests/cli/rig_run.h"

namespace kpsa::engine {
namespace {

using Json = nlohmann::json;

class FrameVerdicts : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TemporaryFolder;
    const std::shared_ptr<const Subspace> trained = TrainRig(kHello, QuickTraining());
    ASSERT_NE(trained, nullptr);
    ASSERT_TRUE(WriteSubspace(*trained, *folder_ / "trained.kpsa").ok());
    // Thresholds among the clip's scores
    std::vector<double> scores;
    const Json told = Evaluate("trained.kpsa", {"--tolerance", "any"});
    for (const Json& frame : told["per_frame"]) {
      EXPECT_EQ(frame["verdict"], "hit") << frame.dump();
      scores.push_back(frame["score"]);
    }
    ASSERT_GT(scores.size(), 40u);
    std::sort(scores.begin(), scores.end());
    const auto between = [&](std::size_t i) { return 0.5 * (scores[i] + scores[i + 1]); };
    tau_lo_ = between(scores.size() / 2), tau_ = between(3 * scores.size() / 4);
    ASSERT_TRUE(WriteSubspace(*WithThreshold(*trained, tau_lo_, tau_), *folder_ / "mixed.kpsa").ok());
  }
  static void TearDownTestSuite() { delete folder_; }

  static std::string Run(const std::vector<std::string>& arguments, std::string* err = nullptr) {
    const ProcessResult run = RunKpsa(arguments, 60, folder_->path());
    std::string line;
    for (const std::string& word : arguments) line += word + " ";
    EXPECT_EQ(run.exit_code, 0) << line << "\n" << run.err;
    if (err != nullptr) *err = run.err;
    return run.out;
  }
  // What eval --json says of the nodes.
  static Json Evaluate(const std::string& subspace, const std::vector<std::string>& more = {}) {
    std::vector<std::string> arguments = {"eval",  kHello,    "--kpsa", subspace, "-o",
                                          "a.npz", "--force", "--json", "-q"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const Json document = Json::parse(Run(arguments), nullptr, false);
    EXPECT_FALSE(document.is_discarded());
    return document.value("accelerated", Json::object());
  }

  static inline TemporaryFolder* folder_ = nullptr;
  static inline double tau_lo_ = 0, tau_ = 0;
};

TEST_F(FrameVerdicts, EvalTellsOfEveryFrame) {
  const Json told = Evaluate("mixed.kpsa");
  std::map<std::string, int> counts;
  for (const Json& frame : told["per_frame"]) {
    SCOPED_TRACE(frame.dump());
    const std::string verdict = frame["verdict"];
    ++counts[verdict];
    const double score = frame["score"], weight = frame["full_weight"];
    EXPECT_EQ(verdict, score <= tau_lo_ ? "hit" : score < tau_ ? "blend" : "miss");
    EXPECT_NEAR(weight, FullWeight(score, {tau_, tau_lo_ / tau_}), 1e-9);
    EXPECT_EQ(frame["subspace"], "column");
    EXPECT_TRUE(verdict == "hit"
                    ? frame["reason"] == "hit"
                    : std::string(frame["reason"]).find("the trained poses") != std::string::npos);
  }
  EXPECT_EQ(told["hits"], counts["hit"]);
  EXPECT_EQ(told["blends"], counts["blend"]);
  EXPECT_EQ(told["misses"], counts["miss"]);
  EXPECT_GE(counts["hit"], 5);
  EXPECT_GE(counts["blend"], 5);
  EXPECT_GE(counts["miss"], 5);
  std::string err;
  Run({"eval", kHello, "--kpsa", "mixed.kpsa", "-o", "b.npz"}, &err);
  EXPECT_NE(err.find(fmt::format("{} hits, {} blends, {} misses of 49 frames; worst score", counts["hit"],
                                 counts["blend"], counts["miss"])),
            std::string::npos)
      << err;
  EXPECT_NE(err.find("most frequent reason ("), std::string::npos) << err;
  EXPECT_NE(err.find(" the trained poses (most at "), std::string::npos) << err;
}

TEST_F(FrameVerdicts, BenchAndGetSayTheSame) {
  const Json told = Evaluate("mixed.kpsa")["per_frame"];
  const Json bench =
      Json::parse(Run({"bench", kHello, "--kpsa", "mixed.kpsa", "--runs", "1", "--json", "-q"}));
  ASSERT_EQ(bench["per_frame"].size(), told.size());
  std::size_t blends = 0;
  for (std::size_t f = 0; f < told.size(); ++f) {
    for (const char* key : {"frame", "verdict", "full_weight", "score", "reason", "subspace"})
      EXPECT_EQ(bench["per_frame"][f][key], told[f][key]) << key << " of " << f;
    blends += told[f]["verdict"] == "blend";
    EXPECT_EQ(told[f]["verdict"] == "miss", bench["per_frame"][f]["max"] == 0.0) << f;
  }
  EXPECT_DOUBLE_EQ(bench["blend_rate"], static_cast<double>(blends) / static_cast<double>(told.size()));

  // With the share of the full evaluation and the reason in the lines of the text
  std::istringstream lines(
      Run({"bench", kHello, "--kpsa", "mixed.kpsa", "--runs", "1", "--per-frame", "-q"}));
  std::map<std::string, std::size_t> listed;
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with("wave ")) continue;
    for (const char* verdict : {"hit", "blend", "miss"}) {
      if (line.find(fmt::format("  {} ", verdict)) == std::string::npos) continue;
      ++listed[verdict];
      EXPECT_EQ(line.find("the trained poses") != std::string::npos, verdict != std::string("hit"));
    }
  }
  EXPECT_EQ(listed["blend"], blends);
  EXPECT_EQ(listed["hit"] + listed["blend"] + listed["miss"], told.size());

  const Json got = Json::parse(Run({"get", kHello, "column_kpsa.missReason", "column_kpsa.fullWeight",
                                    "--kpsa", "mixed.kpsa", "--frames", "0:48", "--json"}));
  EXPECT_EQ(got["plugs"][0]["type"], "string");
  for (std::size_t f = 0; f < told.size(); ++f) {
    EXPECT_EQ(got["plugs"][0]["values"][f], told[f]["reason"]);
    EXPECT_EQ(got["plugs"][1]["values"][f], told[f]["full_weight"]);
  }
  const std::string csv =
      Run({"get", kHello, "column_kpsa.missReason", "--kpsa", "mixed.kpsa", "--frames", "0:2"});
  EXPECT_EQ(csv.substr(0, csv.find('\n')), "time,column_kpsa.missReason");
  EXPECT_NE(csv.find("0,hit\n"), std::string::npos) << csv;
}

TEST_F(FrameVerdicts, GetReadsTheAcceleratedPoints) {
  const std::vector<std::string> at = {"--times", "0.5", "--json"};
  const auto get = [&](const std::vector<std::string>& more) {
    std::vector<std::string> arguments = {"get", kHello, "column"};
    arguments.insert(arguments.end(), at.begin(), at.end());
    arguments.insert(arguments.end(), more.begin(), more.end());
    return Json::parse(Run(arguments))["plugs"][0]["values"][0];
  };
  const Json full = get({}), fast = get({"--kpsa", "trained.kpsa", "--tolerance", "any"}),
             exact = get({"--kpsa", "trained.kpsa", "--tolerance", "0"});
  EXPECT_EQ(full, exact);
  EXPECT_NE(full, fast);
  EXPECT_EQ(RunKpsa({"get", kHello, "column", "--tolerance", "1mm"}).exit_code, 2);
}

TEST_F(FrameVerdicts, ExplainTellsTheScoreAndTheGuard) {
  const Json told = Evaluate("mixed.kpsa")["per_frame"];
  for (const char* verdict : {"hit", "blend", "miss"}) {
    const auto frame =
        std::find_if(told.begin(), told.end(), [&](const Json& row) { return row["verdict"] == verdict; });
    ASSERT_NE(frame, told.end());
    const std::string number = (*frame)["frame"].dump();
    const Json story =
        Json::parse(Run({"explain", kHello, "--kpsa", "mixed.kpsa", "--frame", number, "--json"}));
    EXPECT_EQ(story["schema"], "kpsa.explain/1");
    ASSERT_EQ(story["decisions"].size(), 1u);
    const Json& decision = story["decisions"][0];
    for (const char* key : {"verdict", "full_weight", "score", "reason", "subspace"})
      EXPECT_EQ(decision[key], (*frame)[key]) << key;
    EXPECT_NEAR(decision["hit_up_to"].get<double>(), tau_lo_, 1e-6 * tau_lo_);
    EXPECT_NEAR(decision["blend_up_to"].get<double>(), tau_, 1e-6 * tau_);
    EXPECT_TRUE(decision["outside"].empty());
    const std::string text = Run({"explain", kHello, "--kpsa", "mixed.kpsa", "--frame", number});
    EXPECT_NE(text.find(fmt::format("column (mixed.kpsa): {}\n", verdict)), std::string::npos) << text;
    EXPECT_NE(text.find("; a hit up to "), std::string::npos) << text;
  }
  // A guard: the entry of the joint's matrix with its value and its range
  const std::vector<std::string> turned = {
      "explain", kHello, "--kpsa", "trained.kpsa", "--rest", "--set", "upper.rotateX=80", "--frame", "0"};
  const std::string text = Run(turned);
  EXPECT_NE(text.find("column (trained.kpsa): miss"), std::string::npos) << text;
  EXPECT_NE(text.find("reason      upper.matrix is outside its trained range"), std::string::npos) << text;
  std::vector<std::string> as_json = turned;
  as_json.push_back("--json");
  const Json outside = Json::parse(Run(as_json))["decisions"][0]["outside"];
  ASSERT_EQ(outside.size(), 1u);
  EXPECT_TRUE(std::string(outside[0]["plug"]).starts_with("upper.matrix/")) << outside.dump();
  EXPECT_TRUE(outside[0]["value"] < outside[0]["trained"][0] ||
              outside[0]["value"] > outside[0]["trained"][1]);

  EXPECT_EQ(RunKpsa({"explain", kHello}).exit_code, 2);
  EXPECT_EQ(RunKpsa({"explain", kHello, "--frame", "3"}).exit_code, 2);
  EXPECT_EQ(RunKpsa({"explain", kHello, "--kpsa", *folder_ / "mixed.kpsa"}).exit_code, 2);
}

// A miss is the full evaluation, and its picture says so: two misses of different thresholds draw the same
// picture, which differs from the hit's by its title where the points are the same.
TEST_F(FrameVerdicts, PicturesAreTitledByTheirVerdict) {
  EXPECT_EQ(PictureTitle({"", 0, 0.1, "hit"}), "accelerated");
  EXPECT_EQ(PictureTitle({"", 0.123, 1, ""}), "blend: 12 % full");
  EXPECT_EQ(PictureTitle({"", 1e-9, 1, ""}), "blend: 1 % full");
  EXPECT_EQ(PictureTitle({"", 1 - 1e-9, 1, ""}), "blend: 99 % full");
  EXPECT_EQ(PictureTitle({"", 1, kInfinity, ""}), "miss: fully evaluated");
  const auto render = [&](const std::string& subspace, const std::string& tolerance,
                          const std::string& name) {
    Run({"render", kHello, "--kpsa", subspace, "--tolerance", tolerance, "--frames", "0:0", "--size",
         "240x300", "--error-scale", "1m", "-o", name});
    return TemporaryFolder::Read(*folder_ / name);
  };
  const std::string miss = render("mixed.kpsa", "0", "miss.png");
  EXPECT_TRUE(miss == render("trained.kpsa", "0", "too.png"));
  EXPECT_FALSE(miss == render("mixed.kpsa", "any", "hit.png"));
}

// Of several nodes the worst counts, and is named.
TEST_F(FrameVerdicts, OfSeveralNodesTheWorstCounts) {
  const HelloFolder scene;
  scene.Write("two.yaml",
              "kpsa: 1\nfps: 24\nreferences:\n  a: {file: hello.yaml}\n  b: {file: hello.yaml}\n");
  scene.Write("hello.kpsa", TemporaryFolder::Read(*folder_ / "trained.kpsa"));
  const auto eval = [&](const std::string& set) {
    const ProcessResult run =
        RunKpsa({"eval", scene / "two.yaml", "--accelerate", "--tolerance", "1000", "--frames", "0:3",
                 "--set", set, "-o", scene / "a.npz", "--force", "--json"});
    EXPECT_EQ(run.exit_code, 0) << run.err;
    return Json::parse(run.out)["accelerated"];
  };
  EXPECT_EQ(eval("b:upper.rotateX=0")["hits"], 4);
  for (const std::string name : {"a", "b"}) {
    const Json told = eval(name + ":upper.rotateX=80");
    EXPECT_EQ(told["misses"], 4) << told.dump();
    EXPECT_EQ(told["per_frame"][2]["subspace"], name + ":column") << told.dump();
    EXPECT_EQ(
        told["most_frequent_reason"],
        fmt::format("most frequent reason (4 frames, first at frame 0): {0}:column: {0}:upper.matrix is "
                    "outside its trained range",
                    name));
  }
}

}  // namespace
}  // namespace kpsa::engine
