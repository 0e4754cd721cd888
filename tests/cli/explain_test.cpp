// kpsa explain: frames and vertices.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "tests/cli/refusals.h"

namespace kpsa::engine {
namespace {

const std::string kFace = KPSA_SCENES_DIR "/face/face.yaml";

class Explain : public RefusalTest {
 protected:
  nlohmann::json Tell(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), "explain");
    arguments.push_back("--json");
    std::string out;
    ExpectGood(arguments, &out);
    return nlohmann::json::parse(out, nullptr, false);
  }
  static const nlohmann::json& Row(const nlohmann::json& rows, const std::string& key,
                                   const std::string& name) {
    static const nlohmann::json kNone = nlohmann::json::object();
    for (const nlohmann::json& row : rows) {
      if (row[key] == name) return row;
    }
    ADD_FAILURE() << "no " << name << " in " << rows.dump();
    return kNone;
  }
  // The numbers of a plug at one frame, by kpsa get.
  std::vector<double> Get(const std::string& rig, const std::string& plug,
                          const std::vector<std::string>& how) const {
    std::vector<std::string> arguments = {"get", rig, plug, "--json"};
    arguments.insert(arguments.end(), how.begin(), how.end());
    std::string out;
    ExpectGood(arguments, &out);
    const nlohmann::json values = nlohmann::json::parse(out, nullptr, false)["plugs"][0]["values"][0];
    return values.is_array() ? values.get<std::vector<double>>() : std::vector<double>{values.get<double>()};
  }
};

TEST_F(Explain, AFrameTellsWhatChangedSinceTheOneBefore) {
  const nlohmann::json moving = Tell({kHello, "mush", "--frame", "12"});
  ASSERT_EQ(moving["steps"].size(), 1u);
  EXPECT_EQ(moving["steps"][0]["count"], 1);
  EXPECT_TRUE(std::string(moving["steps"][0]["dirtied_by"]).starts_with("time.time > "))
      << moving["steps"][0].dump();
  EXPECT_EQ(moving["steps"][0]["not_evaluated"], "");
  // The clip is over: nothing changes any more
  const nlohmann::json over = Tell({kHello, "mush", "--frame", "1000"});
  EXPECT_EQ(over["steps"][0]["count"], 0);
  EXPECT_NE(std::string(over["steps"][0]["not_evaluated"]).find("nothing that it reads has changed"),
            std::string::npos);
  std::string text;
  ExpectGood({"explain", kHello, "mush", "--frame", "1000"}, &text);
  EXPECT_NE(text.find("evaluated in 0 of 1 frame"), std::string::npos) << text;
  EXPECT_NE(text.find("skipped     nothing that it reads has changed"), std::string::npos) << text;
}

TEST_F(Explain, AVertexIsMovedByWhatItIsSaidToBe) {
  // Near the elbow, so that both joints hold it
  const std::vector<std::string> at = {"--frames", "12:12"};
  nlohmann::json story;
  int vertex = -1;
  for (int v = 380; v < 450 && vertex < 0; v += 10) {
    story = Tell({kHello, fmt::format("column[{}]", v), "--frame", "12"});
    if (story["joints"].size() == 2 && story["joints"][1]["weight"] > 0.2) vertex = v;
  }
  ASSERT_GE(vertex, 0);
  EXPECT_EQ(story["vertex"], vertex);
  double weights = 0;
  for (const nlohmann::json& joint : story["joints"]) weights += joint["weight"].get<double>();
  EXPECT_NEAR(weights, 1, 1e-6);
  EXPECT_GE(story["joints"][0]["weight"], story["joints"][1]["weight"]);

  // Positions are those of the evaluation, and stages move the point from one to the next
  const auto place = [&](const std::string& stage, const std::vector<std::string>& how) {
    const std::vector<double> all = Get(kHello, "column@" + stage, how);
    std::array<double, 3> p{};
    for (std::size_t i = 0; i < 3; ++i) p[i] = all.at(3 * static_cast<std::size_t>(vertex) + i);
    return p;
  };
  const auto distance = [](const std::array<double, 3>& a, const std::array<double, 3>& b) {
    return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
  };
  const auto skin = place("skin", at), cage = place("cage", at), mush = place("mush", at),
             rest = place("mush", {"--rest", "--times", "0"}),
             bound = place("skin", {"--rest", "--times", "0"});
  EXPECT_LT(distance(story["position_m"], mush), 1e-6);
  EXPECT_LT(distance(story["rest_m"], rest), 1e-6);
  EXPECT_NEAR(story["moved_m"].get<double>(), distance(mush, rest), 1e-6);
  EXPECT_NEAR(Row(story["stages"], "stage", "skin")["moved_m"].get<double>(), distance(skin, bound), 1e-6);
  EXPECT_NEAR(Row(story["stages"], "stage", "cage")["moved_m"].get<double>(), distance(skin, cage), 1e-6);
  EXPECT_NEAR(Row(story["stages"], "stage", "mush")["moved_m"].get<double>(), distance(cage, mush), 1e-6);
  EXPECT_GT(distance(skin, bound), 1e-3);

  // At rest nothing moves it, and what is set does
  const nlohmann::json still = Tell({kHello, fmt::format("column[{}]", vertex), "--rest"});
  EXPECT_LT(still["moved_m"], 1e-6);
  EXPECT_EQ(Row(still["joints"], "joint", "upper")["moved_m"], 0);
  const nlohmann::json set = Tell({kHello, fmt::format("column[{}]", vertex), "--rest", "--set",
                                   "upper.rotateZ=-30", "--set", "mush.envelope=0"});
  EXPECT_GT(Row(set["joints"], "joint", "upper")["moved_m"], 1e-4);
  EXPECT_EQ(Row(set["stages"], "stage", "mush")["envelope"], 0);
  EXPECT_EQ(Row(set["stages"], "stage", "mush")["moved_m"], 0);
}

