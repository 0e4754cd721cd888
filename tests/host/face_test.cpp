// The public face: what a program sees that includes nothing but kpsa/kpsa.h.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <string>
#include <thread>
#include <vector>

#include "kpsa/kpsa.h"
#include "tests/support/allocations.h"
#include "tests/support/temporary_folder.h"

namespace {

using kpsa::Library;
using kpsa::Problem;
using kpsa::Rig;
using kpsa::Scene;

class Face : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new kpsa::engine::TemporaryFolder;
    for (const char* file : {"hello.yaml", "hello.glb"})
      std::filesystem::copy(std::string(KPSA_SCENES_DIR) + "/hello/" + file, Path(file));
    auto rig = Library().Load(Path("hello.yaml"));
    ASSERT_TRUE(rig) << kpsa::ToText(rig.problems());
    rig_ = new Rig(*rig);
    kpsa::TrainingOptions options;
    options.samples = 200;
    std::vector<std::string> stages;
    options.progress = [&](std::string_view what, double share) {
      EXPECT_GE(share, 0);
      EXPECT_LE(share, 1);
      if (stages.empty() || stages.back() != what) stages.emplace_back(what);
      return true;
    };
    const auto report = rig_->Train(options);
    ASSERT_TRUE(report) << kpsa::ToText(report.problems());
    EXPECT_EQ(report->subspace, Path("hello.kpsa"));
    EXPECT_GT(report->cues, 0u);
    EXPECT_GT(report->hit_rate, 0.5);
    EXPECT_GE(stages.size(), 3u);
  }
  static void TearDownTestSuite() {
    delete rig_;
    delete folder_;
  }
  static std::string Path(const std::string& name) { return folder_->path() + "/" + name; }
  static std::vector<float> Pull(Scene* scene, const std::string& mesh = "column") {
    const auto points = scene->Points(mesh);
    EXPECT_TRUE(points) << kpsa::ToText(points.problems());
    return points ? std::vector<float>(points->begin(), points->end()) : std::vector<float>();
  }
  static double Apart(const std::vector<float>& a, const std::vector<float>& b) {
    EXPECT_EQ(a.size(), b.size());
    double worst = 0;
    for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i)
      worst = std::max(worst, std::abs(double{a[i]} - b[i]));
    return worst;
  }
  // The only problem of a failed result.
  template <typename T>
  static Problem Failed(const kpsa::Result<T>& result) {
    EXPECT_FALSE(result);
    EXPECT_EQ(result.problems().size(), 1u);
    return result.problems().empty() ? Problem() : result.problems().front();
  }

  static kpsa::engine::TemporaryFolder* folder_;
  static Rig* rig_;
};
kpsa::engine::TemporaryFolder* Face::folder_ = nullptr;
Rig* Face::rig_ = nullptr;

TEST_F(Face, SaysWhatARigHas) {
  ASSERT_EQ(rig_->meshes().size(), 1u);
  const kpsa::MeshInfo& mesh = rig_->meshes()[0];
  EXPECT_EQ(mesh.name, "column");
  EXPECT_EQ(mesh.stages, (std::vector<std::string>{"skin", "cage", "mush"}));
  EXPECT_EQ(mesh.triangles.size() % 3, 0u);
  EXPECT_LT(*std::ranges::max_element(mesh.triangles), mesh.vertices);
  ASSERT_EQ(rig_->controls().size(), 2u);
  const kpsa::ControlInfo& bend = rig_->controls()[1];
  EXPECT_EQ(bend.name, "upper.rotateZ");
  EXPECT_NEAR(bend.min, -75, 1e-9);
  EXPECT_EQ(bend.unit, kpsa::ControlInfo::Unit::kAngle);
  EXPECT_NEAR(bend.si, std::acos(-1) / 180, 1e-15);
  EXPECT_TRUE(std::ranges::any_of(rig_->clips(),
                                  [](const auto& clip) { return clip.name == "wave" && clip.end > 0; }));
  EXPECT_NE(rig_->FindMesh("column"), nullptr);
  EXPECT_EQ(rig_->FindMesh("colum"), nullptr);
  EXPECT_FALSE(kpsa::Version().empty());
}

