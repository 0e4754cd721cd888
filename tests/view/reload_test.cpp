// A rig that is edited while it is viewed.
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <thread>

#include "tests/view/live_server.h"

namespace kpsa::engine {
namespace {

using Json = nlohmann::json;

std::string Replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

Json Bent(const char* mode = "full") { return {{"set", {{"upper.rotateZ", -60}}}, {"mode", mode}}; }

TEST(LiveEdits, ABrokenOneIsToldAndAMendedOneIsShown) {
  const auto live = LiveServer::Hello();
  const std::string good = TemporaryFolder::Read(live->rig());
  const Json first = live->Get("/events?after=-1").json();
  EXPECT_EQ(first["generation"], 1);
  EXPECT_TRUE(first["problems"].empty()) << first.dump();
  const Evaluated before = live->Evaluate(Bent());

  live->folder().Write("rig.yaml",
                       Replaced(good, "type: deltaMush, iterations", "type: deltaMush, iteration"));
  // A look may fall between the two steps of writing a file
  const Json broken = live->WaitFor(
      [](const Json& state) { return !state["problems"].empty() && state["problems"][0]["line"] == 8; });
  ASSERT_FALSE(broken["problems"].empty());
  const Json& problem = broken["problems"][0];
  EXPECT_EQ(problem["file"], live->rig());
  EXPECT_EQ(problem["line"], 8);
  EXPECT_EQ(problem["column"], 27) << problem.dump();
  EXPECT_EQ(problem["severity"], "error");
  EXPECT_NE(problem["message"].get<std::string>().find("iteration"), std::string::npos) << problem.dump();
  EXPECT_EQ(problem["suggestion"], "did you mean \"iterations\"?") << problem.dump();
  EXPECT_EQ(broken["generation"], 1);
  const Evaluated meanwhile = live->Evaluate(Bent());
  EXPECT_EQ(meanwhile.parts, before.parts) << "the last good rig goes on";
  EXPECT_EQ(meanwhile.facts["generation"], 1);

  live->folder().Write("rig.yaml", Replaced(good, "iterations: 10", "iterations: 40"));
  const Json mended = live->WaitFor([](const Json& state) { return state["generation"] != 1; });
  EXPECT_EQ(mended["generation"], 2);
  EXPECT_TRUE(mended["problems"].empty()) << mended.dump();
  EXPECT_GT(mended["serial"], broken["serial"]);
  const Evaluated after = live->Evaluate(Bent());
  EXPECT_EQ(after.facts["generation"], 2);
  EXPECT_NE(after.parts, before.parts);
  EXPECT_EQ(live->Get("/meta.json").json()["generation"], 2);
}

TEST(LiveEdits, TheCharacterIsLookedAtAsWell) {
  const auto live = LiveServer::Hello();
  const std::string glb = TemporaryFolder::Read(live->folder() / "hello.glb");
  std::filesystem::remove(live->folder() / "hello.glb");
  live->WaitFor([](const Json& state) { return !state["problems"].empty(); });
  live->folder().Write("hello.glb", glb);
  const Json back = live->WaitFor([](const Json& state) { return state["problems"].empty(); });
  EXPECT_EQ(back["generation"], 2);
}

TEST(LiveEdits, FilesOfShapesAreLookedAtAsWell) {
  const auto live = LiveServer::Hello();
  const auto shape = [&](double lift) {
    std::string text = "v 0 " + std::to_string(lift) + " 0\n";
    for (int v = 1; v < 794; ++v) text += "v 0 0 0\n";
    return live->folder().Write("lift.obj", text);
  };
  shape(0.25);
  std::string rig = TemporaryFolder::Read(live->rig());
  rig = Replaced(
      rig, "nodes:\n",
      "nodes:\n  fix: {type: blendShape, targets: {file: lift.obj, as: positions}, 'weight[lift]': 1}\n");
  live->folder().Write("rig.yaml", Replaced(rig, "[skin, cage, mush]", "[skin, cage, mush, fix]"));
  const Json first = live->WaitFor([](const Json& state) { return state["generation"] != 1; });
  const Evaluated before = live->Evaluate(Bent());
  shape(0.5);
  live->WaitFor([&](const Json& state) { return state["generation"] != first["generation"]; });
  EXPECT_NE(live->Evaluate(Bent()).parts, before.parts);
}

TEST(LiveEdits, ASubspaceThatNoLongerFitsIsAWarning) {
  const auto live = LiveServer::Hello(true);
  const std::string good = TemporaryFolder::Read(live->rig());
  live->folder().Write("rig.yaml", Replaced(good, "iterations: 10", "iterations: 11"));
  const Json stale = live->WaitFor([](const Json& state) { return state["generation"] != 1; });
  ASSERT_EQ(stale["problems"].size(), 1u) << stale.dump();
  EXPECT_EQ(stale["problems"][0]["severity"], "warning");
  EXPECT_EQ(live->Get("/meta.json").json()["accelerated"], false);
  EXPECT_EQ(live->Evaluate(Bent("both")).facts["parts"], Json{"full"});
  live->folder().Write("rig.yaml", good);
  const Json fits = live->WaitFor([](const Json& state) { return state["problems"].empty(); });
  EXPECT_EQ(fits["generation"], 3);
  EXPECT_EQ(live->Evaluate(Bent("both")).facts["parts"], (Json{"accelerated", "full"}));
}

TEST(LiveEdits, WaitingEndsWithTheServer) {
  const auto live = LiveServer::Hello();
  const Json now = live->Get("/events?after=-1").json();
  std::thread waits([&] {  // it would be answered after 20 s in any case
    const std::string path = "/events?after=" + now["serial"].dump();
    EXPECT_EQ(live->Get(path, live->Token(), 15).json(), now);
  });
  live->session().Stop();
  waits.join();
  for (const char* after : {"", "x", "-2", "1.5", "99999999999999999999"})
    EXPECT_EQ(live->Get(std::string("/events?after=") + after).status, 400) << after;
}

}  // namespace
}  // namespace kpsa::engine
