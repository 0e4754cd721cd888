// Pose files, and what is told of a vertex.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <tuple>

#include "host/explain/vertex_story.h"
#include "report/vertex_text.h"
#include "tests/support/gltf_builder.h"
#include "tests/view/live_server.h"

namespace kpsa::engine {
namespace {

using Json = nlohmann::json;

TEST(LivePoseFiles, AreReadAsTheProgramReadsThem) {
  const auto live = LiveServer::Hello();
  const auto read = [&](const std::string& text) { return live->Post("/pose-file", text).json(); };
  const Json set = {{"upper.rotateX", 10.0}, {"upper.rotateZ", -20.5}};
  EXPECT_EQ(read("{\"upper.rotateX\": 10, \"upper.rotateZ\": -20.5}")["set"].dump(), set.dump())
      << "as the page saves it";
  const Json yaml =
      read("kpsa: 1\nclip: wave\ntime: 0.5\npose: {upper.rotateX: 10deg, upper.rotateZ: -20.5}\n");
  EXPECT_NEAR(yaml["set"]["upper.rotateX"].get<double>(), 10, 1e-12);
  EXPECT_EQ(yaml["clip"], "wave");
  EXPECT_EQ(yaml["time"], 0.5);
  const Json vector = read("kpsa: 1\npose: {upper.translate: [1, 2mm, 3]}\n")["set"];
  EXPECT_NEAR(vector["upper.translateY"].get<double>(), 0.2, 1e-12) << vector.dump();
  EXPECT_EQ(read("{}")["set"], Json::object());
}

TEST(LivePoseFiles, MistakesHaveTheirPlaces) {
  const auto live = LiveServer::Hello();
  const WebAnswer answer = live->Post("/pose-file", "kpsa: 1\npose:\n  upper.rotatX: 3\n");
  EXPECT_EQ(answer.status, 400);
  EXPECT_EQ(answer.json()["problems"][0]["line"], 3) << answer.body;
  EXPECT_EQ(answer.json()["problems"][0]["column"], 3);
  std::string aliases = "a: &a [1,1]\n";
  for (char c = 'b'; c < 'z'; ++c)
    aliases += std::string(1, c) + ": &" + c + " [*" + char(c - 1) + ",*" + char(c - 1) + "]\n";
  for (const std::string& text :
       {std::string(), std::string("[]"), std::string("- 3"), std::string("\0\1", 2),
        std::string("{upper.rotateZ: .nan}"), std::string("{upper.rotateZ: 1e999}"), std::string("{mush: 3}"),
        std::string(100'000, '['), std::string("\xff"), std::string("{squeeze.outValue: 3}"), aliases}) {
    const WebAnswer refused = live->Post("/pose-file", text);
    EXPECT_EQ(refused.status, 400) << text.substr(0, 60);
    EXPECT_FALSE(refused.json()["problems"].empty());
  }
}

TEST(LiveExplain, SaysWhatKpsaExplainSays) {
  const auto live = LiveServer::Hello();
  live->Evaluate({{"set", {{"upper.rotateZ", -60}}}, {"clip", "wave"}, {"time", 0.5}, {"mode", "full"}});
  const Rig& rest = live->session().rig()->rest();
  const std::size_t vertex = live->session().rig()->vertices() - 1;
  const Json answer = live->Get("/explain?vertex=" + std::to_string(vertex)).json();
  Rig posed = rest;
  ASSERT_TRUE(SetClip(&posed, "wave").ok());
  const Result<Setting> setting = ParseSetting(posed, "upper.rotateZ=-60");
  ASSERT_TRUE(setting.ok());
  ASSERT_TRUE(ApplySetting(&posed, *setting).ok());
  const auto story = TellOfVertex(posed, rest, {&posed.scene.meshes[0], static_cast<Index>(vertex)}, 0.5);
  ASSERT_TRUE(story.ok()) << story.status().ToString();
  std::string text;
  for (const Json& line : answer["lines"]) text += line.get<std::string>() + "\n";
  EXPECT_EQ(text, VertexText(*story));
}

TEST(LiveExplain, TriesEveryControlAtItsEnds) {
  const auto live = LiveServer::Hello();
  const std::size_t vertices = live->session().rig()->vertices();
  const Json now = {{"set", {{"upper.rotateX", 10}}}, {"mode", "full"}};
  std::size_t moved = 0;
  for (const std::size_t vertex : {std::size_t{0}, vertices / 2, vertices - 1}) {
    const std::vector<float> here = live->Evaluate(now).parts.at("full");
    const Json answer = live->Get("/explain?vertex=" + std::to_string(vertex)).json();
    std::map<std::string, double> told;
    double before = INFINITY;
    for (const Json& control : answer["moved_by"]) {
      told[control["name"]] = control["metres"];
      EXPECT_LE(control["metres"].get<double>(), before) << "largest first";
      before = control["metres"];
    }
    for (const auto& [plug, low, high] : {std::tuple{"upper.rotateX", -30, 30}, {"upper.rotateZ", -75, 30}}) {
      double most = 0;
      for (const int end : {low, high}) {
        Json there = now;
        there["set"][plug] = end;
        const std::vector<float> points = live->Evaluate(there).parts.at("full");
        double square = 0;
        for (std::size_t c = 3 * vertex; c < 3 * vertex + 3; ++c) square += std::pow(points[c] - here[c], 2);
        most = std::max(most, std::sqrt(square));
      }
      EXPECT_NEAR(told.contains(plug) ? told[plug] : 0, most, 1e-6) << vertex << " " << plug;
      moved += most > 0.001 ? 1 : 0;
    }
  }
  EXPECT_GT(moved, 1u);
}

// A weight that the clip drives is tried from where the clip has it.
TEST(LiveExplain, TriesWhatTheClipDrives) {
  LiveServer live("kpsa: 1\ncharacter: c.gltf\ncontrols:\n  body.weight[up]: {min: 0, max: 1}\n", "c.gltf",
                  GltfBuilder::Character().Text());
  live.Evaluate({{"clip", "wave"}, {"time", 1.5}, {"mode", "full"}});
  const Json answer = live.Get("/explain?vertex=1").json();
  ASSERT_EQ(answer["moved_by"].size(), 1u) << answer.dump();
  EXPECT_NEAR(answer["moved_by"][0]["metres"].get<double>(), 2, 1e-6);
}

TEST(LiveExplain, RefusesWhatIsNoVertex) {
  const auto live = LiveServer::Hello();
  for (const std::string& vertex :
       {std::string(), std::string("-1"), std::string("x"), std::string("1.5"), std::string("1e3"),
        std::to_string(live->session().rig()->vertices()), std::string("99999999999999999999")})
    EXPECT_EQ(live->Get("/explain?vertex=" + vertex).status, 400) << vertex;
}

}  // namespace
}  // namespace kpsa::engine