TEST_F(Face, SetsPullsAndResets) {
  Scene scene(*rig_);
  const std::vector<float> rest = Pull(&scene);
  EXPECT_EQ(rest.size(), 3 * rig_->meshes()[0].vertices);
  ASSERT_TRUE(scene.Set("upper.rotateZ", -60));
  const std::vector<float> bent = Pull(&scene);
  EXPECT_GT(Apart(rest, bent), 0.001);
  EXPECT_NEAR((*scene.Values("upper.rotateZ"))[0], -60, 1e-9);
  EXPECT_EQ(scene.Values("upper.worldMatrix")->size(), 16u);
  EXPECT_EQ(Pull(&scene), bent) << "other outputs change nothing";
  scene.Reset();
  EXPECT_EQ(Pull(&scene), rest);
  ASSERT_TRUE(scene.Set("upper.rotateZ", -60));
  EXPECT_GT(Apart(Pull(&scene, "column@skin"), Pull(&scene, "column")), 1e-5);
}

TEST_F(Face, AWarmPullAllocatesNothing) {
  if (!KPSA_COUNTS_ALLOCATIONS)
    GTEST_SKIP() << "allocations are not counted under sanitizers or without glibc";
  const auto fast = rig_->Accelerated();
  ASSERT_TRUE(fast);
  for (const Rig* rig : {static_cast<const Rig*>(rig_), &*fast}) {
    Scene scene(*rig);
    ASSERT_TRUE(scene.Play("wave"));
    const auto frame = [&](double seconds) {
      scene.SetTime(seconds);
      return static_cast<bool>(scene.Points("column"));
    };
    for (int f = 0; f < 25; ++f) ASSERT_TRUE(frame(f / 24.0));
    kpsa::engine::StartCountingAllocations();
    bool all = true;
    for (int f = 0; f < 25; ++f) all = frame(f / 24.0) && all;
    EXPECT_EQ(kpsa::engine::StopCountingAllocations(), 0);
    EXPECT_TRUE(all);
    kpsa::engine::StartCountingAllocations();
    void* volatile one = std::malloc(10);  // which the counter sees
    std::free(one);
    EXPECT_GT(kpsa::engine::StopCountingAllocations(), 0);
  }
}

TEST_F(Face, PlugsThatAreNoControlsVaryToo) {
  Scene scene(*rig_);
  ASSERT_TRUE(scene.Set("upper.rotateZ", -60));
  const std::vector<float> mushed = Pull(&scene);
  ASSERT_TRUE(scene.Set("mush.envelope", 0));
  const std::vector<float> plain = Pull(&scene);
  EXPECT_GT(Apart(mushed, plain), 1e-5);
  EXPECT_LT(Apart(plain, Pull(&scene, "column@cage")), 1e-9);
}

TEST_F(Face, ClipsDriveAndLetGo) {
  Scene scene(*rig_);
  ASSERT_TRUE(scene.Set("upper.rotateX", 10));
  const std::vector<float> turned = Pull(&scene);
  ASSERT_TRUE(scene.Play("wave"));
  scene.SetTime(0.5);
  const std::vector<float> waved = Pull(&scene);
  EXPECT_GT(Apart(turned, waved), 1e-4);
  scene.SetTime(0);
  scene.SetTime(0.5);
  EXPECT_EQ(Pull(&scene), waved);
  ASSERT_TRUE(scene.Play(std::nullopt));
  EXPECT_EQ(Pull(&scene), turned);
  EXPECT_EQ(Failed(scene.Play("wve")).message.find("wve") != std::string::npos, true);
  EXPECT_TRUE(scene.Points("column")) << "as before";
}

