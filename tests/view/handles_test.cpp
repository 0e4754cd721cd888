// Handles: where they are, and what a drag makes of their controls.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "base/matrix.h"
#include "graph/compiler.h"
#include "graph/evaluator.h"
#include "tests/view/live_server.h"

namespace kpsa::engine {
namespace {

using Json = nlohmann::json;

std::unique_ptr<LiveServer> HelloWith(const std::string& what, const std::string& instead) {
  const std::string scenes = KPSA_SCENES_DIR "/hello/";
  std::string yaml = TemporaryFolder::Read(scenes + "hello.yaml");
  const std::size_t at = yaml.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  yaml.replace(at, what.size(), instead);
  return std::make_unique<LiveServer>(yaml, "hello.glb", TemporaryFolder::Read(scenes + "hello.glb"));
}

// With a handle that moves, beside the one that turns.
std::unique_ptr<LiveServer> Moving() {
  return HelloWith("  upper.rotateX: {min: -30, max: 30}\n",
                   "  upper.rotateX: {min: -30, max: 30}\n"
                   "  upper.translateX: {min: -20, max: 20}\n  upper.translateY: {min: -20, max: 20}\n");
}

Double3 Vector(const Json& numbers, std::size_t at = 0) {
  return {numbers[at].get<double>(), numbers[at + 1].get<double>(), numbers[at + 2].get<double>()};
}
Json Triple(Double3 p) { return {p.x, p.y, p.z}; }

Json Asking(const Json& set) { return {{"set", set}, {"mode", "full"}, {"handles", true}}; }

// As the graph has it, in a pose of its controls.
Matrix4 MatrixOf(const Rig& rest, const std::string& node, const Json& set) {
  Rig rig = rest;
  for (const auto& [name, value] : set.items()) {
    for (const Control& control : rest.controls) {
      if (control.name != name) continue;
      const double number = value.get<double>() * rig.units.FactorOf(control.unit);
      EXPECT_TRUE(ApplySetting(&rig, {control.plug, number, name}).ok());
    }
  }
  Compiler compiler;
  const auto plan = compiler.Compile(*rig.graph, {{{*rig.graph->FindPlug(node + ".worldMatrix"), {}}}, {}});
  EXPECT_TRUE(plan.ok());
  Evaluator evaluator(*plan);
  EXPECT_TRUE(evaluator.Evaluate().ok());
  return evaluator.Get<Matrix4>(0);
}

double OffLine(Double3 point, Double3 from, Double3 along) {
  const Double3 unit = UnitOrZero(along), to = point - from;
  return Length(to - Dot(to, unit) * unit);
}

TEST(LiveHandles, AreWhatARigLetsOneTurnAndMove) {
  const auto live = Moving();
  const Json handles = live->Get("/meta.json").json()["handles"];
  ASSERT_EQ(handles.size(), 2u) << handles.dump();
  EXPECT_EQ(handles[0]["name"], "upper");
  EXPECT_EQ(handles[0]["kind"], "turn");
  EXPECT_EQ(handles[0]["controls"], (Json{"upper.rotateX", "upper.rotateZ"}));
  EXPECT_EQ(handles[1]["kind"], "move");
  EXPECT_EQ(handles[1]["controls"], (Json{"upper.translateX", "upper.translateY"}));
  // What is moved is at its own place; what is turned, on the surface, beyond the joint
  const Double3 own = Vector(handles[1]["position"]), held = Vector(handles[0]["position"]);
  const Matrix4 matrix = MatrixOf(live->session().rig()->rest(), "upper", Json::object());
  EXPECT_LT(Length(own - TransformPoint(matrix, {})), 1e-6);
  EXPECT_GT(held.y, own.y + 0.02);
  const WebAnswer rest = live->Get("/blob/" + live->Get("/meta.json").json()["rest"].get<std::string>());
  double nearest = 1;
  for (std::size_t i = 0; i + 12 <= rest.body.size(); i += 12) {
    float p[3];
    std::memcpy(p, rest.body.data() + i, 12);
    nearest = std::min(nearest, Length(Double3{p[0], p[1], p[2]} - held));
  }
  EXPECT_LT(nearest, 1e-6);
}

// Two nodes that move nearly the same have handles that can be told apart.
TEST(LiveHandles, StandApart) {
  const auto live = HelloWith("controls:\n",
                              "controls:\n  lower.rotateX: {min: -3, max: 3}\n"
                              "  lower.rotateZ: {min: -3, max: 3}\n");
  const Json handles = live->Get("/meta.json").json()["handles"];
  ASSERT_EQ(handles.size(), 2u);
  EXPECT_EQ(handles[0]["name"], "lower");
  EXPECT_GT(Length(Vector(handles[0]["position"]) - Vector(handles[1]["position"])), 0.01);
}

TEST(LiveHandles, AreNotThereWithoutControlsThatHaveAPlace) {
  const auto live =
      HelloWith("controls:\n  upper.rotateX: {min: -30, max: 30}\n  upper.rotateZ: {min: -75, max: 30}\n",
                "controls:\n  mush.envelope: {min: 0, max: 1}\n");
  EXPECT_FALSE(live->Get("/meta.json").json().contains("handles"));
  EXPECT_FALSE(live->Evaluate(Asking(Json::object())).facts.contains("handles"));
}

TEST(LiveHandles, GoWithTheirNodes) {
  const auto live = Moving();
  const Rig& rest = live->session().rig()->rest();
  const Json handles = live->Get("/meta.json").json()["handles"];
  Matrix4 to_node;
  ASSERT_TRUE(Invert(MatrixOf(rest, "upper", Json::object()), &to_node));
  for (const Json& set :
       {Json::object(), Json{{"upper.rotateZ", -60}}, Json{{"upper.rotateZ", 20}, {"upper.rotateX", -30}},
        Json{{"upper.translateX", 12}, {"upper.rotateZ", -33}}}) {
    const Json places = live->Evaluate(Asking(set)).facts["handles"];
    ASSERT_EQ(places.size(), 6u);
    for (std::size_t h = 0; h < 2; ++h) {
      const Double3 expected = TransformPoint(MatrixOf(rest, "upper", set),
                                              TransformPoint(to_node, Vector(handles[h]["position"])));
      EXPECT_LT(Length(Vector(places, 3 * h) - expected), 2e-6) << set.dump() << h;
    }
  }
  EXPECT_FALSE(live->Evaluate({{"mode", "full"}}).facts.contains("handles")) << "nobody asked";
}

TEST(LiveHandles, AreDraggedToTheLineOfThePointer) {
  const auto live = LiveServer::Hello();
  const Json target = {{"upper.rotateX", 17}, {"upper.rotateZ", -41}};
  const Double3 there = Vector(live->Evaluate(Asking(target)).facts["handles"]), eye{0.2, 0.3, 1.5};
  Json request = Asking({{"upper.rotateZ", 5}});
  request["drag"] = {{"handle", 0}, {"from", Triple(eye)}, {"along", Triple(there - eye)}};
  const Evaluated dragged = live->Evaluate(request);
  ASSERT_TRUE(dragged.facts.contains("dragged")) << dragged.facts.dump();
  EXPECT_LT(OffLine(Vector(dragged.facts["handles"]), eye, there - eye), 1e-5);
  EXPECT_EQ(dragged.facts["dragged"].size(), 2u);
  // What is shown is of that pose, to the bit
  const Evaluated again = live->Evaluate(Asking(dragged.facts["dragged"]));
  ASSERT_EQ(again.parts.at("full").size(), dragged.parts.at("full").size());
  double most = 0;
  for (std::size_t i = 0; i < again.parts.at("full").size(); ++i)
    most = std::max(most, std::abs(double{again.parts.at("full")[i]} - double{dragged.parts.at("full")[i]}));
  EXPECT_LT(most, 1e-6);
  EXPECT_GT(Length(Vector(live->Evaluate(Asking(Json::object())).facts["handles"]) - there), 0.01)
      << "the drag was one";
}

TEST(LiveHandles, StopAtTheEndsOfTheirRanges) {
  const auto live = Moving();
  Json request = Asking(Json::object());
  request["drag"] = {{"handle", 1}, {"from", {9, 9, 1}}, {"along", {0, 0, -1}}};
  const Json set = live->Evaluate(request).facts["dragged"];
  EXPECT_EQ(set.size(), 2u);
  for (const auto& [name, value] : set.items()) EXPECT_NEAR(std::abs(value.get<double>()), 20, 1e-9) << name;
}

TEST(LiveHandles, AreDraggedOverAClip) {
  const auto live = LiveServer::Hello();
  Json clip = Asking(Json::object());
  clip["clip"] = "wave", clip["time"] = 0.5;
  const Evaluated played = live->Evaluate(clip);
  const Double3 before = Vector(played.facts["handles"]), eye{0.1, 0.2, 1.5};
  // From where the clip has it: a drag to there changes nothing
  Json still = clip;
  still["drag"] = {{"handle", 0}, {"from", Triple(eye)}, {"along", Triple(before - eye)}};
  const Json stays = live->Evaluate(still).facts;
  EXPECT_LT(Length(Vector(stays["handles"]) - before), 1e-5);
  // Controls come on top of what the clip does
  for (const auto& [name, value] : stays["dragged"].items())
    EXPECT_NEAR(value.get<double>(), 0, 1e-3) << name;
  const Double3 wanted = before + Double3{0.02, -0.01, 0};
  Json drag = clip;
  drag["drag"] = {{"handle", 0}, {"from", Triple(eye)}, {"along", Triple(wanted - eye)}};
  const Evaluated dragged = live->Evaluate(drag);
  EXPECT_LT(OffLine(Vector(dragged.facts["handles"]), eye, wanted - eye), 1e-5);
  EXPECT_NE(dragged.parts, played.parts);
}

// A pin on a surface that wobbles: what it would take to drag it is all frames before, for every value that is tried.
TEST(LiveHandles, AreNotDraggedWhereTheyRememberOtherFrames) {
  const std::string scenes = KPSA_SCENES_DIR "/hello/";
  std::string yaml = TemporaryFolder::Read(scenes + "hello.yaml");
  yaml.replace(yaml.find("  mush:"), 0,
               "  wobble: {type: jiggle, stiffness: 0.3, damping: 0.2}\n"
               "  pins: {type: uvPin, driver: column, face: [900]}\n"
               "  ball: {type: transform, offsetParentMatrix: \"pins.outputMatrix[0]\"}\n");
  yaml.replace(yaml.find("cage, mush]"), 11, "cage, wobble, mush]");
  yaml.replace(yaml.find("controls:\n") + 10, 0, "  ball.translateX: {min: -5, max: 5}\n");
  LiveServer live(yaml, "hello.glb", TemporaryFolder::Read(scenes + "hello.glb"));
  const Json handles = live.Get("/meta.json").json()["handles"];
  ASSERT_EQ(handles.size(), 2u) << handles.dump();
  EXPECT_EQ(handles[0]["name"], "ball");
  const auto drag = [&](std::size_t handle) {
    Json request = Asking(Json::object());
    request["drag"] = {{"handle", handle}, {"from", {0.1, 0.2, 1}}, {"along", {0, 0, -1}}};
    return live.Post("/evaluate", request.dump());
  };
  const WebAnswer refused = drag(0);
  EXPECT_EQ(refused.status, 400);
  EXPECT_NE(refused.body.find("where ball is depends on wobble"), std::string::npos) << refused.body;
  EXPECT_EQ(drag(1).status, 200) << "the joint does not depend on it";
  EXPECT_EQ(drag(0).status, 400);
}

TEST(LiveHandles, RefuseWhatIsNoDrag) {
  const auto live = LiveServer::Hello();
  const auto problem = [&](const Json& drag) {
    Json request = Asking(Json::object());
    request["drag"] = drag;
    const WebAnswer answer = live->Post("/evaluate", request.dump());
    EXPECT_EQ(answer.status, 400) << drag.dump();
    return answer.json()["problems"][0].value("message", "");
  };
  const auto has = [](const std::string& text, const char* part) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  const Json from = {0, 0, 1}, along = {0, 0, -1};
  has(problem(3), "expected a handle");
  has(problem({{"from", from}, {"along", along}}), "its number");
  has(problem({{"handle", -1}, {"from", from}, {"along", along}}), "its number");
  has(problem({{"handle", 0.5}, {"from", from}, {"along", along}}), "its number");
  has(problem({{"handle", 1}, {"from", from}, {"along", along}}), "below 1");
  has(problem({{"handle", 0}, {"along", along}}), "from: expected three numbers");
  has(problem({{"handle", 0}, {"from", {0, 0}}, {"along", along}}), "from: expected three numbers");
  has(problem({{"handle", 0}, {"from", {0, 0, "1"}}, {"along", along}}), "from: expected three numbers");
  has(problem({{"handle", 0}, {"from", from}, {"along", {0, 0, 0}}}), "direction");
  has(problem({{"handle", 0}, {"from", from}, {"along", {1e300, 1e300, 0}}}), "direction");
  Json handles = Asking(Json::object());
  handles["handles"] = 1;
  has(live->Post("/evaluate", handles.dump()).json()["problems"][0].value("message", ""), "true or false");
}

}  // namespace
}  // namespace kpsa::engine
