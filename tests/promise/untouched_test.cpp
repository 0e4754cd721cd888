// The characters of bench_untouched are rigs as others make them: sound files, skins that hold, clips that
// move them, and a test clip that the starter rig keeps for testing. Here with fewer points.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "base/digest.h"
#include "bench/untouched_character.h"
#include "bench/untouched_run.h"
#include "cli/common.h"
#include "host/rig_frames.h"
#include "rig/build/writer.h"
#include "tests/support/temporary_folder.h"

namespace kpsa::engine::untouched {
namespace {

constexpr std::size_t kFewPoints = 1500;

class UntouchedCharacter : public testing::TestWithParam<std::tuple<Kind, std::uint64_t>> {
 protected:
  UntouchedCharacter()
      : kind_(std::get<0>(GetParam())), seed_(std::get<1>(GetParam())), scene_(Made(kind_, seed_)) {
    AddAllNodes(registry_);
  }
  // Once for all tests.
  static const scenes::GlbScene& Made(Kind kind, std::uint64_t seed) {
    static std::map<std::pair<Kind, std::uint64_t>, scenes::GlbScene> made;
    const auto [at, is_new] = made.try_emplace({kind, seed});
    if (is_new) at->second = MakeCharacter(kind, seed, kFewPoints);
    return at->second;
  }
  const scenes::GlbMesh& mesh() const { return scene_.meshes[0]; }

  // Vertices, x y z of one after the other, of the starter rig at these times of the clip, or ("") at rest.
  std::vector<std::vector<double>> Evaluate(const std::string& clip, const std::vector<double>& times) {
    folder_.Write("c.glb", scenes::WriteGlb(scene_));
    const Result<std::string> text = StarterRig(registry_, folder_ / "c.glb");
    if (!text.ok()) {
      ADD_FAILURE() << text.status().ToString();
      return {};
    }
    starter_ = *text;
    RigOptions options;
    options.rest = clip.empty();
    if (!clip.empty()) options.clip = clip;
    const Result<Rig> rig = LoadRig(registry_, folder_.Write("c.yaml", starter_), options);
    if (!rig.ok()) {
      ADD_FAILURE() << rig.status().ToString();
      return {};
    }
    EXPECT_TRUE(rig->notes.empty());
    Compiler compiler;
    const Result<std::shared_ptr<const Plan>> plan = CompileFor(*rig, &compiler, ShownPoints(*rig));
    if (!plan.ok()) {
      ADD_FAILURE() << plan.status().ToString();
      return {};
    }
    std::vector<std::vector<double>> frames;
    const Status status = EvaluateTimes(*rig, *plan, times, {}, [&](std::size_t, const Evaluator& evaluator) {
      const ConstPointsView points = evaluator.Points(0);
      std::vector<double>& frame = frames.emplace_back();
      for (const Index i : rig->scene.meshes[0].mesh().data().vertex_to_point)
        frame.insert(frame.end(), {points.x[i], points.y[i], points.z[i]});
      return Status();
    });
    EXPECT_TRUE(status.ok()) << status.ToString();
    return frames;
  }

  static double Farthest(const std::vector<double>& a, const std::vector<double>& b) {
    double farthest = a.size() == b.size() ? 0 : INFINITY;
    for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i)
      farthest = std::max(farthest, std::fabs(a[i] - b[i]));
    return farthest;
  }