TEST_F(Face, ErrorsAreValuesWithPlaces) {
  kpsa::engine::TemporaryFolder folder;
  folder.Write("bad.yaml", "kpsa: 1\ncharacter: none.glb\nnodes:\n  a: {type: latice}\n");
  const auto bad = Library().Load(folder.path() + "/bad.yaml");
  ASSERT_FALSE(bad);
  EXPECT_NE(kpsa::ToText(bad.problems()).find("bad.yaml:2"), std::string::npos)
      << kpsa::ToText(bad.problems());
  Scene scene(*rig_);
  EXPECT_NE(Failed(scene.Set("upper.rotatez", 1)).message.find("rotateZ"), std::string::npos);
  EXPECT_NE(Failed(scene.Set("upper.rotate", 1)).message.find("expected one number of it"),
            std::string::npos);
  EXPECT_NE(Failed(scene.Set("mush.iterations", 1)).message.find("structural"), std::string::npos);
  EXPECT_NE(Failed(scene.Set("mush.envelope", 3)).message.find("outside of"), std::string::npos);
  EXPECT_NE(Failed(scene.Set("upper.rotateZ", std::nan(""))).message.find("finite"), std::string::npos);
  EXPECT_NE(Failed(scene.Set("cage.points[0,2,0].x", 0)).message.find("driven by"), std::string::npos);
  EXPECT_NE(Failed(scene.Points("colum")).message.find("did you mean \"column\""), std::string::npos);
  EXPECT_FALSE(scene.Values("column.nothing"));
  EXPECT_NE(Failed(rig_->Accelerated({.subspace = Path("none.kpsa")})).message.find("no such file"),
            std::string::npos);
  // A subspace that cannot be read is named, not the rig
  folder_->Write("broken.kpsa", "no subspace");
  const Problem broken = Failed(rig_->Accelerated({.subspace = Path("broken.kpsa")}));
  EXPECT_EQ(broken.file, Path("broken.kpsa"));
  EXPECT_EQ(broken.message, "not a safetensors file, or cut short: expected a file that kpsa train wrote");
  std::string damaged = folder_->Read(Path("hello.kpsa"));
  damaged.back() = static_cast<char>(damaged.back() ^ 1);
  folder_->Write("damaged.kpsa", damaged);
  EXPECT_EQ(Failed(rig_->Accelerated({.subspace = Path("damaged.kpsa")})).file, Path("damaged.kpsa"));
  EXPECT_FALSE(rig_->Accelerated({.tolerance = -1}));
  EXPECT_FALSE(rig_->Train({.entry = "colum"}));
  EXPECT_FALSE(rig_->Train({.violation_rate = 2}));
  bool begun = false;
  EXPECT_NE(Failed(rig_->Train({.progress = [&](auto, double) { return begun = true; }}, Path("none/x.kpsa")))
                .where(),
            "");
  EXPECT_FALSE(begun) << "the place is looked at before training";
  EXPECT_EQ(Failed(rig_->Train({.progress = [](auto, double) { return false; }}, Path("no.kpsa"))).kind,
            Problem::Kind::kInterrupted);
  EXPECT_FALSE(std::filesystem::exists(Path("no.kpsa")));
}

TEST_F(Face, PlaysAcceleratedAndSaysWhatItDid) {
  const auto fast = rig_->Accelerated();
  ASSERT_TRUE(fast) << kpsa::ToText(fast.problems());
  EXPECT_TRUE(fast->is_accelerated());
  Scene full(*rig_), accelerated(*fast);
  for (Scene* scene : {&full, &accelerated}) ASSERT_TRUE(scene->Play("wave"));
  std::size_t hits = 0;
  for (int frame = 0; frame < 25; ++frame) {
    for (Scene* scene : {&full, &accelerated}) scene->SetTime(frame / rig_->fps());
    const std::vector<float> exact = Pull(&full), points = Pull(&accelerated);
    const kpsa::Verdict& verdict = accelerated.verdict();
    EXPECT_LT(Apart(exact, points), verdict.hit ? 0.002 : 1e9);
    EXPECT_EQ(verdict.hit, verdict.full_share <= 0);
    EXPECT_FALSE(verdict.reason.empty());
    hits += verdict.hit ? 1 : 0;
  }
  EXPECT_GT(hits, 12u);
  EXPECT_TRUE(full.verdict().reason.empty());
  // What training did not know: every frame is evaluated fully, and says so
  ASSERT_TRUE(accelerated.Set("mush.envelope", 0.5));
  ASSERT_TRUE(full.Set("mush.envelope", 0.5));
  EXPECT_EQ(Pull(&accelerated), Pull(&full));
  EXPECT_FALSE(accelerated.verdict().hit);
  EXPECT_NE(accelerated.verdict().reason.find("mush.envelope"), std::string::npos)
      << accelerated.verdict().reason;
}

