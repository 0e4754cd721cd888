// States of a scene: what is told of them when something fails, nodes that remember, functions of the program.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "kpsa/kpsa.h"
#include "tests/support/temporary_folder.h"

namespace {

using kpsa::Done;
using kpsa::GraphEdit;
using kpsa::Library;
using kpsa::NodeAttribute;
using kpsa::NodeCall;
using kpsa::NodeType;
using kpsa::Problem;
using kpsa::Rig;
using kpsa::Scene;

class SceneStates : public testing::Test {
 protected:
  SceneStates() {
    std::filesystem::copy(Scenes("hello.glb"), Path("hello.glb"));
    std::ifstream file(Scenes("hello.yaml"));
    std::stringstream text;
    text << file.rdbuf();
    hello_ = text.str();
  }
  static std::string Scenes(const std::string& name) {
    return std::string(KPSA_SCENES_DIR) + "/hello/" + name;
  }
  std::string Path(const std::string& name) const { return folder_.path() + "/" + name; }
  // The bundled rig with a part of its text replaced.
  Rig Load(const Library& library, const std::string& from = "", const std::string& to = "") {
    std::string text = hello_;
    if (!from.empty()) {
      EXPECT_NE(text.find(from), std::string::npos);
      text.replace(text.find(from), from.size(), to);
    }
    folder_.Write("hello.yaml", text);
    auto rig = library.Load(Path("hello.yaml"));
    EXPECT_TRUE(rig) << kpsa::ToText(rig.problems());
    return *rig;
  }
  static std::vector<float> Pull(Scene* scene) {
    const auto points = scene->Points("column");
    EXPECT_TRUE(points) << kpsa::ToText(points.problems());
    return points ? std::vector<float>(points->begin(), points->end()) : std::vector<float>();
  }
  static std::vector<std::vector<float>> AllFrames(Scene* scene, const std::vector<double>& seconds) {
    std::vector<std::vector<float>> frames;
    const auto done = scene->Frames(seconds, [&](const kpsa::Frame& frame) {
      frames.emplace_back(frame.points[0].begin(), frame.points[0].end());
      return true;
    });
    EXPECT_TRUE(done) << kpsa::ToText(done.problems());
    return frames;
  }
  // "picky": its input, unless that is below 0.
  static NodeType Picky() {
    NodeType type{.name = "picky", .inputs = {{"input"}}, .outputs = {{"output"}}};
    type.compute = [](const NodeCall& call) -> std::string {
      call.outputs[0][0] = call.inputs[0][0];
      return call.inputs[0][0] < 0 ? "the input is below zero" : "";
    };
    return type;
  }
  // A rig file with a picky node that scales the mush.
  Rig LoadPicky(Library* library) {
    const auto added = library->AddNode(Picky());
    EXPECT_TRUE(added) << kpsa::ToText(added.problems());
    return Load(*library, "  mush: {type: deltaMush, iterations: 10}\nconnections:\n",
                "  mush: {type: deltaMush, iterations: 10}\n  choosy: {type: picky, input: 1}\n"
                "connections:\n  - choosy.output -> mush.envelope\n");
  }
  kpsa::engine::TemporaryFolder folder_;
  std::string hello_;
};

template <typename R>
Problem Failed(const R& result) {
  EXPECT_FALSE(result);
  return result ? Problem() : result.problems().front();
}

TEST_F(SceneStates, WhatDoesNotEvaluateIsToldWithItsNodeAndPlace) {
  Library library;
  const Rig rig = LoadPicky(&library);
  Scene scene(rig);
  const std::vector<float> rest = Pull(&scene);
  ASSERT_TRUE(scene.Set("choosy.input", -1));
  const auto is_told = [&](const Problem& problem) {
    EXPECT_EQ(problem.kind, Problem::Kind::kEvaluation);
    EXPECT_EQ(problem.node, "choosy");
    EXPECT_EQ(problem.file, Path("hello.yaml"));
    EXPECT_EQ(problem.line, 9);
    EXPECT_NE(problem.message.find("below zero"), std::string::npos) << problem.message;
  };
  is_told(Failed(scene.Points("column")));
  is_told(Failed(scene.Points("column")));
  is_told(Failed(scene.Values("choosy.output")));
  const std::vector<double> seconds{0.5};
  is_told(Failed(scene.Profile(seconds)));
  is_told(Failed(scene.Frames(seconds, [](const kpsa::Frame&) { return true; })));
  EXPECT_TRUE(scene.Points("column@skin")) << "which does not need it";
  ASSERT_TRUE(scene.Set("choosy.input", 1));
  EXPECT_EQ(Pull(&scene), rest);
  // What is refused at once has them, too
  EXPECT_EQ(Failed(scene.Set("mush.iterations", 1)).node, "mush");
  EXPECT_EQ(Failed(scene.Set("mush.iterations", 1)).line, 8);
  EXPECT_EQ(Failed(scene.Set("mush.nothing", 1)).file, Path("hello.yaml"));
  EXPECT_EQ(Failed(scene.Points("colum")).file, Path("hello.yaml"));
}

TEST_F(SceneStates, FramesAndProfilesAreOfTheMeshesAlone) {
  Library library;
  ASSERT_TRUE(library.AddNode(Picky()));
  const Rig rig = Load(library, "  mush: {", "  choosy: {type: picky, input: -1}\n  mush: {");
  Scene scene(rig);
  EXPECT_FALSE(scene.Values("choosy.output"));
  EXPECT_FALSE(scene.Values("choosy.output")) << "asked for and failing, which is nobody else's matter";
  ASSERT_TRUE(scene.Set("choosy.input", 2));
  ASSERT_TRUE(scene.Values("choosy.output"));
  ASSERT_TRUE(scene.Play("wave"));
  ASSERT_TRUE(scene.Values("choosy.output"));
  ASSERT_TRUE(scene.Set("choosy.input", -1));
  const std::vector<double> seconds{0.1, 0.2};
  EXPECT_EQ(AllFrames(&scene, seconds).size(), 2u);
  const auto steps = scene.Profile(seconds);
  ASSERT_TRUE(steps) << kpsa::ToText(steps.problems());
  EXPECT_TRUE(std::ranges::none_of(*steps, [](const auto& step) { return step.node == "choosy"; }));
}

TEST_F(SceneStates, FramesAreOfWhatTheSceneHeldWhenTheyBegan) {
  const Rig rig = Load(Library());
  Scene scene(rig);
  ASSERT_TRUE(scene.Set("upper.rotateX", 10));
  std::vector<double> seconds;
  for (int frame = 0; frame < 40; ++frame) seconds.push_back(frame / rig.fps());
  const std::vector<std::vector<float>> expected = AllFrames(&scene, seconds);
  std::vector<std::vector<float>> frames;
  ASSERT_TRUE(scene.Frames(
      seconds,
      [&](const kpsa::Frame& frame) {
        frames.emplace_back(frame.points[0].begin(), frame.points[0].end());
        EXPECT_TRUE(scene.Set("upper.rotateX", 20 - static_cast<double>(frame.index % 40)));
        EXPECT_TRUE(scene.Points("column@skin"));
        EXPECT_TRUE(scene.Play(frame.index % 2 == 0 ? std::optional<std::string>("wave") : std::nullopt));
        return true;
      },
      {.threads = 3}));
  EXPECT_EQ(frames, expected);
}

TEST_F(SceneStates, OnTheWayOnlyWhatIsAskedForMayNotFail) {
  Library library;
  ASSERT_TRUE(library.AddNode(Picky()));
  const Rig rig = Load(library, "  mush: {type: deltaMush, iterations: 10}\n",
                       "  mush: {type: deltaMush, iterations: 10}\n  lag: {type: jiggle, stiffness: 0.2}\n"
                       "  choosy: {type: picky}\n");
  auto with_lag = rig.Edited([](GraphEdit& edit) { return edit.Deform("column", "lag"); });
  ASSERT_TRUE(with_lag) << kpsa::ToText(with_lag.problems());
  Scene scene(*with_lag), other(*with_lag);
  for (Scene* one : {&scene, &other}) {
    ASSERT_TRUE(one->Play("wave"));
    one->SetTime(0.5);
  }
  ASSERT_TRUE(scene.Values("choosy.output"));
  ASSERT_TRUE(scene.Set("choosy.input", -1));
  scene.SetTime(0);
  (void)Pull(&scene);
  scene.SetTime(0.5);
  EXPECT_EQ(Pull(&scene), Pull(&other));
  EXPECT_FALSE(scene.Values("choosy.output"));
}

TEST_F(SceneStates, ARunUpIsCancelled) {
  std::atomic<bool> cancel = false;
  int calls = 0;
  NodeType type{.name = "ender", .inputs = {{"input"}}, .outputs = {{"output"}}};
  type.compute = [&](const NodeCall& call) -> std::string {
    if (++calls == 5) cancel = true;
    call.outputs[0][0] = 1;
    return "";
  };
  Library library;
  ASSERT_TRUE(library.AddNode(type));
  const Rig rig = Load(library, "  mush: {type: deltaMush, iterations: 10}\nconnections:\n",
                       "  mush: {type: deltaMush, iterations: 10}\n  lag: {type: jiggle}\n"
                       "  ender: {type: ender, input: upper.poseRotateZ}\n"
                       "connections:\n  - ender.output -> mush.envelope\n");
  auto with_lag = rig.Edited([](GraphEdit& edit) { return edit.Deform("column", "lag"); });
  ASSERT_TRUE(with_lag) << kpsa::ToText(with_lag.problems());
  Scene scene(*with_lag);
  ASSERT_TRUE(scene.Play("wave"));
  calls = 0;
  const auto done = scene.Frames(std::vector<double>{20 / rig.fps()}, [](const kpsa::Frame&) { return true; },
                                 {.cancel = &cancel});
  ASSERT_FALSE(done);
  EXPECT_EQ(done.problems()[0].kind, Problem::Kind::kInterrupted);
  EXPECT_EQ(calls, 5) << "it goes no further";
}

TEST_F(SceneStates, ARunUpAsksWhetherToGoOn) {
  const Rig rig = Load(Library(), "  mush: {type: deltaMush, iterations: 10}\n",
                       "  mush: {type: deltaMush, iterations: 10}\n  lag: {type: jiggle, stiffness: 0.2}\n");
  auto with_lag = rig.Edited([](GraphEdit& edit) { return edit.Deform("column", "lag"); });
  ASSERT_TRUE(with_lag) << kpsa::ToText(with_lag.problems());
  Scene scene(*with_lag), other(*with_lag);
  for (Scene* one : {&scene, &other}) {
    ASSERT_TRUE(one->Play("wave"));
    one->SetTime(20 / rig.fps());
  }
  int asked = 0;
  const auto is_ended = [&](const Problem& problem) {
    EXPECT_EQ(problem.kind, Problem::Kind::kInterrupted) << problem.message;
    EXPECT_EQ(std::exchange(asked, 0), 5) << "it goes no further";
  };
  scene.WatchRunUp([&] { return ++asked < 5; });
  const std::vector<double> seconds{20 / rig.fps()};
  is_ended(Failed(scene.Points("column")));
  is_ended(Failed(scene.Values("upper.worldMatrix")));
  is_ended(Failed(scene.Profile(seconds)));
  is_ended(Failed(scene.Frames(seconds, [](const kpsa::Frame&) { return true; })));
  scene.WatchRunUp({});
  EXPECT_EQ(Pull(&scene), Pull(&other)) << "nothing is left of them";
}

TEST_F(SceneStates, NodesThatRememberComeToATimeThroughAllFramesBeforeIt) {
  const Rig rig = Load(
      Library(), "  mush: {type: deltaMush, iterations: 10}\n",
      "  mush: {type: deltaMush, iterations: 10}\n  lag: {type: jiggle, stiffness: 0.2, damping: 0.1}\n");
  auto with_lag = rig.Edited([](GraphEdit& edit) { return edit.Deform("column", "lag"); });
  ASSERT_TRUE(with_lag) << kpsa::ToText(with_lag.problems());
  Scene scene(*with_lag), exact(rig);
  std::vector<double> seconds;
  for (int frame = 0; frame < 20; ++frame) seconds.push_back(frame / rig.fps());
  for (Scene* one : {&scene, &exact}) ASSERT_TRUE(one->Play("wave"));
  const std::vector<std::vector<float>> frames = AllFrames(&scene, seconds);
  ASSERT_EQ(frames.size(), seconds.size());
  for (const std::size_t frame : {7u, 3u, 12u, 12u, 13u, 0u, 19u}) {
    scene.SetTime(seconds[frame]);
    EXPECT_EQ(Pull(&scene), frames[frame]) << frame;
  }
  exact.SetTime(seconds[12]);
  EXPECT_NE(Pull(&exact), frames[12]) << "it lags";
  // Frames in any order, and some of them
  const std::vector<std::vector<float>> some = AllFrames(&scene, {seconds[12], seconds[3], seconds[7]});
  EXPECT_EQ(some, (std::vector{frames[12], frames[3], frames[7]}));
  // Another output on the way changes nothing
  scene.SetTime(seconds[5]);
  ASSERT_TRUE(scene.Values("upper.worldMatrix"));
  scene.SetTime(seconds[9]);
  EXPECT_EQ(Pull(&scene), frames[9]);
  // Nor does a time between frames, or before the first one
  for (const double other : {12.4 / rig.fps(), -0.7 / rig.fps()}) {
    scene.SetTime(other);
    (void)Pull(&scene);
    scene.SetTime(seconds[13]);
    EXPECT_EQ(Pull(&scene), frames[13]) << other;
  }
  EXPECT_EQ(AllFrames(&scene, {12.4 / rig.fps(), seconds[13]})[1], frames[13]);
  EXPECT_TRUE(scene.Profile(seconds));
  EXPECT_TRUE(scene.Profile(std::vector<double>{seconds[4], seconds[1]}));
  const double never = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(scene.Profile(std::vector<double>{never}));
  EXPECT_FALSE(scene.Frames(std::vector<double>{0, never}, [](const kpsa::Frame&) { return true; }));
  // A node of an edit follows the scene's time as one of the file does
  const auto added = Load(Library()).Edited([](GraphEdit& edit) -> kpsa::Result<Done> {
    if (auto done = edit.AddNode("jiggle", "lag"); !done) return done;
    if (auto done = edit.Set("lag.stiffness", 0.2); !done) return done;
    if (auto done = edit.Set("lag.damping", 0.1); !done) return done;
    return edit.Deform("column", "lag");
  });
  ASSERT_TRUE(added) << kpsa::ToText(added.problems());
  Scene again(*added);
  ASSERT_TRUE(again.Play("wave"));
  again.SetTime(seconds[12]);
  EXPECT_EQ(Pull(&again), frames[12]);
}

TEST_F(SceneStates, ConnectionsOfEditsConvertUnitsAsThoseOfFilesDo) {
  const Rig file =
      Load(Library(), "  mush: {type: deltaMush, iterations: 10}\nconnections:\n",
           "  mush: {type: deltaMush, iterations: 10}\n"
           "  angle: {type: unitConversion}\n  length: {type: unitConversion}\n"
           "  turned: {type: transform}\n  moved: {type: transform}\n"
           "connections:\n  - upper.poseRotateZ -> angle.input\n  - moved.translateX -> length.input\n"
           "  - angle.output -> turned.rotateY\n  - length.output -> turned.translateY\n"
           "  - moved.translate -> turned.scale\n");
  const auto edited = Load(Library()).Edited([](GraphEdit& edit) -> kpsa::Result<Done> {
    for (const auto& [type, name] :
         {std::pair("unitConversion", "angle"), std::pair("unitConversion", "length"),
          std::pair("transform", "turned"), std::pair("transform", "moved")}) {
      if (auto done = edit.AddNode(type, name); !done) return done;
    }
    for (const auto& [from, to] :
         {std::pair("upper.poseRotateZ", "angle.input"), std::pair("moved.translateX", "length.input"),
          std::pair("moved.translateX", "turned.rotateY"),  // which gives way
          std::pair("angle.output", "turned.rotateY"), std::pair("length.output", "turned.translateY"),
          std::pair("moved.translate", "turned.scale")}) {
      if (auto done = edit.Connect(from, to); !done) return done;
    }
    return edit.Set("upper.rotateX", 12);
  });
  ASSERT_TRUE(edited) << kpsa::ToText(edited.problems());
  Scene by_file(file), by_edit(*edited);
  for (Scene* scene : {&by_file, &by_edit}) {
    ASSERT_TRUE(scene->Set("upper.rotateX", 0));
    ASSERT_TRUE(scene->Set("upper.rotateZ", -60));
    ASSERT_TRUE(scene->Set("moved.translateX", 30));
  }
  EXPECT_NEAR((*by_edit.Values("angle.output"))[0], -60, 1e-6);
  EXPECT_NEAR((*by_edit.Values("length.output"))[0], 30, 1e-9);
  EXPECT_NEAR((*by_edit.Values("turned.scale"))[0], 30, 1e-9);
  for (const char* plug : {"angle.output", "length.output", "turned.worldMatrix"})
    EXPECT_EQ(*by_edit.Values(plug), *by_file.Values(plug)) << plug;
  EXPECT_NEAR(edited->controls()[0].value, 12, 1e-9) << "where the edit has set it";
  EXPECT_NEAR(file.controls()[0].value, 0, 1e-9);
  const auto cycle = Load(Library()).Edited([](GraphEdit& edit) -> kpsa::Result<Done> {
    if (auto done = edit.AddNode("unitConversion", "angle"); !done) return done;
    if (auto done = edit.Connect("upper.poseRotateZ", "angle.input"); !done) return done;
    const auto refused = edit.Connect("angle.output", "upper.rotateZ");
    EXPECT_NE(Failed(refused).message.find("cycle"), std::string::npos);
    EXPECT_EQ(Failed(refused).node, "upper");
    return edit.Set("mush.iterations", 2);
  });
  EXPECT_TRUE(cycle) << "what was refused has changed nothing: " << kpsa::ToText(cycle.problems());
}

TEST_F(SceneStates, FunctionsOfTheProgramComputeNodes) {
  Library library;
  ASSERT_TRUE(library.AddNode(Picky()));
  NodeType push{
      .name = "push", .inputs = {{"by", NodeAttribute::Type::kVector, {0, 0, 1}}}, .deformer = true};
  push.compute = [](const NodeCall& call) -> std::string {
    for (std::size_t i = 0; i < call.points.size(); ++i)
      call.out_points[i] = call.points[i] + static_cast<float>(call.inputs[0][i % 3]);
    return "";
  };
  ASSERT_TRUE(library.AddNode(push));
  NodeType split{
      .name = "split",
      .inputs = {{"matrix", NodeAttribute::Type::kMatrix}, {"turn", NodeAttribute::Type::kQuaternion}},
      .outputs = {{"place", NodeAttribute::Type::kVector}, {"w"}}};
  split.compute = [](const NodeCall& call) -> std::string {
    std::copy_n(call.inputs[0].begin() + 12, 3, call.outputs[0].begin());
    call.outputs[1][0] = call.inputs[1][3];
    return "";
  };
  ASSERT_TRUE(library.AddNode(split));
  const Rig rig = Load(library, "  mush: {", "  parts: {type: split, matrix: upper.worldMatrix}\n  mush: {");
  const auto edited = rig.Edited([](GraphEdit& edit) -> kpsa::Result<Done> {
    if (auto done = edit.AddNode("push", "up"); !done) return done;
    return edit.Deform("column", "up");
  });
  ASSERT_TRUE(edited) << kpsa::ToText(edited.problems());
  Scene plain(rig), pushed(*edited);
  const std::vector<float> before = Pull(&plain), after = Pull(&pushed);
  ASSERT_EQ(before.size(), after.size());
  for (std::size_t i = 0; i < before.size(); ++i) EXPECT_EQ(after[i], before[i] + (i % 3 == 2 ? 1 : 0));
  const std::vector<double> matrix = *plain.Values("upper.worldMatrix");
  EXPECT_EQ(*plain.Values("parts.place"), std::vector<double>(matrix.begin() + 12, matrix.begin() + 15));
  EXPECT_EQ(*plain.Values("parts.w"), std::vector<double>{1});
  // On one thread
  const std::vector<double> seconds{0, 0.1, 0.2};
  EXPECT_EQ(AllFrames(&pushed, seconds), (std::vector{after, after, after}));
  const Problem refused =
      Failed(pushed.Frames(seconds, [](const kpsa::Frame&) { return true; }, {.threads = 2}));
  EXPECT_EQ(refused.node, "up");
  EXPECT_NE(refused.message.find("1 thread"), std::string::npos) << refused.message;
  EXPECT_TRUE(plain.Frames(seconds, [](const kpsa::Frame&) { return true; }, {.threads = 2}))
      << "the meshes do not need it";
  // The accelerated points (up to the mush) need neither "parts" nor "up"
  const auto trained = edited->Train({.samples = 50}, Path("some.kpsa"));
  EXPECT_TRUE(trained) << kpsa::ToText(trained.problems());
  const auto driven = rig.Edited([](GraphEdit& edit) { return edit.Connect("parts.w", "mush.envelope"); });
  ASSERT_TRUE(driven) << kpsa::ToText(driven.problems());
  EXPECT_EQ(Failed(driven->Train({}, Path("no.kpsa"))).node, "parts");
  EXPECT_FALSE(std::filesystem::exists(Path("no.kpsa")));
  // Exceptions are errors of the node
  NodeType thrower{.name = "thrower", .outputs = {{"output"}}};
  thrower.compute = [](const NodeCall&) -> std::string { throw std::runtime_error("out of luck"); };
  ASSERT_TRUE(library.AddNode(thrower));
  Scene throwing(Load(library, "  mush: {", "  bad: {type: thrower}\n  mush: {"));
  const Problem thrown = Failed(throwing.Values("bad.output"));
  EXPECT_NE(thrown.message.find("out of luck"), std::string::npos) << thrown.message;
  EXPECT_EQ(thrown.node, "bad");
  EXPECT_EQ(thrown.line, 8);
  // So are places that there are not
  NodeType reaching{
      .name = "reaching", .inputs = {{"far"}}, .outputs = {{"output", NodeAttribute::Type::kVector}}};
  reaching.compute = [](const NodeCall& call) -> std::string {
    const double far = call.inputs[0][0];
    if (far == 1) call.outputs[0][3] = 0;
    if (far == 2) (void)call.inputs[1];
    if (far == 3) (void)call.points[0];
    if (far == 4) call.outputs[1][0] = 0;
    return "";
  };
  ASSERT_TRUE(library.AddNode(reaching));
  Scene reached(Load(library, "  mush: {", "  arm: {type: reaching}\n  mush: {"));
  EXPECT_TRUE(reached.Values("arm.output"));
  const std::string kPlaces[] = {"place 3 of output, which has 3", "place 1 of inputs, which has 1",
                                 "place 0 of points, which has 0", "place 1 of outputs, which has 1"};
  for (int far = 1; far <= 4; ++far) {
    ASSERT_TRUE(reached.Set("arm.far", far));
    const Problem beyond = Failed(reached.Values("arm.output"));
    EXPECT_EQ(beyond.node, "arm");
    EXPECT_NE(beyond.message.find(kPlaces[far - 1]), std::string::npos) << beyond.message;
  }
  // Declarations that are wrong
  const auto wrong = [&](NodeType type) { return Failed(library.AddNode(type)).message; };
  EXPECT_NE(wrong(Picky()).find("\"picky\", which the program has already"), std::string::npos)
      << wrong(Picky());
  NodeType other = Picky();
  other.name = "deltaMush";
  EXPECT_NE(wrong(other).find("kpsa itself"), std::string::npos);
  other.name = "twice", other.inputs.push_back({"input"});
  EXPECT_NE(wrong(other).find("declared twice"), std::string::npos);
  other.inputs[1] = {"more", NodeAttribute::Type::kVector, {1, 2}};
  EXPECT_NE(wrong(other).find("expected 3 numbers"), std::string::npos);
  other.inputs.clear(), other.outputs.clear();
  EXPECT_NE(wrong(other).find("expected an output"), std::string::npos);
  EXPECT_NE(wrong({.name = "none"}).find("expected a function"), std::string::npos);
}

TEST_F(SceneStates, TypesAreAddedWhileOthersLoadAndEvaluate) {
  Library library;
  const Rig rig = Load(library);
  std::atomic<bool> over = false;
  std::thread adds([&] {
    for (int k = 0; !over && k < 100000; ++k) {
      NodeType type = Picky();
      type.name += std::to_string(k);
      EXPECT_TRUE(library.AddNode(type));
    }
  });
  std::vector<std::thread> threads;
  for (int t = 0; t < 2; ++t) {
    threads.emplace_back([&, t] {
      for (int k = 0; k < 15; ++k) {
        const auto loaded = library.Load(Path("hello.yaml"));
        EXPECT_TRUE(loaded) << kpsa::ToText(loaded.problems());
        EXPECT_TRUE((t == 0 ? *loaded : rig).Edited([&](GraphEdit& edit) {
          return edit.AddNode("cluster", "lift" + std::to_string(k));
        }));
        Scene scene(*loaded);
        EXPECT_TRUE(scene.Play(k % 2 == 0 ? std::optional<std::string>("wave") : std::nullopt));
        EXPECT_TRUE(scene.Points("column"));
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  over = true;
  adds.join();
}

TEST_F(SceneStates, GraphsAreWalked) {
  const Rig rig = Load(Library());
  const std::vector<kpsa::NodeInfo> nodes = rig.Nodes();
  const auto mush = std::ranges::find(nodes, "mush", &kpsa::NodeInfo::name);
  ASSERT_NE(mush, nodes.end());
  EXPECT_EQ(mush->type, "deltaMush");
  EXPECT_EQ(mush->file, Path("hello.yaml"));
  EXPECT_EQ(mush->line, 8);
  const auto plug = [&](const kpsa::NodeInfo& node, const char* name) {
    const auto found = std::ranges::find(node.plugs, name, &kpsa::PlugInfo::name);
    EXPECT_NE(found, node.plugs.end()) << name;
    return found == node.plugs.end() ? kpsa::PlugInfo() : *found;
  };
  EXPECT_EQ(plug(*mush, "iterations").type, "int");
  EXPECT_TRUE(plug(*mush, "iterations").structural);
  EXPECT_TRUE(plug(*mush, "outPoints").output);
  EXPECT_TRUE(plug(*mush, "outPoints").array);
  EXPECT_EQ(plug(*mush, "space").choices, (std::vector<std::string>{"world", "mesh"}));
  const auto upper = std::ranges::find(nodes, "upper", &kpsa::NodeInfo::name);
  ASSERT_NE(upper, nodes.end());
  EXPECT_EQ(upper->line, 0) << "of the character";
  EXPECT_EQ(plug(*upper, "rotate").unit, "angle");
  const std::vector<kpsa::ConnectionInfo> connections = rig.Connections();
  EXPECT_TRUE(std::ranges::any_of(connections, [](const auto& c) {
    return c.source == "squeeze.outValue" && c.destination.starts_with("cage.points[");
  }));
  for (const kpsa::ConnectionInfo& connection : connections) {
    const std::string node = connection.source.substr(0, connection.source.find('.'));
    EXPECT_TRUE(std::ranges::any_of(nodes, [&](const auto& n) { return n.name == node; }))
        << connection.source;
  }
  EXPECT_EQ(rig.meshes()[0].stage_nodes.size(), 3u);
  EXPECT_EQ(rig.meshes()[0].stage_nodes[2], "mush");
  EXPECT_EQ(rig.Value("mush.iterations")->numbers, std::vector<double>{10});
  EXPECT_EQ(rig.Value("mush.space")->text, "world");
  EXPECT_EQ(rig.Value("cage.divisions")->numbers, (std::vector<double>{2, 5, 2}));
  EXPECT_EQ(rig.Value("upper.worldMatrix").problems().front().node, "upper");
  EXPECT_EQ(rig.Value("upper.rotate")->numbers.size(), 3u);
  EXPECT_NEAR(rig.Value("squeeze.inputMax")->numbers[0], -75, 1e-9);
  EXPECT_EQ(rig.Value("upper.rotateZ")->numbers.size(), 1u);
  EXPECT_EQ(Failed(rig.Value("mush.nothing")).file, Path("hello.yaml"));
}

}  // namespace
