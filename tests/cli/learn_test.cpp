// kpsa learn: what missed becomes training, and what is promised is promised anew.
#include <nlohmann/json.hpp>

#include "kpsa/training_record.h"
#include "tests/cli/hello_folder.h"
#include "tests/cli/process.h"

namespace kpsa::engine {
namespace {

using nlohmann::json;

// hello with a clip that sways a joint which never moves in training.
class Learning : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_.AddSway();
    const ProcessResult trained = Run({"train", "hello.yaml", "--force", "--keep-modes", "-q"});
    ASSERT_EQ(trained.exit_code, 0) << trained.err;
  }
  ProcessResult Run(const std::vector<std::string>& arguments) const {
    return RunKpsa(arguments, 120, folder_.path());
  }
  json Learn(std::vector<std::string> more) const {
    more.insert(more.begin(), {"learn", "hello.yaml", "--json", "-q"});
    const ProcessResult run = Run(more);
    EXPECT_EQ(run.exit_code, 0) << run.err;
    return run.exit_code == 0 ? json::parse(run.out) : json();
  }
  std::string Bytes(const std::string& name) const { return TemporaryFolder::Read(folder_ / name); }
  HelloFolder folder_;
};

TEST_F(Learning, WhatMissedHitsAfterwardsAndStaysLearnt) {
  const json learnt = Learn({"--clip", "sway", "-o", "new.kpsa"});
  ASSERT_EQ(learnt["clips"].size(), 1u);
  const json &before = learnt["clips"][0]["before"], &after = learnt["clips"][0]["after"];
  const auto frames = [](const json& of) {
    return of["hits"].get<int>() + of["blends"].get<int>() + of["misses"].get<int>();
  };
  EXPECT_GT(before["misses"].get<int>(), frames(before) / 2);
  EXPECT_LE(10 * (after["misses"].get<int>() + after["blends"].get<int>()), frames(after));
  EXPECT_EQ(learnt["learnt"], frames(before));
  // The points are right, too
  ASSERT_EQ(Run({"eval", "hello.yaml", "--clip", "sway", "-o", "full.npz", "-q"}).exit_code, 0);
  ASSERT_EQ(
      Run({"eval", "hello.yaml", "--clip", "sway", "--kpsa", "new.kpsa", "-o", "fast.npz", "-q"}).exit_code,
      0);
  const json errors =
      json::parse(Run({"compare", "full.npz", "fast.npz", "--tolerance", "1mm", "--json"}).out);
  EXPECT_LE(errors["max"].get<double>(), 1e-3);
  EXPECT_GT(errors["max"].get<double>(), 0);

  const Result<Subspace> subspace = ReadSubspace(folder_ / "new.kpsa", KeptModes::kRead);
  ASSERT_TRUE(subspace.ok());
  EXPECT_GT(subspace->kept_modes.values.size(), 0u) << "as before";
  const TrainingRecord record = ParseTraining(subspace->training);
  ASSERT_EQ(record.learnt.size(), 1u);
  EXPECT_EQ(record.learnt[0].first, "sway");
  EXPECT_EQ(record.learnt[0].second.size(), learnt["learnt"].get<std::size_t>());
  EXPECT_TRUE(record.clips.empty()) << "the rig's training clips";
  EXPECT_EQ(record.asked.samples, 400u);
  EXPECT_EQ(record.calibration_poses, 1600u) << "new ones of each kind";
  const ProcessResult bench =
      Run({"bench", "hello.yaml", "--kpsa", "new.kpsa", "--clip", "sway", "--runs", "1"});
  EXPECT_NE(bench.err.find(" frames of sway were learnt: the clip says little about new ones"),
            std::string::npos)
      << bench.err;
  // Again there is nothing new; the file of its own is the same
  const json again = Learn({"--kpsa", "new.kpsa", "--clip", "sway", "-o", "again.kpsa"});
  EXPECT_EQ(again["learnt"], 0);
  EXPECT_EQ(Bytes("again.kpsa"), Bytes("new.kpsa"));
}

TEST_F(Learning, GivesTheSameBytesForTheSameClips) {
  const json first = Learn({"--clips", "sway,wave", "-o", "a.kpsa"}),
             second = Learn({"--clips", "sway,wave", "-o", "b.kpsa", "--threads", "1"});
  ASSERT_EQ(first["clips"].size(), 2u);
  EXPECT_EQ(first["clips"], second["clips"]);
  EXPECT_GT(Bytes("a.kpsa").size(), 10'000u);
  EXPECT_EQ(Bytes("a.kpsa"), Bytes("b.kpsa"));
}

TEST_F(Learning, AsksBeforeItReplacesAndSaysWhatIsMissing) {
  const std::string before = Bytes("hello.kpsa");
  for (const auto& [arguments, words] : std::vector<std::pair<std::vector<std::string>, std::string>>{
           {{"--clip", "sway"}, "--force"},
           {{"--clip", "swya", "--force"}, "did you mean \"sway\""},
           {{"--force"}, "--clip or --clips"},
           {{"--clip", "sway", "--clips", "wave", "--force"}, "--clip or --clips"},
           {{"--clips", ",", "--force"}, "--clips"},
           {{"--clip", "sway", "--rest", "--force"}, "--rest"},
           {{"--clip", "sway", "-o", "x.npz"}, ".kpsa"},
           {{"--clip", "sway", "-o", "-"}, "-o -"}}) {
    std::vector<std::string> all = {"learn", "hello.yaml"};
    all.insert(all.end(), arguments.begin(), arguments.end());
    const ProcessResult run = Run(all);
    EXPECT_EQ(run.exit_code, 2) << run.err;
    EXPECT_NE(run.err.find(words), std::string::npos) << run.err;
  }
  const ProcessResult missing =
      Run({"learn", "hello.yaml", "--kpsa", "none.kpsa", "--clip", "sway", "-o", "n.kpsa"});
  EXPECT_EQ(missing.exit_code, 3);
  EXPECT_NE(missing.err.find("none.kpsa"), std::string::npos) << missing.err;
  EXPECT_EQ(Bytes("hello.kpsa"), before);
}

}  // namespace
}  // namespace kpsa::engine
