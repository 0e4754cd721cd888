// The table of results: what bench, report and scenes/results.sh make of several subspaces of one rig.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <iostream>
#include <nlohmann/json.hpp>

#include "tests/cli/process.h"
#include "tests/support/temporary_folder.h"

namespace kpsa::engine {
namespace {

using Json = nlohmann::json;

std::size_t Count(const std::string& text, const std::string& what) {
  std::size_t count = 0;
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++count;
  return count;
}

// scenes/results.sh with the smallest rig in the place of the characters.
TEST(Results, TheScriptWritesTheTablesAndPictures) {
  const TemporaryFolder folder;
  const ProcessResult run =
      RunShell("sh '" KPSA_SOURCE_DIR "/scenes/results.sh' --try '" KPSA_PROGRAM "' '" + folder.path() + "'",
               300, folder.path());
  ASSERT_EQ(run.exit_code, 0) << run.out << run.err;
  const std::string text = TemporaryFolder::Read(folder / "results.md");
  for (const char* words : {"10 key points", "paper mode, all frames accepted", "| default |", "| 1x |",
                            "| with reconstruction |", "| full cost within it |", "## Other clips",
                            "% deltaMush (1)", "## Heavy stacks"})
    EXPECT_NE(text.find(words), std::string::npos) << words << "\n" << text;
  EXPECT_EQ(text.find("animal_heavy"), std::string::npos) << "was not measured";
  // Every picture is there, but for plots where nobody can draw them
  const bool no_plots = run.out.find("skipped: no plots") != std::string::npos;
  if (no_plots) std::cout << "skipped: plots, as there is no matplotlib\n";
  std::size_t pictures = 0;
  for (std::size_t at = text.find("](results/"); at != std::string::npos;
       at = text.find("](results/", at + 1)) {
    const std::string name = text.substr(at + 2, text.find(')', at) - at - 2);
    ++pictures;
    if (name.ends_with(".svg") && no_plots) continue;
    EXPECT_GT(TemporaryFolder::Read(folder / name).size(), 1000u) << name;
  }
  EXPECT_EQ(pictures, 3u);
  // Paper mode once, as both its sides have the same subspace, and the default
  const std::string plots = TemporaryFolder::Read(folder / "results/hello.svg");
  if (!no_plots) {
    EXPECT_EQ(Count(plots, ">with SoftCache: "), 2u);
    EXPECT_EQ(Count(plots, ">hello, wave: paper mode, 10 key points<"), 1u);
  }
  // The same frames as numbers
  ASSERT_EQ(RunKpsa({"report", folder / "out/hello.json", "--csv", folder / "frames.csv"}).exit_code, 0);
  const std::string csv = TemporaryFolder::Read(folder / "frames.csv");

  const Json bench = Json::parse(TemporaryFolder::Read(folder / "out/hello.json"));
  ASSERT_EQ(bench["beside"].size(), 2u);
  const Json &accepted = bench, &cached = bench["beside"][0], &ours = bench["beside"][1];
  std::size_t rows = 1 + accepted["per_frame"].size() + cached["per_frame"].size() + ours["per_frame"].size();
  EXPECT_EQ(Count(csv, "\n"), rows);
  const Json &row = ours["per_frame"].back(), &errors = ours["frame_errors"];
  const std::string last =
      fmt::format("{},{},{},{},{},{},", row["clip"].get<std::string>(), row["frame"].get<int>(),
                  row["verdict"].get<std::string>(), row["full_weight"].get<double>(),
                  row["score"].get<double>(), row["rms"].get<double>());
  EXPECT_NE(csv.find(last), std::string::npos) << last << csv.substr(csv.size() - 300);
  EXPECT_TRUE(csv.ends_with(fmt::format(",{}\n", errors["total"].back().get<double>())));
  EXPECT_NE(csv.find("hello,\"paper mode, all frames accepted\",10 key points,any,"), std::string::npos);
  // No tables of what is no number
  const auto edited = [&](const char* pointer, const Json& value) {
    Json wrong = bench;
    wrong[Json::json_pointer(pointer)] = value;
    return RunKpsa({"report", folder.Write("wrong.json", wrong.dump())});
  };
  EXPECT_EQ(edited("/hit_rate", 1).exit_code, 0);
  EXPECT_EQ(edited("/error/rms", -1).exit_code, 0);
  for (const auto& [pointer, value] :
       std::vector<std::pair<const char*, Json>>{{"/points", -5},
                                                 {"/modes", 2.5},
                                                 {"/hit_rate", "0.9"},
                                                 {"/hit_rate", 7},
                                                 {"/blend_rate", 7},
                                                 {"/beside/0/cues", -1},
                                                 {"/speedup", true},
                                                 {"/tolerance", nullptr},
                                                 {"/accelerated/misses", -1},
                                                 {"/storage/bytes_per_point", "x"},
                                                 {"/frame_errors/rms/total", "x"},
                                                 {"/error/max", -2}}) {
    const ProcessResult refused = edited(pointer, value);
    EXPECT_EQ(refused.exit_code, 3) << pointer;
    EXPECT_NE(refused.err.find("wrong.json"), std::string::npos) << refused.err;
    EXPECT_EQ(refused.out, "") << pointer;
  }
  // Reports name cues by the mesh and the stage where they are measured
  const Json paper = Json::parse(RunKpsa({"inspect", folder / "out/hello-paper.kpsa", "--json"}).out);
  for (const Json& cue : paper["cues"]) EXPECT_EQ(cue["where"], "column@mush");
  EXPECT_EQ(accepted["cue_stages"], Json::array({"10 points of column@mush"}));
  EXPECT_EQ(accepted["mode"], "paper");
  EXPECT_EQ(ours["mode"], "map");
  EXPECT_EQ(accepted["cue_points"], 10);
  EXPECT_EQ(accepted["modes"], 5);
  EXPECT_EQ(accepted["hit_rate"], 1.0);
  EXPECT_LT(ours["error"]["rms"], accepted["error"]["rms"]);
  EXPECT_EQ(accepted["full"], cached["full"]) << "one full side for all";
  EXPECT_GT(ours["storage"]["bytes_per_point"], 0);
  for (const Json* side : {&accepted, &cached, &ours}) {
    const Json& e = (*side)["frame_errors"];
    const std::size_t frames = (*side)["frames"];
    ASSERT_EQ(e["total"].size(), frames);
    double sum = 0;
    for (std::size_t f = 0; f < frames; ++f) {
      const double projection = e["projection"][f], cueing = e["cueing"][f], storage = e["storage"][f],
                   total = e["total"][f], emitted = e["soft_cache"][f];
      // The map is stored in tiles: Pythagoras holds up to what these add (kpsa/training/error_split.h)
      EXPECT_NEAR(total * total, projection * projection + cueing * cueing,
                  2 * projection * storage + storage * storage + 1e-6 * total * total);
      const std::string verdict = (*side)["per_frame"][f]["verdict"];
      EXPECT_EQ(e["hit"][f].get<bool>(), verdict == "hit");
      EXPECT_EQ(e["miss"][f].get<bool>(), verdict == "miss");
      if (verdict == "miss") {
        EXPECT_EQ(emitted, 0.0);
      }
      if (e["hit"][f].get<bool>()) {
        EXPECT_EQ(emitted, total);
      } else {
        EXPECT_LT(emitted, total);
      }
      sum += emitted * emitted;
    }
    // The whole rig is accelerated: this is the error of the final points
    EXPECT_NEAR(std::sqrt(sum / static_cast<double>(frames)), (*side)["error"]["rms"].get<double>(),
                1e-3 * (*side)["error"]["rms"].get<double>() + 1e-9);
  }
}

}  // namespace
}  // namespace kpsa::engine
