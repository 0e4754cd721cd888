// What is evaluated over HTTP is what a scene and `kpsa eval` evaluate, whatever was asked for before.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "kpsa/library.h"
#include "kpsa/scene.h"
#include "tests/support/gltf_builder.h"
#include "tests/view/live_server.h"

namespace kpsa::engine {
namespace {

using Json = nlohmann::json;

struct Asked {
  std::vector<std::pair<std::string, double>> set;
  std::optional<std::string> clip;
  double time = 0;
  Json Request(const char* mode) const {
    Json request = {{"id", 7}, {"set", Json::object()}, {"clip", nullptr}, {"time", time}, {"mode", mode}};
    for (const auto& [plug, value] : set) request["set"][plug] = value;
    if (clip.has_value()) request["clip"] = *clip;
    return request;
  }
};

// Poses that come and go, so that what one leaves behind is seen in the next.
std::vector<Asked> Poses() {
  return {{{}, {}, 0},
          {{{"upper.rotateZ", -60}}, {}, 0},
          {{{"upper.rotateZ", -60}, {"upper.rotateX", 20}}, "wave", 0.5},
          {{}, "wave", 0.5},
          {{{"upper.rotateX", -12.5}}, "wave", 0.25},
          {{}, {}, 0},
          {{{"upper.rotateX", 20}}, {}, 0}};
}

std::vector<float> PointsOf(const kpsa::Rig& rig, const Asked& asked, kpsa::Verdict* verdict) {
  Scene scene(rig);
  EXPECT_TRUE(scene.Play(asked.clip));
  scene.SetTime(asked.time);
  for (const auto& [plug, value] : asked.set) EXPECT_TRUE(scene.Set(plug, value));
  const auto points = scene.Points("column");
  EXPECT_TRUE(points) << ToText(points.problems());
  if (!points) return {};
  *verdict = scene.verdict();
  return {points->begin(), points->end()};
}

TEST(LiveEvaluate, IsWhatAFreshSceneEvaluates) {
  const auto live = LiveServer::Hello(true);
  const auto rig = Library().Load(live->rig());
  ASSERT_TRUE(rig) << ToText(rig.problems());
  AccelerationOptions options;
  options.subspace = HelloSubspace();
  const auto accelerated = rig->Accelerated(options);
  ASSERT_TRUE(accelerated) << ToText(accelerated.problems());
  int hits = 0;
  for (const Asked& asked : Poses()) {
    const Evaluated both = live->Evaluate(asked.Request("both"));
    EXPECT_EQ(both.facts["id"], 7);
    EXPECT_EQ(both.facts["generation"], 1);
    EXPECT_EQ(both.facts["parts"], (Json{"accelerated", "full"}));
    kpsa::Verdict verdict;
    const std::vector<float> full = PointsOf(*rig, asked, &verdict);
    EXPECT_EQ(both.parts.at("full"), full);
    const std::vector<float> fast = PointsOf(*accelerated, asked, &verdict);
    EXPECT_EQ(both.parts.at("accelerated"), fast);
    EXPECT_EQ(both.facts["verdict"], verdict.hit ? "hit" : verdict.full_share < 1 ? "blend" : "miss");
    EXPECT_EQ(both.facts["reason"], verdict.reason);
    double most = 0;
    for (std::size_t i = 0; i < full.size(); i += 3) {
      most = std::max(most,
                      std::hypot(double{full[i]} - double{fast[i]}, double{full[i + 1]} - double{fast[i + 1]},
                                 double{full[i + 2]} - double{fast[i + 2]}));
    }
    EXPECT_NEAR(both.facts["max_error"].get<double>(), most, 1e-12);
    EXPECT_LE(both.facts["rms_error"].get<double>(), most);
    EXPECT_GE(both.facts["full_us"].get<double>(), 0);
    EXPECT_GE(both.facts["accelerated_us"].get<double>(), 0);
    hits += verdict.hit ? 1 : 0;
    // One side alone
    EXPECT_EQ(live->Evaluate(asked.Request("full")).parts,
              (std::map<std::string, std::vector<float>>{{"full", full}}));
    EXPECT_EQ(live->Evaluate(asked.Request("accelerated")).parts,
              (std::map<std::string, std::vector<float>>{{"accelerated", fast}}));
  }
  EXPECT_GT(hits, 0) << "nothing was reconstructed, so nothing was compared";
}

TEST(LiveEvaluate, HasTheBytesOfKpsaEval) {
  const auto live = LiveServer::Hello(true);
  const TemporaryFolder folder;
  for (const bool accelerated : {false, true}) {
    const std::string output = folder / (accelerated ? "fast.pc2" : "full.pc2");
    std::vector<std::string> arguments = {KPSA_PROGRAM, "eval", live->rig(), "--clip",           "wave",
                                          "--times",    "0.5",  "--set",     "upper.rotateX=20", "-o",
                                          output};
    if (accelerated) arguments.insert(arguments.end(), {"--kpsa", HelloSubspace()});
    std::string line;
    for (const std::string& word : arguments) line += "'" + word + "' ";
    ASSERT_EQ(std::system((line + "2> /dev/null").c_str()), 0) << line;
    const Asked asked{{{"upper.rotateX", 20}}, "wave", 0.5};
    const char* const side = accelerated ? "accelerated" : "full";
    const std::string bytes = TemporaryFolder::Read(output);
    const std::vector<float> points = live->Evaluate(asked.Request(side)).parts.at(side);
    const std::size_t size = points.size() * sizeof(float);
    ASSERT_GT(bytes.size(), size);
    EXPECT_EQ(bytes.substr(bytes.size() - size),
              std::string(reinterpret_cast<const char*>(points.data()), size));
  }
}

TEST(LiveEvaluate, EqualPosesCostNothing) {
  const auto live = LiveServer::Hello();
  const Asked asked{{{"upper.rotateZ", -33}}, "wave", 0.25};
  const Json first = live->Evaluate(asked.Request("full")).facts;
  // Nothing was evaluated, so nothing was measured anew
  EXPECT_EQ(live->Evaluate(asked.Request("full")).facts["full_us"], first["full_us"]);
}

// A morph weight that the clip drives, moved by the page.
TEST(LiveEvaluate, WhatIsMovedWinsOverTheClip) {
  LiveServer live("kpsa: 1\ncharacter: c.gltf\ncontrols:\n  body.weight[up]: {min: 0, max: 1}\n", "c.gltf",
                  GltfBuilder::Character().Text());
  const Asked clip{{}, "wave", 1.5}, rest{{}, {}, 0};
  const Evaluated played = live.Evaluate(clip.Request("full"));
  EXPECT_EQ(played.facts["values"]["body.weight[up]"], 1) << played.facts.dump();
  for (const double weight : {0.0, 0.25, 1.0}) {
    Asked moved = clip;
    moved.set = {{"body.weight[up]", weight}};
    const Evaluated evaluated = live.Evaluate(moved.Request("full"));
    EXPECT_EQ(evaluated.parts.at("full") == played.parts.at("full"), weight == 1) << weight;
    EXPECT_FALSE(evaluated.facts.contains("values")) << "the page knows it";
  }
  EXPECT_EQ(live.Evaluate(clip.Request("full")).parts, played.parts) << "and it lets go";
  EXPECT_NE(live.Evaluate(rest.Request("full")).parts, played.parts);
}

// What a node remembers is of the controls as they are asked for, and not as they were before.
TEST(LiveEvaluate, NodesRememberNoOtherPose) {
  const std::string scenes = KPSA_SCENES_DIR "/hello/";
  std::string yaml = TemporaryFolder::Read(scenes + "hello.yaml");
  yaml.replace(yaml.find("  mush:"), 0, "  wobble: {type: jiggle, stiffness: 0.3, damping: 0.2}\n");
  yaml.replace(yaml.find("cage, mush]"), 11, "cage, wobble, mush]");
  LiveServer live(yaml, "hello.glb", TemporaryFolder::Read(scenes + "hello.glb"));
  const auto rig = Library().Load(live.rig());
  ASSERT_TRUE(rig) << ToText(rig.problems());
  std::vector<Asked> poses = Poses();
  poses.push_back({{{"upper.rotateX", 20}}, "wave", 0.5});
  for (const Asked& asked : poses) {
    kpsa::Verdict verdict;
    EXPECT_EQ(live.Evaluate(asked.Request("full")).parts.at("full"), PointsOf(*rig, asked, &verdict));
  }
}

// Any other plug of a number may be set, too.
TEST(LiveEvaluate, TakesPlugsThatAreNoControls) {
  const auto live = LiveServer::Hello();
  const Asked rest{{}, {}, 0}, bent{{{"upper.rotateZ", -60}}, {}, 0},
      flat{{{"upper.rotateZ", -60}, {"mush.envelope", 0}}, {}, 0};
  const Evaluated first = live->Evaluate(bent.Request("full"));
  const Evaluated without = live->Evaluate(flat.Request("full"));
  EXPECT_NE(without.parts, first.parts);
  EXPECT_EQ(live->Evaluate(bent.Request("full")).parts, first.parts);
}

TEST(LiveEvaluate, RefusesWhatIsNoRequest) {
  const auto live = LiveServer::Hello();
  const auto problem = [&](const std::string& body) {
    const WebAnswer answer = live->Post("/evaluate", body);
    EXPECT_EQ(answer.status, 400) << body.substr(0, 100);
    const Json json = answer.json();
    return json.is_object() && !json["problems"].empty() ? json["problems"][0].value("message", "") : "none";
  };
  const auto has = [](const std::string& text, const char* part) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  has(problem(""), "no JSON");
  has(problem("{\"set\": {\"upper.rotateZ\": NaN}}"), "no JSON");
  has(problem("{\"set\": {\"upper.rotateZ\": 1e999}}"), "no JSON");
  has(problem("\xff\xfe"), "no JSON");
  has(problem("[]"), "no object");
  has(problem("{\"set\": 3}"), "expected plugs");
  has(problem("{\"set\": {\"upper.rotateZ\": null}}"), "expected a number");
  has(problem("{\"set\": {\"upper.rotateZ\": \"3\"}}"), "expected a number");
  has(problem("{\"set\": {\"mush.envelope\": 1e300}}"), "mush.envelope");
  has(problem("{\"set\": {\"mush.iterations\": 3}}"), "structural");
  has(problem("{\"set\": {\"squeeze.outValue\": 3}}"), "output");
  has(problem("{\"set\": {\"squeeze.input\": 3}}"), "driven by");
  has(problem("{\"set\": {\"upper.rotate\": 3}}"), "expected one number of it");
  has(problem("{\"clip\": \"nobody\"}"), "nobody");
  has(problem("{\"clip\": 3}"), "clip");
  has(problem("{\"time\": 1e12}"), "time");
  has(problem("{\"time\": \"now\"}"), "time");
  has(problem("{\"mode\": \"none\"}"), "mode");
  has(problem(std::string(100'000, '[')), "nested");
  has(problem("{\"set\": " + std::string(400'000, '{')), "nested");
  const Json nearest = live->Post("/evaluate", "{\"set\": {\"mush.envelop\": 1}}").json();
  has(nearest["problems"][0]["suggestion"], "did you mean \"envelope\"");
  EXPECT_EQ(live->Evaluate(Asked{}.Request("full")).facts["id"], 7);
}

}  // namespace
}  // namespace kpsa::engine