TEST_F(Face, AVerdictIsOfWhatWasPulledLast) {
  const auto fast = rig_->Accelerated();
  ASSERT_TRUE(fast);
  Scene scene(*fast);
  EXPECT_TRUE(scene.verdict().reason.empty()) << "nothing was pulled";
  ASSERT_TRUE(scene.Play("wave"));
  scene.SetTime(0.3);
  ASSERT_TRUE(scene.Points("column"));
  const kpsa::Verdict first = scene.verdict();
  EXPECT_EQ(first.reason, "hit");
  const auto is_first = [&] {
    const kpsa::Verdict& now = scene.verdict();
    return now.hit == first.hit && now.score == first.score && now.reason == first.reason;
  };
  scene.SetTime(0.7);
  EXPECT_TRUE(is_first()) << "of the pose before";
  ASSERT_TRUE(scene.Set("mush.envelope", 0.5));
  EXPECT_TRUE(is_first());
  ASSERT_TRUE(scene.Play(std::nullopt));
  EXPECT_TRUE(is_first());
  ASSERT_TRUE(scene.Points("column"));
  EXPECT_FALSE(scene.verdict().hit);
  EXPECT_NE(scene.verdict().reason.find("mush.envelope"), std::string::npos) << scene.verdict().reason;
  ASSERT_TRUE(scene.Points("column@skin"));
  scene.SetTime(0.9);
  ASSERT_TRUE(scene.Set("upper.rotateX", 3));
  ASSERT_TRUE(scene.Values("upper.rotateX"));
  EXPECT_TRUE(scene.verdict().reason.empty()) << "which needs no subspace";
  EXPECT_FALSE(scene.Points("colum"));
  EXPECT_TRUE(scene.verdict().reason.empty());
}

TEST_F(Face, SubspacesAreReadOnce) {
  const auto fast = rig_->Accelerated();
  ASSERT_TRUE(fast);
  std::filesystem::rename(Path("hello.kpsa"), Path("away.kpsa"));
  Scene scene(*fast);
  const auto played = scene.Play("wave");
  EXPECT_TRUE(played) << kpsa::ToText(played.problems());
  EXPECT_TRUE(scene.Set("mush.envelope", 0.5));
  EXPECT_TRUE(scene.Points("column"));
  EXPECT_FALSE(rig_->Accelerated()) << "which reads it anew";
  std::filesystem::rename(Path("away.kpsa"), Path("hello.kpsa"));
}

TEST_F(Face, GraphsAreEditedInACopy) {
  // A node of the registry, driven by a control, that deforms the mesh after its own stack
  const auto edited = rig_->Edited([](kpsa::GraphEdit& edit) -> kpsa::Result<kpsa::Done> {
    if (auto done = edit.AddNode("cluster", "lift"); !done) return done;
    if (auto done = edit.AddNode("unitConversion", "half"); !done) return done;
    if (auto done = edit.Set("half.conversionFactor", 0.5); !done) return done;
    if (auto done = edit.Connect("upper.poseRotateZ", "half.input"); !done) return done;
    if (auto done = edit.Set("mush.iterations", 3); !done) return done;
    return edit.Deform("column", "lift");
  });
  ASSERT_TRUE(edited) << kpsa::ToText(edited.problems());
  EXPECT_EQ(edited->meshes()[0].stages, (std::vector<std::string>{"skin", "cage", "mush", "lift"}));
  EXPECT_EQ(rig_->meshes()[0].stages.size(), 3u);
  Scene scene(*edited), plain(*rig_);
  for (Scene* one : {&scene, &plain}) ASSERT_TRUE(one->Set("upper.rotateZ", -60));
  EXPECT_GT(Apart(Pull(&scene), Pull(&plain)), 1e-6) << "three iterations are not ten";
  ASSERT_TRUE(scene.Values("half.output"));
  EXPECT_NEAR(std::abs((*scene.Values("half.output"))[0]), 30, 1e-6) << "degrees, as the rig's file counts";

  // A mesh whose stack gives other points than it has vertices for
  const auto empty = rig_->Edited([](kpsa::GraphEdit& edit) -> kpsa::Result<kpsa::Done> {
    if (auto done = edit.AddNode("cluster", "lift"); !done) return done;
    if (auto done = edit.Deform("column", "lift"); !done) return done;
    return edit.Disconnect("lift.inPoints");
  });
  ASSERT_TRUE(empty) << kpsa::ToText(empty.problems());
  {
    Scene hollow(*empty);
    EXPECT_FALSE(hollow.Points("column"));
    EXPECT_FALSE(hollow.Frames(std::vector<double>{0}, [](const kpsa::Frame&) { return true; }));
  }
  // The callback may use the library
  EXPECT_TRUE(rig_->Edited([&](kpsa::GraphEdit& edit) {
    Scene within(*edited);
    EXPECT_TRUE(within.Points("column"));
    return edit.Set("mush.iterations", 2);
  }));

  const auto refused = [&](auto edit) { return kpsa::ToText(rig_->Edited(edit).problems()); };
  EXPECT_NE(refused([](kpsa::GraphEdit& e) { return e.AddNode("clutser", "x"); }).find("cluster"),
            std::string::npos);
  EXPECT_NE(refused([](kpsa::GraphEdit& e) { return e.Deform("colum", "mush"); }).find("column"),
            std::string::npos);
  EXPECT_NE(refused([](kpsa::GraphEdit& e) { return e.Deform("column", "squeeze"); }).find("no deformer"),
            std::string::npos);
  EXPECT_NE(refused([](kpsa::GraphEdit& e) {
              return e.Connect("squeeze.outValue", "squeeze.input");
            }).find("cycle"),
            std::string::npos);
  EXPECT_NE(refused([](kpsa::GraphEdit& e) { return e.Set("mush.envelope", 7); }).find("outside of"),
            std::string::npos);
}