// A mesh that is stored in thousandths, as quantized ones are: what a morph target moves is told as it comes out.
TEST_F(Explain, LengthsOfAMorphAreThoseOfTheWorld) {
  GltfBuilder b;
  std::vector<float> bind(16, 0.0f);
  for (const std::size_t k : {0u, 5u, 10u}) bind[k] = 0.001f;
  bind[15] = 1;
  const std::vector<float> positions = {0, 0, 0, 1000, 0, 0, 0, 1000, 0},
                           deltas = {0, 500, 0, 0, 0, 0, 0, 0, 0},
                           weights = {1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0};
  b.Push("meshes", {{"name", "sheet"},
                    {"weights", {0.5}},
                    {"extras", {{"targetNames", {"lift"}}}},
                    {"primitives",
                     {{{"attributes",
                        {{"POSITION", b.Accessor(positions, "VEC3")},
                         {"JOINTS_0", b.Accessor(std::vector<std::uint8_t>(12, 0), "VEC4")},
                         {"WEIGHTS_0", b.Accessor(weights, "VEC4")}}},
                       {"targets", {{{"POSITION", b.Accessor(deltas, "VEC3")}}}},
                       {"indices", b.Accessor(std::vector<std::uint16_t>{0, 1, 2}, "SCALAR")}}}}});
  b.Push("skins", {{"joints", {1}}, {"inverseBindMatrices", b.Accessor(bind, "MAT4")}});
  b.Push("nodes", {{"name", "sheet"}, {"mesh", 0}, {"skin", 0}});
  b.Push("nodes", {{"name", "root"}});
  b.Push("scenes", {{"nodes", {0, 1}}});
  b.root["scene"] = 0;
  const TemporaryFolder folder;
  const nlohmann::json story = Tell({folder.Write("m.gltf", b.Text()), "sheet[0]", "--rest"});
  ASSERT_EQ(story["morphs"].size(), 1u);
  EXPECT_NEAR(story["morphs"][0]["size_m"].get<double>(), 0.5, 1e-6);
  EXPECT_NEAR(Row(story["stages"], "stage", "morph")["moved_m"].get<double>(), 0.25, 1e-6);
}

TEST_F(Explain, MorphsAndWeightMapsOfAVertex) {
  const nlohmann::json weights =
      nlohmann::json::parse(TemporaryFolder::Read(KPSA_SCENES_DIR "/face/w/face.json"))["maps"]["upperLip"];
  const int vertex = weights["indices"][weights["indices"].size() / 2];
  const double weight = weights["values"][weights["indices"].size() / 2];
  const nlohmann::json story =
      Tell({kFace, fmt::format("face_mesh[{}]", vertex), "--clip", "extreme", "--frame", "30"});
  EXPECT_GE(Row(story["stages"], "stage", "upperLipWire")["weight"].get<double>(), weight - 1e-6);
  EXPECT_EQ(story["stages"][0]["stage"], "morph");
  ASSERT_GT(story["morphs"].size(), 0u);
  double most = 0;
  for (const nlohmann::json& morph : story["morphs"]) {
    const double now = Get(kFace, fmt::format("face_mesh.weight[{}]", morph["target"].get<std::string>()),
                           {"--clip", "extreme", "--frames", "30:30"})
                           .front();
    EXPECT_NEAR(morph["weight"].get<double>(), now, 1e-9);
    EXPECT_NEAR(morph["moved_m"].get<double>(), std::abs(now) * morph["size_m"].get<double>(), 1e-9);
    EXPECT_GT(morph["size_m"], 0);
    most += morph["moved_m"].get<double>();
  }
  EXPECT_LE(story["stages"][0]["moved_m"].get<double>(), most + 1e-6);
  std::string text;
  ExpectGood({"explain", kFace, fmt::format("face_mesh[{}]", vertex)}, &text);
  for (const char* word : {"rests at", "upperLipWire", "morph target", "joint"})
    EXPECT_NE(text.find(word), std::string::npos) << word << "\n" << text;
}

TEST_F(Explain, Refusals) {
  ExpectRefused({"explain", kHello, "colum[3]"}, 2,
                {"no mesh is called \"colum\"", "did you mean \"column\""});
  ExpectRefused({"explain", kHello, "column[100000]"}, 2, {"column[100000]", "out of range"});
  ExpectRefused({"explain", kHello, "column[-1]"}, 2, {"expected indices"});
  ExpectRefused({"explain", kHello, "column[1:3]"}, 2, {"expected one vertex"});
  ExpectRefused({"explain", kHello, "column[1]", "--frames", "0:3"}, 2, {"expected one frame, found 4"});
  ExpectRefused({"explain", kHello, "column[1]", "--accelerate"}, 2, {"full stack"});
  ExpectRefused({"explain", kHello, "mush", "--frame", "x"}, 2, {"--frame \"x\": expected a whole number"});
  ExpectRefused({"explain", kHello, "mush", "--frame", "1", "--frames", "1:2"}, 2, {"--frame and --frames"});
  ExpectRefused({"explain", kHello, "mish"}, 2, {"unknown node \"mish\"", "did you mean \"mush\""});
  ExpectRefused({"explain", kHello, "mush.iteration"}, 2, {"did you mean \"iterations\""});
}

}  // namespace
}  // namespace kpsa::engine