  Kind kind_;
  std::uint64_t seed_;
  const scenes::GlbScene& scene_;
  NodeRegistry registry_;
  TemporaryFolder folder_;
  std::string starter_;
};

INSTANTIATE_TEST_SUITE_P(Seeds, UntouchedCharacter,
                         testing::Combine(testing::ValuesIn(kKinds), testing::Values(1u, 2u)));

TEST_P(UntouchedCharacter, IsOfItsKind) {
  EXPECT_NEAR(static_cast<double>(mesh().positions.size()), kFewPoints, 0.15 * kFewPoints);
  const std::size_t joints = scene_.joints.size(), morphs = mesh().targets.size();
  switch (kind_) {
    case Kind::kBody:
      EXPECT_TRUE(joints >= 40 && joints <= 60) << joints;
      EXPECT_EQ(morphs, 0u);
      break;
    case Kind::kHead:
      EXPECT_TRUE(joints >= 12 && joints <= 20) << joints;
      EXPECT_TRUE(morphs >= 40 && morphs <= 60) << morphs;
      break;
    case Kind::kCreature:
      EXPECT_EQ(joints, 82u);
      EXPECT_EQ(morphs, 0u);
      break;
  }
}

TEST_P(UntouchedCharacter, WeightsAddUpAndEveryJointHasSome) {
  const scenes::GlbScene whole = MakeCharacter(kind_, seed_, UsualPoints(kind_));
  const scenes::GlbMesh& skin = whole.meshes[0];
  EXPECT_NEAR(static_cast<double>(skin.positions.size()), static_cast<double>(UsualPoints(kind_)),
              0.02 * static_cast<double>(UsualPoints(kind_)));
  ASSERT_EQ(skin.influences.size(), skin.positions.size());
  std::vector<double> carries(whole.joints.size());
  for (const scenes::Influences& influences : skin.influences) {
    double sum = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      EXPECT_GE(influences.weights[k], 0);
      sum += static_cast<double>(influences.weights[k]);
      carries[influences.joints[k]] += static_cast<double>(influences.weights[k]);
    }
    EXPECT_EQ(sum, 1);
  }
  for (std::size_t j = 0; j < carries.size(); ++j)
    EXPECT_GT(carries[j], 0) << whole.nodes[static_cast<std::size_t>(whole.joints[j])].name;
  for (const scenes::SparseTarget& target : skin.targets) EXPECT_GT(target.points.size(), 20u) << target.name;
}

// Every edge has as many faces that go one way as the other, and the faces look outwards.
TEST_P(UntouchedCharacter, SurfaceIsClosed) {
  std::map<std::pair<Index, Index>, int> edges;
  double volume = 0;
  const auto& triangles = mesh().triangles;
  for (std::size_t t = 0; t < triangles.size(); t += 3) {
    Double3 p[3];
    for (std::size_t k = 0; k < 3; ++k) {
      const Index a = triangles[t + k], b = triangles[t + (k + 1) % 3];
      edges[{std::min(a, b), std::max(a, b)}] += a < b ? 1 : -1;
      const scenes::Float3& at = mesh().positions[a];
      p[k] = {at[0], at[1], at[2]};
    }
    volume += Dot(p[0], Cross(p[1], p[2])) / 6;
  }
  for (const auto& [edge, balance] : edges) EXPECT_EQ(balance, 0) << edge.first << " " << edge.second;
  EXPECT_GT(volume, 0.002);
  EXPECT_LT(volume, 0.3);
}

TEST_P(UntouchedCharacter, RestIsWhatTheFileHas) {
  const auto rest = Evaluate("", {0});
  ASSERT_EQ(rest.size(), 1u);
  std::vector<double> expected;
  for (const scenes::Float3& p : mesh().positions) expected.insert(expected.end(), p.begin(), p.end());
  EXPECT_LT(Farthest(rest[0], expected), 1e-4);
}

TEST_P(UntouchedCharacter, ClipsMoveIt) {
  EXPECT_TRUE(scene_.clips.size() >= 4 && scene_.clips.size() <= 6);
  for (const scenes::GlbClip& clip : scene_.clips) {
    EXPECT_EQ(clip.frames_per_second, 30);
    EXPECT_TRUE(clip.frames >= 90 && clip.frames <= 180) << clip.frames;
    std::vector<double> times;
    for (int f = 0; f < clip.frames; f += 9) times.push_back(f / clip.frames_per_second);
    const auto frames = Evaluate(clip.name, times);
    ASSERT_EQ(frames.size(), times.size());
    double farthest = 0;
    for (const auto& frame : frames) {
      for (const double value : frame) ASSERT_TRUE(std::isfinite(value) && std::fabs(value) < 4) << value;
      farthest = std::max(farthest, Farthest(frame, frames.front()));
    }
    EXPECT_GT(farthest, 0.02) << clip.name;
    for (const scenes::GlbChannel& channel : clip.channels) {  // no jumps
      const std::size_t width = channel.values.size() / static_cast<std::size_t>(clip.frames);
      for (std::size_t i = width; i < channel.values.size(); ++i)
        ASSERT_LT(std::fabs(channel.values[i] - channel.values[i - width]), 0.4f) << clip.name;
    }
  }
}