TEST_F(Face, ProfilesSayWhatItCosts) {
  Scene scene(*rig_);
  ASSERT_TRUE(scene.Play("wave"));
  const auto steps = scene.Profile(std::vector<double>{0.1, 0.2, 0.3});
  ASSERT_TRUE(steps) << kpsa::ToText(steps.problems());
  const auto mush = std::ranges::find_if(
      *steps, [](const auto& step) { return step.node == "mush" && step.label.empty(); });
  ASSERT_NE(mush, steps->end());
  EXPECT_EQ(mush->type, "deltaMush");
  EXPECT_EQ(mush->evaluations, 3u);
  EXPECT_GT(mush->points, 100u);
  EXPECT_TRUE(std::ranges::is_sorted(*steps, std::ranges::greater(), &kpsa::StepTime::milliseconds));
}

TEST_F(Face, FramesAreTheSameOnAnyNumberOfThreads) {
  const auto fast = rig_->Accelerated();
  ASSERT_TRUE(fast);
  Scene scene(*fast);
  ASSERT_TRUE(scene.Play("wave"));
  std::vector<double> seconds;
  for (int frame = 0; frame < 25; ++frame) seconds.push_back(frame / fast->fps());
  std::vector<std::vector<float>> all[2];
  for (int side : {0, 1}) {
    const auto done = scene.Frames(seconds,
                                   [&](const kpsa::Frame& frame) {
                                     EXPECT_EQ(frame.index, all[side].size());
                                     EXPECT_NE(frame.verdict, nullptr);
                                     all[side].emplace_back(frame.points[0].begin(), frame.points[0].end());
                                     return true;
                                   },
                                   {.threads = side == 0 ? 1 : 3});
    ASSERT_TRUE(done) << kpsa::ToText(done.problems());
  }
  EXPECT_EQ(all[0], all[1]);
  scene.SetTime(seconds[7]);
  EXPECT_EQ(Pull(&scene), all[0][7]);
  std::size_t taken = 0;
  EXPECT_TRUE(scene.Frames(seconds, [&](const kpsa::Frame&) { return ++taken < 3; }));
  EXPECT_EQ(taken, 3u);
  EXPECT_THROW((void)scene.Frames(seconds, [](const kpsa::Frame&) -> bool { throw 7; }, {.threads = 2}), int);
  const std::atomic<bool> cancel = true;
  EXPECT_EQ(Failed(scene.Frames(seconds, [](const kpsa::Frame&) { return true; }, {.cancel = &cancel})).kind,
            Problem::Kind::kInterrupted);
}

TEST_F(Face, ScenesOnManyThreadsShareARig) {
  Scene first(*rig_);
  ASSERT_TRUE(first.Set("upper.rotateZ", -40));
  const std::vector<float> expected = Pull(&first);
  std::vector<std::vector<float>> got(4);
  std::vector<std::thread> threads;
  for (std::size_t t = 0; t < got.size(); ++t) {
    threads.emplace_back([&, t] {
      Scene scene(*rig_);
      for (int k = 0; k <= 40; ++k) {
        EXPECT_TRUE(scene.Set("upper.rotateZ", -k));
        got[t] = Pull(&scene);
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  for (const std::vector<float>& points : got) EXPECT_EQ(points, expected);
}

}  // namespace
