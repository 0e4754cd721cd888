// kpsa report RIG: what its page shows is what kpsa eval and kpsa bench give.
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "files/npz.h"
#include "tests/cli/hello_folder.h"
#include "tests/cli/process.h"
#include "tests/support/page_reader.h"

namespace kpsa::engine {
namespace {

using Json = nlohmann::json;

// "of it: cues" of the bench's table, milliseconds.
double CuesOfBench(const Json& tables) {
  for (const Json& table : tables) {
    if (table["title"] != "Bench") continue;
    for (const Json& row : table["rows"]) {
      if (row[0] == "of it: cues") return row[2].get<double>();
    }
  }
  ADD_FAILURE() << "no table tells of cues";
  return 0;
}

// At this one some frames of "wave" hit, some miss, and a few are blends.
constexpr char kPageTolerance[] = "0.12mm";

class PageReport : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new HelloFolder;
    const ProcessResult trained = RunKpsa({"train", folder_->rig(), "--force", "-q"});
    ASSERT_EQ(trained.exit_code, 0) << trained.err;
  }
  static void TearDownTestSuite() { delete folder_; }

  static ProcessResult Report(const std::string& rig, const std::string& output,
                              const std::vector<std::string>& more = {}) {
    std::vector<std::string> arguments = {"report", rig, "-o", output, "--force", "--runs", "1"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return RunKpsa(arguments);
  }
  static ReadPage PageOf(const std::string& rig, const std::vector<std::string>& more = {}) {
    const ProcessResult run = Report(rig, *folder_ / "page.html", more);
    EXPECT_EQ(run.exit_code, 0) << run.err;
    ReadPage page = ParsePage(TemporaryFolder::Read(*folder_ / "page.html"));
    EXPECT_EQ(page.error, "");
    return page;
  }
  // [frames][3V] as kpsa eval writes them; hello has one mesh.
  static std::vector<std::vector<float>> Eval(const std::vector<std::string>& more) {
    const std::string file = *folder_ / "points.npz";
    std::vector<std::string> arguments = {"eval", folder_->rig(), "-o", file, "--force"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const ProcessResult run = RunKpsa(arguments);
    EXPECT_EQ(run.exit_code, 0) << run.err;
    std::vector<std::vector<float>> frames;
    const Result<Npz> npz = ReadNpz(file, 1u << 30);
    EXPECT_TRUE(npz.ok());
    for (const NpzArray& array : npz->arrays) {
      if (array.shape.size() != 3) continue;
      const std::vector<float> all = array.Floats();
      const auto width = static_cast<std::ptrdiff_t>(3 * array.shape[1]);
      for (auto at = all.begin(); at != all.end(); at += width) frames.emplace_back(at, at + width);
    }
    return frames;
  }
  static inline HelloFolder* folder_ = nullptr;
};

double PageDistance(const double* a, const float* b) {
  return std::hypot(a[0] - double{b[0]}, a[1] - double{b[1]}, a[2] - double{b[2]});
}

TEST_F(PageReport, HasThePositionsOfEval) {
  const ReadPage page = PageOf(folder_->rig(), {"--tolerance", kPageTolerance});
  const auto full = Eval({}), accelerated = Eval({"--accelerate", "--tolerance", kPageTolerance});
  const Json& clip = page.meta["clips"][0];
  ASSERT_EQ(clip["frames"], full.size());
  ASSERT_EQ(full.size(), accelerated.size());
  ASSERT_TRUE(clip["residual"].contains("rows")) << "no frame is a miss";
  const double precision = page.meta["shape"]["precision"], step = clip["residual"]["step"];
  EXPECT_LE(precision, 0.12e-3 / 10);
  EXPECT_LE(step, 0.12e-3 / 16);
  const std::vector<int> residual = page.Wholes(clip["residual"]["blob"]);
  const std::vector<int> rows = clip["residual"]["rows"];
  double farthest = 0, off = 0, moved = 0;
  for (std::size_t f = 0; f < full.size(); ++f) {
    const std::vector<double> positions = page.Positions(clip["first_row"].get<std::size_t>() + f);
    const int row = rows[f];
    EXPECT_EQ(row < 0, full[f] == accelerated[f]) << f;
    double largest = 0;
    for (std::size_t v = 0; v < positions.size(); v += 3) {
      farthest = std::max(farthest, PageDistance(&positions[v], &accelerated[f][v]));
      double exact[3];
      for (std::size_t c = 0; c < 3; ++c) {
        const double difference = double{full[f][v + c]} - double{accelerated[f][v + c]};
        const double stored =
            row < 0 ? 0 : step * residual[static_cast<std::size_t>(row) * positions.size() + v + c];
        off = std::max(off, std::abs(difference - stored));
        exact[c] = difference;
      }
      largest = std::max(largest, std::hypot(exact[0], exact[1], exact[2]));
      moved = std::max(moved, PageDistance(&positions[v], &full[0][v]));
    }
    EXPECT_NEAR(clip["max_error"][f].get<double>(), largest, 1e-6 * largest + 1e-12) << f;
  }
  EXPECT_LE(farthest, precision + 1e-6);
  EXPECT_LE(off, step / 2 + 1e-9);
  EXPECT_GT(moved, 0.01);  // it is the clip, and not its first frame
}

TEST_F(PageReport, HasTheVerdictsOfBench) {
  const ReadPage page = PageOf(folder_->rig(), {"--tolerance", kPageTolerance});
  const ProcessResult run =
      RunKpsa({"bench", folder_->rig(), "--tolerance", kPageTolerance, "--runs", "1", "--json"});
  const Json bench = Json::parse(run.out), &clip = page.meta["clips"][0];
  ASSERT_EQ(bench["per_frame"].size(), clip["frames"]);
  const std::vector<std::string> names = {"hit", "blend", "miss"};
  std::size_t counts[3] = {};
  for (std::size_t f = 0; f < bench["per_frame"].size(); ++f) {
    const Json& frame = bench["per_frame"][f];
    const std::size_t verdict = clip["verdicts"][f];
    ++counts[verdict];
    EXPECT_EQ(names.at(verdict), frame["verdict"]) << f;
    const int reason = clip["reasons"][f];
    EXPECT_EQ(reason < 0 ? "hit" : page.meta["reasons"][static_cast<std::size_t>(reason)], frame["reason"])
        << f;
    EXPECT_NEAR(clip["max_error"][f].get<double>(), frame["max"].get<double>(), 1e-10) << f;
    EXPECT_NEAR(clip["rms_error"][f].get<double>(), frame["rms"].get<double>(), 1e-10) << f;
    EXPECT_GT(clip["full_us"][f], 0);
    EXPECT_GT(clip["accelerated_us"][f], 0);
  }
  EXPECT_GT(counts[0], 0u);
  EXPECT_GT(counts[2], 0u);
  EXPECT_EQ(page.meta["tolerances"].size(), bench["tolerances"]["rows"].size());
  EXPECT_EQ(page.meta["tolerance"], bench["tolerance"]);
  EXPECT_EQ(clip["test"], true);
}

TEST_F(PageReport, TellsOfTheRig) {
  const ReadPage page = PageOf(folder_->rig());
  const Json& meta = page.meta;
  EXPECT_EQ(meta["points"], 794);
  EXPECT_EQ(page.Floats(meta["rest"]).size(), 3u * 794);
  for (const int vertex : page.Wholes(meta["meshes"][0]["triangles"])) ASSERT_LT(vertex, 794);
  // Controls, and that a turn of the upper joint moves the top and not the foot
  EXPECT_EQ(meta["controls"][1]["name"], "upper.rotateZ");
  EXPECT_EQ(meta["controls"][1]["min"], -75);
  EXPECT_GT(meta["controls"][1]["moves_max"], 0.05);
  const std::vector<int> moves = page.Wholes(meta["controls"][1]["moves"]);
  EXPECT_EQ(*std::max_element(moves.begin(), moves.end()), 255);
  EXPECT_EQ(*std::min_element(moves.begin(), moves.end()), 0);
  // The stack runs for cues alone, or not at all; the joints run
  std::map<std::string, Json> nodes;
  for (const Json& node : meta["nodes"]) nodes[node["name"]] = node;
  EXPECT_EQ(nodes["upper"]["state"], "kept");
  EXPECT_EQ(nodes["column_kpsa"]["state"], "kept");
  EXPECT_TRUE(nodes["mush"]["state"] == "cues only" || nodes["mush"]["state"] == "never run");
  EXPECT_EQ(nodes["mush"]["points"], 794);
  EXPECT_GT(nodes["mush"]["full_us"], 0);
  EXPECT_FALSE(nodes["mush"]["inputs"].empty());
  ASSERT_FALSE(meta["cues"].empty());
  const std::vector<float> rest = page.Floats(meta["rest"]);
  double cost = 0, least_point = INFINITY, most_number = 0;
  std::map<std::string, double> of_stage;  // in equal parts
  for (const Json& cue : meta["cues"]) {
    EXPECT_GT(cue["cost_us"].get<double>(), 0) << cue.dump();
    const double us = cue["cost_us"].get<double>();
    cost += us;
    if (cue["kind"] == "scalar") most_number = std::max(most_number, us);
    if (cue["kind"] != "point") continue;
    least_point = std::min(least_point, us);
    EXPECT_EQ(of_stage.try_emplace(cue["stage"].get<std::string>(), us).first->second, us);
    const std::size_t vertex = cue["vertex"];
    EXPECT_NEAR(cue["position"][1].get<double>(), rest[3 * vertex + 1], 1e-5);
  }
  const double measured = CuesOfBench(meta["tables"]);
  EXPECT_NEAR(cost / 1e3, measured, 2e-3 * measured);
  ASSERT_FALSE(of_stage.empty());
  EXPECT_GT(least_point, most_number) << "a point is three numbers, and what deforms it";
  std::set<std::string> titles;
  for (const Json& table : meta["tables"]) {
    titles.insert(table["title"]);
    for (const Json& row : table["rows"]) EXPECT_EQ(row.size(), table["columns"].size());
  }
  for (const char* title : {"Bench", "Clips", "Promise", "Profile", "Calibration"})
    EXPECT_TRUE(titles.contains(title)) << title;
  EXPECT_FALSE(meta["fields"].empty());
}

TEST_F(PageReport, ShowsTheFullEvaluationAloneWithoutASubspace) {
  const HelloFolder untrained;
  const ProcessResult run = Report(untrained.rig(), untrained / "page.html");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(run.err.find("note: \"column\" is not trained"), std::string::npos) << run.err;
  const ReadPage page = ParsePage(TemporaryFolder::Read(untrained / "page.html"));
  EXPECT_EQ(page.meta["accelerated"], false);
  for (const char* key : {"cues", "tolerance", "tolerances", "reasons"})
    EXPECT_FALSE(page.meta.contains(key)) << key;
  const Json& clip = page.meta["clips"][0];
  for (const char* key : {"verdicts", "accelerated_us", "max_error", "residual"})
    EXPECT_FALSE(clip.contains(key)) << key;
  EXPECT_EQ(clip["full_us"].size(), clip["frames"]);
  for (const Json& node : page.meta["nodes"]) EXPECT_FALSE(node.contains("state"));
  const auto full = Eval({});
  for (const std::size_t f : {std::size_t{0}, full.size() / 2}) {
    const std::vector<double> positions = page.Positions(f);
    for (std::size_t v = 0; v < positions.size(); v += 3)
      ASSERT_LE(PageDistance(&positions[v], &full[f][v]),
                page.meta["shape"]["precision"].get<double>() + 1e-6);
  }
  // A character alone is a rig, too
  const ProcessResult character = Report(untrained / "hello.glb", untrained / "glb.html", {"-q"});
  EXPECT_EQ(character.exit_code, 0) << character.err;
  EXPECT_EQ(character.out + character.err, "");
}

// Two clips are rows of one shape; what a rig is called cannot end its element; and the same rig gives the same bytes.
TEST_F(PageReport, KeepsNamesClipsAndBytes) {
  const HelloFolder folder;
  folder.AddSway();
  const std::string rig = folder.Write("<!--a<b>.yaml", HelloFolder::Yaml());
  const std::vector<std::string> more = {
      "--clip", "sway", "--clip", "wave", "--kpsa", *folder_ / "hello.kpsa", "--stale", "miss", "--json"};
  const ProcessResult run = Report(rig, folder / "a.html", more);
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const std::string html = TemporaryFolder::Read(folder / "a.html");
  EXPECT_EQ(html.find("<!--a<b"), std::string::npos);
  const ReadPage page = ParsePage(html);
  ASSERT_EQ(page.error, "");
  EXPECT_EQ(page.meta["rig"], "<!--a<b>.yaml");
  ASSERT_EQ(page.meta["clips"].size(), 2u);
  EXPECT_EQ(page.meta["clips"][1]["first_row"], page.meta["clips"][0]["frames"]);
  const Json sizes = Json::parse(run.out);
  EXPECT_EQ(sizes["bytes"], html.size());
  std::size_t sum = 0;
  for (const Json& part : sizes["parts"]) sum += part["bytes"].get<std::size_t>();
  EXPECT_EQ(sum, html.size());
  ASSERT_EQ(Report(rig, folder / "b.html", more).exit_code, 0);
  const ReadPage again = ParsePage(TemporaryFolder::Read(folder / "b.html"));
  EXPECT_EQ(page.blobs, again.blobs);
  EXPECT_EQ(page.meta["shape"], again.meta["shape"]);
  EXPECT_EQ(page.meta["controls"], again.meta["controls"]);
}

TEST_F(PageReport, RefusesBadInput) {
  const std::string rig = folder_->rig(), out = *folder_ / "refused.html";
  const auto refused = [&](const std::vector<std::string>& arguments, int code, const std::string& text) {
    const ProcessResult run = RunKpsa(arguments);
    EXPECT_EQ(run.exit_code, code) << run.err;
    EXPECT_NE(run.err.find(text), std::string::npos) << run.err;
    EXPECT_FALSE(std::filesystem::exists(out));
  };
  refused({"report", rig}, 2, "expected -o FILE.html");
  refused({"report", rig, "-o", *folder_ / "x.md"}, 2, ".html");
  refused({"report", rig, kHelloGlb, "-o", out}, 2, "expected one rig");
  refused({"report", rig, "-o", out, "--csv", "x.csv"}, 2, "--csv is of no use for a rig");
  refused({"report", rig, "-o", out, "--clip", "nod"}, 2, "nod");
  refused({"report", rig, "-o", out, "--kpsa", *folder_ / "none.kpsa"}, 3, "none.kpsa");
  refused({"report", rig, "-o", out, "--tolerance", "far"}, 2, "--tolerance");
  refused({"report", rig, "-o", out, "--runs", "0"}, 2, "--runs");
  refused({"report", *folder_ / "none.yaml", "-o", out}, 3, "none.yaml");
  refused({"report", "bench.json", "--clip", "wave"}, 2, "--clip is of no use for benches");
  folder_->Write("there.html", "mine");
  refused({"report", rig, "-o", *folder_ / "there.html"}, 2, "there.html");
  EXPECT_EQ(TemporaryFolder::Read(*folder_ / "there.html"), "mine");
}

TEST_F(PageReport, LeavesNothingWhereItIsInterrupted) {
  const TemporaryFolder out;
  const ProcessResult run =
      RunKpsaInterrupted({"report", folder_->rig(), "-o", out / "page.html", "--runs", "1000", "-q"}, 0.3);
  EXPECT_EQ(run.exit_code, 130) << run.err;
  EXPECT_EQ(out.FileCount(), 0u);
}

}  // namespace
}  // namespace kpsa::engine