TEST_P(UntouchedCharacter, TheTestClipIsKeptForTesting) {
  Evaluate("", {});
  EXPECT_EQ(scene_.clips.back().name, TestClip(kind_));
  EXPECT_NE(starter_.find("test: {clips: [" + TestClip(kind_) + "]}"), std::string::npos) << starter_;
}

TEST_P(UntouchedCharacter, DependsOnItsSeedAlone) {
  const std::string bytes = scenes::WriteGlb(scene_);
  EXPECT_EQ(bytes, scenes::WriteGlb(MakeCharacter(kind_, seed_, kFewPoints)));
  EXPECT_NE(bytes, scenes::WriteGlb(MakeCharacter(kind_, seed_ + 7, kFewPoints)));
}

// Figures of different versions of the program are of the same characters, whatever compiled them.
TEST(UntouchedCharacters, AreTheSameEverywhere) {
  std::vector<std::string> digests;
  for (const Kind kind : kKinds) {
    Hasher hasher;
    hasher.Add(scenes::WriteGlb(MakeCharacter(kind, 1, kFewPoints)));
    digests.push_back(hasher.Finish().ToHex());
  }
  EXPECT_EQ(digests,
            (std::vector<std::string>{"debe364ee1b633014b358799643e9dbb", "04d8a65b0ea12f5541d88cefa423814e",
                                      "0c747c16e1b6f1bc91a4591f1eb487d3"}));
}

TEST(UntouchedRun, ReadsWhatTheProgramPrints) {
  TemporaryFolder folder;
  const Result<Row> row =
      TryCharacter(KPSA_PROGRAM, "hello", KPSA_SCENES_DIR "/hello/hello.glb", folder.path());
  ASSERT_TRUE(row.ok()) << row.status().ToString();
  EXPECT_EQ(row->points, 794u);
  EXPECT_EQ(row->joints, 2u);
  EXPECT_EQ(row->test_clip, "wave_test1");
  EXPECT_GT(row->training_seconds, 0);
  EXPECT_GT(row->tolerance, 0);
  EXPECT_GT(row->speedup, 0);
  EXPECT_TRUE(row->hits >= 0 && row->hits <= 1);
  const std::string text = RowsText({&*row, 1});
  EXPECT_NE(text.find("hello"), std::string::npos) << text;
  EXPECT_NE(text.find(row->kept ? "kept" : "BROKEN"), std::string::npos) << text;
}

TEST(UntouchedRun, SaysWhatFailed) {
  TemporaryFolder folder;
  const std::string hello = KPSA_SCENES_DIR "/hello/hello.glb";
  const Result<Row> nobody = TryCharacter(folder / "nobody", "hello", hello, folder.path());
  ASSERT_FALSE(nobody.ok());
  EXPECT_NE(nobody.status().ToString().find("nobody: cannot be started"), std::string::npos)
      << nobody.status().ToString();
  const Result<Row> failing = TryCharacter("/bin/false", "hello", hello, folder.path());
  ASSERT_FALSE(failing.ok());
  EXPECT_NE(failing.status().ToString().find("init"), std::string::npos) << failing.status().ToString();
  const Result<Row> silent = TryCharacter("/bin/true", "hello", hello, folder.path());
  ASSERT_FALSE(silent.ok());
  EXPECT_NE(silent.status().ToString().find("is not what kpsa --json prints"), std::string::npos)
      << silent.status().ToString();
  EXPECT_FALSE(TryCharacter(KPSA_PROGRAM, "x", folder / "missing.glb", folder.path()).ok());
}

}  // namespace
}  // namespace kpsa::engine::untouched
