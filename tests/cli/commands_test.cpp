// What the commands do with sound input, on the smallest rig.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "files/npz.h"
#include "tests/cli/process.h"
#include "tests/support/temporary_folder.h"

namespace kpsa::engine {
namespace {

using Json = nlohmann::json;

std::string Ok(const std::vector<std::string>& arguments) {
  const ProcessResult run = RunKpsa(arguments);
  std::string line;
  for (const std::string& word : arguments) line += word + " ";
  EXPECT_EQ(run.exit_code, 0) << line << "\n" << run.err;
  return run.out;
}

Json OkJson(const std::vector<std::string>& arguments) {
  const Json document = Json::parse(Ok(arguments), nullptr, false);
  EXPECT_FALSE(document.is_discarded());
  return document;
}

TEST(Eval, AllFormatsHoldTheSameFrames) {
  const TemporaryFolder folder;
  for (const char* name : {"a.npz", "a.pc2", "a.mdd", "a.usda", "a.glb"})
    Ok({"eval", kHello, "--frames", "0:12", "-o", folder / name, "-q"});
  EXPECT_EQ(folder.FileCount(), 5u);
  EXPECT_NE(Ok({"compare", folder / "a.npz", folder / "a.pc2"}).find("same"), std::string::npos);
  EXPECT_NE(Ok({"compare", folder / "a.mdd", folder / "a.npz"}).find("same"), std::string::npos);
  EXPECT_EQ(TemporaryFolder::Read(folder / "a.usda").substr(0, 5), "#usda");
  // What was written as morph targets can be evaluated, and comes close
  Ok({"eval", folder / "a.glb", "--fps", "24", "--frames", "0:12", "-o", folder / "b.npz"});
  const Json close = Json::parse(
      RunKpsa({"compare", folder / "a.pc2", folder / "b.npz", "--tolerance", "1mm", "--json"}).out, nullptr,
      false);
  EXPECT_EQ(close["same"], true) << close.dump();
}

TEST(Eval, StdoutGetsTheSameBytes) {
  const TemporaryFolder folder;
  Ok({"eval", kHello, "--frames", "0:3", "-o", folder / "a.npz"});
  EXPECT_EQ(Ok({"eval", kHello, "--frames", "0:3", "-o", "-"}), TemporaryFolder::Read(folder / "a.npz"));
}

TEST(Eval, SameBytesForAnyThreadsAndWaysToSayTimes) {
  const TemporaryFolder folder;
  Ok({"eval", kHello, "--frames", "0:24:12", "--threads", "1", "-o", folder / "a.npz"});
  Ok({"eval", kHello, "--times", "0,0.5,1", "--threads", "3", "-o", folder / "b.npz"});
  EXPECT_EQ(TemporaryFolder::Read(folder / "a.npz"), TemporaryFolder::Read(folder / "b.npz"));
  Ok({"eval", kHello, "--frames", "0:48", "-o", folder / "range.npz"});
  Ok({"eval", kHello, "-o", folder / "clip.npz"});
  EXPECT_EQ(TemporaryFolder::Read(folder / "range.npz"), TemporaryFolder::Read(folder / "clip.npz"));
  Ok({"eval", kHello, "--times", "1,0,0.5", "-o", folder / "c.npz"});
  const Result<Npz> forward = ReadNpz(folder / "a.npz"), shuffled = ReadNpz(folder / "c.npz");
  ASSERT_TRUE(forward.ok() && shuffled.ok());
  const std::vector<float> a = forward->arrays[1].Floats(), c = shuffled->arrays[1].Floats();
  const std::size_t frame = a.size() / 3;
  EXPECT_TRUE(std::equal(a.begin(), a.begin() + static_cast<std::ptrdiff_t>(frame),
                         c.begin() + static_cast<std::ptrdiff_t>(frame)));
}

TEST(Eval, ExistingFilesAreKeptWithoutForce) {
  const TemporaryFolder folder;
  folder.Write("a.npz", "mine");
  EXPECT_EQ(RunKpsa({"eval", kHello, "--times", "0", "-o", folder / "a.npz"}).exit_code, 2);
  EXPECT_EQ(TemporaryFolder::Read(folder / "a.npz"), "mine");
  Ok({"eval", kHello, "--times", "0", "-o", folder / "a.npz", "--force"});
  EXPECT_TRUE(ReadNpz(folder / "a.npz").ok());
}

TEST(Eval, SettingsAndPosesMovePoints) {
  const TemporaryFolder folder;
  Ok({"eval", kHello, "--rest", "-o", folder / "rest.npz"});
  Ok({"eval", kHello, "--rest", "--set", "upper.rotateZ=-20", "-o", folder / "set.npz"});
  folder.Write("pose.yaml", "kpsa: 1\npose: {upper.rotateZ: -20}\n");
  Ok({"eval", kHello, "--rest", "--pose", folder / "pose.yaml", "-o", folder / "pose.npz"});
  EXPECT_EQ(RunKpsa({"compare", folder / "rest.npz", folder / "set.npz"}).exit_code, 1);
  EXPECT_EQ(RunKpsa({"compare", folder / "set.npz", folder / "pose.npz"}).exit_code, 0);
}

// A pose is not the rest state: what deformers remember of the rest (the detail that deltaMush gives back,
// where a lattice was bound) is the same whether a value is set or animated.
TEST(Eval, ASettingIsTheSameAsAClipThatHoldsIt) {
  const TemporaryFolder folder;
  // The clip's rotation at one time, set on the control while no clip plays
  const std::string bend = folder / "bend.yaml";
  folder.Write("bend.yaml", fmt::format("kpsa: 1\ncharacter: {}/hello/hello.glb\n"
                                        "nodes: {{mush: {{type: deltaMush}}}}\n"
                                        "deform: [{{meshes: [column], stack: [gltf, mush]}}]\n",
                                        KPSA_SCENES_DIR));
  const ProcessResult matrix = RunKpsa({"get", bend, "upper.matrix", "--times", "0.8", "--json"});
  ASSERT_EQ(matrix.exit_code, 0) << matrix.err;
  const std::string values = nlohmann::json::parse(matrix.out).at("plugs").at(0).at("values").at(0).dump();
  Ok({"eval", bend, "--times", "0.8", "-o", folder / "clip.npz"});
  Ok({"eval", bend, "--rest", "--times", "0.8", "--set", "upper.offsetParentMatrix=" + values, "-o",
      folder / "set.npz"});
  const ProcessResult compared =
      RunKpsa({"compare", folder / "clip.npz", folder / "set.npz", "--tolerance", "0.001mm"});
  EXPECT_EQ(compared.exit_code, 0) << compared.out;
  Ok({"eval", bend, "--rest", "--times", "0.8", "--set", "upper.offsetParentMatrix=" + values, "--set",
      "mush.iterations=0", "-o", folder / "skin.npz"});
  EXPECT_EQ(RunKpsa({"compare", folder / "set.npz", folder / "skin.npz", "--tolerance", "0.1mm"}).exit_code,
            1);
}

TEST(Get, NamesWithQuotesAreQuoted) {
  const TemporaryFolder folder;
  folder.Write("a.yaml", fmt::format("kpsa: 1\ncharacter: {}/hello/hello.glb\nnodes: {{'say \"hi\", you': "
                                     "{{type: plusMinusAverage}}}}\n",
                                     KPSA_SCENES_DIR));
  const ProcessResult run = RunKpsa({"get", folder / "a.yaml", "say \"hi\", you.output", "--times", "0"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(run.out.substr(0, run.out.find('\n')), "time,\"say \"\"hi\"\", you.output\"");
}

TEST(Eval, AnInterruptLeavesNothing) {
  const TemporaryFolder folder;
  for (const char* name : {"a.npz", "a.pc2"}) {
    const ProcessResult run =
        RunKpsaInterrupted({"eval", kHello, "--frames", "0:400000", "-o", folder / name}, 1.0);
    EXPECT_EQ(run.exit_code, 130) << name << run.err;
    EXPECT_NE(run.err.find("interrupted"), std::string::npos);
    EXPECT_EQ(folder.FileCount(), 0u) << name;
  }
}

TEST(Eval, AFailingNodeIsAnEvaluationError) {
  const TemporaryFolder folder;
  folder.Write(
      "trip.yaml",
      "kpsa: 1\ncharacter: " + kHelloGlb +
          "\nnodes:\n  trip: {type: tripwire, armed: true}\ndeform:\n  - {meshes: [column], stack: [skin, "
          "trip]}\n");
  for (const char* output : {"out.npz", "out.mdd"}) {
    const ProcessResult run =
        RunKpsa({"eval", folder / "trip.yaml", "--frames", "0:30", "-o", folder / output});
    EXPECT_EQ(run.exit_code, 4) << run.err;
    EXPECT_NE(run.err.find("trip"), std::string::npos) << run.err;
    EXPECT_LE(run.error_lines(), 5u);
    EXPECT_EQ(folder.FileCount(), 1u);
  }
}

TEST(Get, CsvAndJsonAgreeWithEval) {
  const TemporaryFolder folder;
  Ok({"eval", kHello, "--times", "0.5", "-o", folder / "a.npz"});
  const Result<Npz> npz = ReadNpz(folder / "a.npz");
  ASSERT_TRUE(npz.ok());
  const Json json =
      OkJson({"get", kHello, "column", "upper.worldMatrix", "upper.poseRotateZ", "--times", "0.5", "--json"});
  const std::vector<float> points = npz->arrays[1].Floats();
  const Json& values = json["plugs"][0]["values"][0];
  ASSERT_EQ(values.size(), points.size());
  for (std::size_t i = 0; i < points.size(); ++i)
    EXPECT_EQ(static_cast<float>(values[i].get<double>()), points[i]);
  EXPECT_EQ(json["plugs"][1]["values"][0].size(), 16u);
  EXPECT_EQ(json["plugs"][1]["values"][0][15], 1.0);
  EXPECT_EQ(json["plugs"][2]["unit"], "deg");
  EXPECT_GT(std::abs(json["plugs"][2]["values"][0].get<double>()), 1.0);  // degrees, mid-clip

  std::istringstream csv(Ok({"get", kHello, "upper.worldMatrix", "upper.poseRotateZ", "--frames", "0:4"}));
  std::string line;
  std::size_t lines = 0;
  while (std::getline(csv, line)) {
    EXPECT_EQ(std::count(line.begin(), line.end(), ','), 17) << line;
    ++lines;
  }
  EXPECT_EQ(lines, 6u);
}

TEST(Compile, MasksToTheVerticesThatAreWanted) {
  const Json all = OkJson({"compile", kHello, "--json"}),
             few = OkJson({"compile", kHello, "--want", "column@skin", "--vertices", "0:2", "--json"});
  std::map<std::string, Json> kept;
  for (const Json& node : few["nodes"]) kept[node["name"]] = node;
  const auto skin =
      std::find_if(kept.begin(), kept.end(), [](const auto& n) { return n.second["type"] == "skinCluster"; });
  ASSERT_NE(skin, kept.end());
  EXPECT_EQ(skin->second["points"], 3);
  EXPECT_FALSE(kept.contains("mush"));
  bool excluded = false;
  for (const Json& node : few["excluded"])
    excluded = excluded || (node["name"] == "mush" && node["reason"] == "not needed by the request");
  EXPECT_TRUE(excluded);
  for (const Json& node : all["nodes"]) {
    if (node["name"] == "mush") {
      EXPECT_EQ(node["points"], node["points_total"]);
    }
  }
}

TEST(Profile, TracesNestAndTimesAddUp) {
  const TemporaryFolder folder;
  for (const char* threads : {"1", "2"}) {
    const std::string trace_path = folder / (std::string(threads) + ".json");
    const Json report = OkJson(
        {"profile", kHello, "--frames", "0:20", "--threads", threads, "--trace", trace_path, "--json"});
    double nodes = 0;
    for (const Json& node : report["nodes"]) {
      nodes += node["self_ms"].get<double>();
      EXPECT_GE(node["inclusive_ms"].get<double>(), node["self_ms"].get<double>());
    }
    EXPECT_GT(nodes, 0);
    if (std::string(threads) == "1") {
      EXPECT_LE(nodes, report["ms_per_frame"].get<double>());
    }
    EXPECT_LE(report["critical_path"]["ms"].get<double>(), nodes * 1.0001);
    EXPECT_GE(report["ceiling"]["speedup"].get<double>(), 1);

    const Json trace = Json::parse(TemporaryFolder::Read(trace_path), nullptr, false);
    ASSERT_FALSE(trace.is_discarded());
    std::map<int, std::vector<std::pair<double, double>>> tracks;
    for (const Json& event : trace["traceEvents"]) {
      if (event["ph"] == "X")
        tracks[event["tid"]].emplace_back(event["ts"],
                                          event["ts"].get<double>() + event["dur"].get<double>());
    }
    EXPECT_EQ(tracks[0].size(), 21u);
    EXPECT_GE(tracks.size(), 2u);
    for (auto& [track, events] : tracks) {
      std::sort(events.begin(), events.end(), [](const auto& a, const auto& b) {
        return a.first != b.first ? a.first < b.first : a.second > b.second;
      });
      std::vector<double> open;
      for (const auto& [begin, end] : events) {
        while (!open.empty() && open.back() <= begin + 1e-6) open.pop_back();
        EXPECT_TRUE(open.empty() || end <= open.back() + 1e-6)
            << "track " << track << " overlaps at " << begin;
        open.push_back(end);
      }
    }
  }
}

TEST(Compare, DiffersIsNotAnError) {
  const TemporaryFolder folder;
  Ok({"eval", kHello, "--times", "0,0.5", "-o", folder / "a.npz"});
  Ok({"eval", kHello, "--times", "0,0.6", "-o", folder / "other_times.npz"});
  Ok({"eval", kHello, "--times", "0", "-o", folder / "one.npz"});
  Ok({"eval", kHello, "--times", "0,0.5", "--set", "mush.envelope=0", "-o", folder / "b.npz"});
  EXPECT_EQ(RunKpsa({"compare", folder / "a.npz", folder / "a.npz"}).exit_code, 0);
  const ProcessResult differ = RunKpsa({"compare", folder / "a.npz", folder / "b.npz", "--json"});
  EXPECT_EQ(differ.exit_code, 1);
  const Json report = Json::parse(differ.out, nullptr, false);
  ASSERT_EQ(report["frames"].size(), 2u);
  const double max = report["max"];
  EXPECT_GT(max, 0);
  for (const Json& frame : report["frames"]) {
    EXPECT_LE(frame["rms"], frame["max"]);
    EXPECT_LE(frame["p99"], frame["max"]);
  }
  EXPECT_EQ(
      RunKpsa({"compare", folder / "a.npz", folder / "b.npz", "--tolerance", fmt::format("{}m", max * 1.001)})
          .exit_code,
      0);
  EXPECT_EQ(
      RunKpsa({"compare", folder / "a.npz", folder / "b.npz", "--tolerance", fmt::format("{}m", max * 0.999)})
          .exit_code,
      1);
  EXPECT_EQ(RunKpsa({"compare", folder / "a.npz", folder / "other_times.npz"}).exit_code, 1);
  EXPECT_EQ(RunKpsa({"compare", folder / "a.npz", folder / "one.npz"}).exit_code, 1);
}

TEST(Nodes, EveryTypeIsDocumented) {
  const Json reference = OkJson({"nodes", "--json"});
  EXPECT_GT(reference["nodes"].size(), 20u);
  for (const Json& node : reference["nodes"]) {
    EXPECT_NE(node["doc"], "") << node["name"];
    EXPECT_FALSE(node["attributes"].empty()) << node["name"];
  }
  EXPECT_NE(Ok({"nodes", "deltaMush"}).find("iterations"), std::string::npos);
  EXPECT_NE(Ok({"nodes", "--markdown"}).find("### deltaMush"), std::string::npos);
}

TEST(Inspect, KnowsWhatItWrites) {
  const TemporaryFolder folder;
  Ok({"eval", kHello, "--frames", "0:4", "-o", folder / "a.npz"});
  Ok({"eval", kHello, "--frames", "0:4", "-o", folder / "a.mdd"});
  EXPECT_EQ(OkJson({"inspect", kHello, "--json"})["kind"], "rig");
  EXPECT_EQ(OkJson({"inspect", kHelloGlb, "--json"})["kind"], "character");
  EXPECT_EQ(OkJson({"inspect", folder / "a.npz", "--json"})["frames"], 5);
  EXPECT_EQ(OkJson({"inspect", folder / "a.mdd", "--json"})["frames"], 5);
  EXPECT_EQ(OkJson({"inspect", KPSA_SCENES_DIR "/face/w/face.json", "--json"})["kind"], "weights");
}

// The first five minutes: init, train, bench, and what follows from them.
TEST(Acceleration, FirstFiveMinutes) {
  const TemporaryFolder folder;
  const std::string rig = folder / "hello.yaml", subspace = folder / "hello.kpsa";
  Ok({"init", kHelloGlb, "-o", rig});
  Ok({"validate", rig});
  EXPECT_EQ(RunKpsa({"bench", rig}).exit_code, 3) << "no subspace yet";
  const Json trained = OkJson({"train", rig, "--force", "--samples", "120", "--json", "-q"});
  EXPECT_TRUE(std::filesystem::exists(subspace));
  EXPECT_GT(trained["cues"], 0);
  EXPECT_GE(trained["check"]["worst_poses"].size(), 1u);
  EXPECT_EQ(trained["check"]["poses"], 60);
  EXPECT_EQ(trained["check"]["reconstructed"], 60);
  EXPECT_EQ(RunKpsa({"train", rig, "--samples", "120"}).exit_code, 2) << "an existing subspace";
  EXPECT_EQ(OkJson({"inspect", subspace, "--json"})["kind"], "subspace");

  const Json bench = OkJson({"bench", rig, "--runs", "2", "--json", "-q"});
  for (const char* key : {"clip", "trained_on", "points", "cues", "cue_stages", "modes", "frames", "threads",
                          "speedup", "speedup_on_hits", "ceiling", "hit_rate", "violation_rate", "motion"}) {
    EXPECT_TRUE(bench.contains(key)) << key;
  }
  EXPECT_EQ(bench["schema"], "kpsa.bench/1");
  const Json& fast = bench["accelerated"];
  const double parts = fast["graph"].get<double>() + fast["cues"].get<double>() +
                       fast["projection"].get<double>() + fast["reconstruction"].get<double>() +
                       fast["downstream"].get<double>() + fast["misses"].get<double>();
  EXPECT_NEAR(parts, fast["ms_per_frame"].get<double>(), 0.01 * fast["ms_per_frame"].get<double>());
  EXPECT_GT(bench["full"]["ms_per_frame"], 0);
  EXPECT_TRUE(bench["nodes"]["never_evaluated"].is_array());
  EXPECT_LE(bench["error"]["rms"], bench["error"]["max"]);

  // One frame, or a pose in which nothing moves: all of it is evaluated every time
  for (const std::vector<std::string>& chosen :
       {std::vector<std::string>{"--frames", "5"}, {"--rest"}, {"--rest", "--frames", "0:2"}}) {
    std::vector<std::string> arguments{"bench", rig, "--runs", "1", "--json", "-q"};
    arguments.insert(arguments.end(), chosen.begin(), chosen.end());
    const Json still = OkJson(arguments);
    EXPECT_GT(still["full"]["ms_per_frame"], 0) << still["clip"];
    EXPECT_GT(still["nodes"]["total"], 0) << still["clip"];
    EXPECT_EQ(still["points_evaluated_per_frame"]["full"], bench["points_evaluated_per_frame"]["full"]);
  }

  // Frames have the clip's numbers, and none is the worst where nothing differs
  const Json some = OkJson({"bench", rig, "--frames", "10:40:10", "--runs", "1", "--json", "-q"});
  std::vector<int> numbers;
  for (const Json& frame : some["per_frame"]) numbers.push_back(frame["frame"]);
  EXPECT_EQ(numbers, (std::vector<int>{10, 20, 30, 40}));
  EXPECT_EQ(some["error"]["worst_frame"].get<int>() % 10, 0) << some["error"];
  EXPECT_GE(some["error"]["worst_frame"], 10);
  const std::string exact =
      Ok({"bench", rig, "--frames", "10:40:10", "--tolerance", "0", "--runs", "1", "-q"});
  EXPECT_EQ(exact.find("(frame"), std::string::npos) << exact;
  EXPECT_NE(exact.find("first at frame 10"), std::string::npos) << exact;

  // Tolerance 0: the exact rig, bit for bit
  Ok({"eval", rig, "-o", folder / "full.npz"});
  Ok({"eval", rig, "--accelerate", "--tolerance", "0", "-o", folder / "zero.npz"});
  EXPECT_EQ(RunKpsa({"compare", folder / "full.npz", folder / "zero.npz"}).exit_code, 0);
  const Json evaluated = OkJson({"eval", rig, "--accelerate", "--json", "-o", folder / "fast.npz"});
  const Json& told = evaluated["accelerated"];
  EXPECT_EQ(told["hits"].get<int>() + told["blends"].get<int>() + told["misses"].get<int>(),
            evaluated["frames"].get<int>());
  EXPECT_NE(RunKpsa({"eval", rig, "--kpsa", subspace, "-o", folder / "own.npz"}).err.find("hits"),
            std::string::npos);
  EXPECT_EQ(RunKpsa({"compare", folder / "fast.npz", folder / "own.npz"}).exit_code, 0);

  // Another rig than the trained one is refused, or evaluated fully
  const ProcessResult stale =
      RunKpsa({"eval", rig, "--accelerate", "--set", "mush.iterations=3", "-o", folder / "stale.npz"});
  EXPECT_EQ(stale.exit_code, 3);
  EXPECT_NE(stale.err.find("mush.iterations"), std::string::npos) << stale.err;
  Ok({"eval", rig, "--accelerate", "--stale", "miss", "--set", "mush.iterations=3", "-o",
      folder / "stale.npz"});
  Ok({"eval", rig, "--set", "mush.iterations=3", "-o", folder / "exact.npz"});
  EXPECT_EQ(RunKpsa({"compare", folder / "stale.npz", folder / "exact.npz"}).exit_code, 0);

  EXPECT_NE(Ok({"compile", rig, "--accelerate"}).find("kpsa"), std::string::npos);
  EXPECT_NE(Ok({"explain", rig, "mush", "--accelerate"}).find("only if"), std::string::npos);
  EXPECT_EQ(Ok({"graph", rig, "--accelerate"}).substr(0, 7), "digraph");
  Ok({"render", rig, "--accelerate", "--size", "64x64", "-o", folder / "error.png"});
  EXPECT_EQ(TemporaryFolder::Read(folder / "error.png").substr(1, 3), "PNG");
}

TEST(Render, PicturesOfFrames) {
  const TemporaryFolder folder;
  Ok({"render", kHello, "--frames", "0:24:8", "--size", "48x64", "-o", folder / "frames.png"});
  Ok({"render", kHello, "--turntable", "3", "--size", "48x64", "-o", folder / "around.png"});
  EXPECT_EQ(TemporaryFolder::Read(folder / "around.png").substr(1, 3), "PNG");
  EXPECT_EQ(folder.FileCount(), 2u);
}

// A camera's light after bounces, fully and from a subspace of its pixels.
TEST(Render, ACameraSeesLightAfterBounces) {
  const TemporaryFolder folder;
  std::string rig = TemporaryFolder::Read(KPSA_SCENES_DIR "/gi/gi.yaml");
  const auto replace = [&](const std::string& from, const std::string& to) {
    const std::size_t at = rig.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    rig.replace(at, from.size(), to);
  };
  replace("room.glb", KPSA_SCENES_DIR "/gi/room.glb");
  // So few pixels, with less noise than the tolerance
  replace("width: 400, height: 400, samples: 128, keySamples: 16", "width: 20, height: 20, samples: 24");
  replace("samples: 40, keyPoints: 200, heldOut: 50", "samples: 20, keyPoints: 30");
  folder.Write("carried.yaml", rig);
  Ok({"render", folder / "carried.yaml", "--camera", "front", "--times", "1", "-o", folder / "carried.png"});
  replace("carried: [figure], ", "");
  rig.erase(rig.find("  figure:\n    colors"), rig.find("variants:") - rig.find("  figure:\n    colors"));
  folder.Write("gi.yaml", rig);
  const std::string path = folder / "gi.yaml";
  Ok({"render", path, "--camera", "front", "--times", "1", "-o", folder / "all.png"});
  Ok({"render", path, "--camera", "front", "--times", "1", "--layer", "direct", "-o", folder / "direct.png"});
  EXPECT_NE(TemporaryFolder::Read(folder / "all.png"), TemporaryFolder::Read(folder / "direct.png"));
  EXPECT_NE(TemporaryFolder::Read(folder / "all.png"), TemporaryFolder::Read(folder / "carried.png"));
  EXPECT_EQ(RunKpsa({"render", path, "--camera", "fron", "-o", folder / "no.png"}).exit_code, 2);
  EXPECT_EQ(RunKpsa({"render", path, "--exposure", "2", "-o", folder / "no.png"}).exit_code, 2);
  EXPECT_EQ(RunKpsa({"render", path, "--shrink", "2", "-o", folder / "no.png"}).exit_code, 2);
  EXPECT_NE(RunKpsa({"render", path, "--camera", "front", "--shrink", "21", "-o", folder / "no.png"})
                .err.find("from 1 to 20"),
            std::string::npos);
  EXPECT_NE(RunKpsa({"render", path, "--camera", "front", "--frames", "0:1", "--shrink", "3", "-o",
                     folder / "small.png"})
                .err.find("16 x 6"),
            std::string::npos);

  Ok({"train", path, "--force", "--rows", "90", "--modes", "12", "--calibration", "40", "--keep-modes"});
  const Json bench = Json::parse(Ok({"bench", path, "--runs", "1", "--tolerance", "1000", "--json"}));
  EXPECT_EQ(bench["points"], 400);
  EXPECT_GT(bench["hit_rate"], 0.5);
  EXPECT_GT(bench["error"]["rms"], 0.0);
  EXPECT_LT(bench["error"]["rms"], bench["motion"]["rms"]);
  EXPECT_GT(bench["speedup"], 1.5);
  EXPECT_EQ(bench["units"], "light");
  EXPECT_GT(bench["frame_errors"]["rms"]["projection"], 0.0);  // from the modes in the file
  Ok({"render", path, "--camera", "front", "--times", "1", "--accelerate", "-o", folder / "three.png"});
  // The scale of the error goes by the trained tolerance where any error may pass, and is never 0
  const auto compared = [&](const std::string& tolerance) {
    Ok({"render", path, "--camera", "front", "--times", "1", "--accelerate", "--tolerance", tolerance, "-o",
        folder / "compared.png", "--force"});
    return TemporaryFolder::Read(folder / "compared.png");
  };
  EXPECT_TRUE(compared("any") == TemporaryFolder::Read(folder / "three.png"));
  EXPECT_TRUE(compared("0") == compared("1e-9"));

  // On the test clip, at the trained tolerance: hits, and what they are wrong by
  const Json held_out = Json::parse(Ok({"bench", path, "--runs", "1", "--json"}));
  EXPECT_GT(held_out["hit_rate"], 0.5);
  EXPECT_LE(held_out["violation_rate"], 0.1);
  for (const Json& frame : held_out["per_frame"]) {
    EXPECT_LT(frame["rms"], 0.12);
  }
  const std::string text = Ok({"bench", path, "--runs", "1", "--frames", "0:20:10", "--per-frame"});
  EXPECT_NE(text.find("an RMS of 0.08"), std::string::npos) << text;
  EXPECT_EQ(text.find(" m;"), std::string::npos) << text;  // no metres
  // A lamp where it never was: all frames are rendered fully, and the lamp is named
  const std::vector<std::string> far = {"bench",    path,      "--runs", "1",
                                        "--frames", "0:20:10", "--set",  "lampArm.rotateZ=80"};
  EXPECT_NE(Ok(far).find("lamp.outMatrix is outside its trained range"), std::string::npos);
  std::vector<std::string> as_json = far;
  as_json.push_back("--json");
  const Json full = Json::parse(Ok(as_json));
  EXPECT_EQ(full["hit_rate"], 0.0);
  EXPECT_EQ(full["error"]["max"], 0.0);
  EXPECT_EQ(TemporaryFolder::Read(folder / "three.png").substr(1, 3), "PNG");

  // Commands that look into a rig see the subspace that stands in for the light
  for (const char* wanted : {"", "bounced.irradiance"}) {
    std::vector<std::string> words = {"compile", path, "--accelerate", "--json"};
    if (*wanted != 0) words.insert(words.end(), {"--want", wanted});
    std::string types;
    const Json compiled = OkJson(words);
    for (const Json& node : compiled["nodes"]) types += node["type"].get<std::string>() + " ";
    EXPECT_NE(types.find("kpsa"), std::string::npos) << wanted << ": " << types;
  }

  // The entry names the colours, not a mesh; a rig without it takes it from the subspace
  EXPECT_NE(Ok({"inspect", path}).find("bounced.irradiance"), std::string::npos);
  const std::size_t entry = rig.find("\naccelerate:");
  ASSERT_NE(entry, std::string::npos);
  folder.Write("bare.yaml", rig.substr(0, entry + 1));
  const Json bare = OkJson({"eval", folder / "bare.yaml", "--kpsa", folder / "gi.kpsa", "--times", "1", "-o",
                            folder / "bare.npz", "--json"});
  const Json& told = bare["accelerated"];
  EXPECT_EQ(told["hits"].get<int>() + told["blends"].get<int>() + told["misses"].get<int>(), 1)
      << bare.dump();
}

}  // namespace
}  // namespace kpsa::engine
