// Accelerated rigs of other shapes: several meshes and stages, a rig that travels, and motion that no
// training pose had. Each hit has to keep the tolerance.
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "tests/cli/hello_folder.h"
#include "tests/cli/process.h"
#include "tests/cli/rig_run.h"

namespace kpsa::engine {
namespace {

constexpr double kTolerance = kQuickTolerance;

// The points of mesh m among all (x.., y.., z.. by mesh).
std::vector<float> MeshPart(const std::vector<float>& points, std::size_t m, std::size_t count) {
  const auto begin = points.begin() + static_cast<std::ptrdiff_t>(3 * count * m);
  return {begin, begin + static_cast<std::ptrdiff_t>(3 * count)};
}

// --- Several meshes, and a stage after the accelerated one

class TwoMeshes : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new HelloFolder;
    folder_->AddShell();
    folder_->Edit("  mush: {type: deltaMush, iterations: 10}\n",
                  "  mush: {type: deltaMush, iterations: 10}\n  soft: {type: deltaMush, iterations: 4}\n  "
                  "grip: {type: transform}\n"
                  "  push: {type: softMod, matrix: grip.worldMatrix, falloffRadius: 30}\n");
    folder_->Edit("  - {meshes: [column], stack: [skin, cage, mush]}\n",
                  "  - {meshes: [column], stack: [skin, cage, mush]}\n  - {meshes: [shell], stack: [skin, "
                  "soft, push]}\n");
    folder_->Edit("  upper.rotateX:", "  grip.translateX: {min: -3, max: 3}\n  upper.rotateX:");
    folder_->Edit("points: [column@mush]", "points: [column@mush, shell@soft]");
    trained_ = TrainRig(folder_->rig(), QuickTraining());
    ASSERT_NE(trained_, nullptr);
  }
  static void TearDownTestSuite() {
    trained_.reset();
    delete folder_;
  }
  static inline const HelloFolder* folder_ = nullptr;
  static inline std::shared_ptr<const Subspace> trained_;
};

TEST_F(TwoMeshes, HitsKeepTheToleranceAndLaterStagesAreExactOnThem) {
  RigRun full(folder_->rig()), run(folder_->rig(), {.subspace = trained_});
  ASSERT_TRUE(run.ok()) << run.error;
  ASSERT_EQ(run.rig.scene.meshes.size(), 2u);
  ASSERT_EQ(trained_->outputs.size(), 2u);
  const std::size_t count = trained_->outputs[0].points;
  std::size_t hits = 0, beyond = 0;
  double pushed = 0;
  const auto poses = SmoothPoses(run.rig, 40, 0.6);
  for (const auto& pose : poses) {
    full.Pose(pose);
    run.Pose(pose);
    const RunFrame exact = full.Evaluate(), frame = run.Evaluate();
    if (!frame.hit) continue;
    ++hits;
    for (std::size_t m = 0; m < 2; ++m) {
      beyond +=
          LargestDistance(MeshPart(frame.points, m, count), MeshPart(exact.points, m, count)) > kTolerance;
    }
    // push moves the shell by what the grip moves, which the subspace knows nothing of
    pushed =
        std::max(pushed, LargestDistance(MeshPart(frame.points, 0, count), MeshPart(frame.points, 1, count)));
  }
  EXPECT_GT(hits, poses.size() / 4);
  EXPECT_LE(beyond, poses.size() / 20);
  EXPECT_GT(pushed, 5 * kTolerance);
}

TEST_F(TwoMeshes, ToleranceInfiniteRunsNeitherMushAndTheStageAfterThemAlways) {
  // At a tolerance at which nothing behind a mush has to be measured
  TrainOptions options = QuickTraining();
  options.tolerance = 1e-2;
  const auto trained = TrainRig(folder_->rig(), options);
  ASSERT_NE(trained, nullptr);
  RigRun run(folder_->rig(), {.subspace = trained, .accelerate = {.tolerance = kInfinity}});
  ASSERT_TRUE(run.ok()) << run.error;
  for (const auto& pose : SmoothPoses(run.rig, 10, 0.95)) {
    run.Pose(pose);
    EXPECT_TRUE(run.Evaluate().hit);
  }
  EXPECT_EQ(run.Computes("mush"), 0u);
  EXPECT_EQ(run.Computes("soft"), 0u);
  EXPECT_EQ(run.Computes("push"), 10u);
}

TEST_F(TwoMeshes, ToleranceZeroAndMissesAreExactInEveryMesh) {
  RigRun full(folder_->rig()), zero(folder_->rig(), {.subspace = trained_, .accelerate = {.tolerance = 0}}),
      guarded(folder_->rig(), {.subspace = WithGuardsOnly(*trained_)});
  ASSERT_TRUE(zero.ok()) << zero.error;
  std::size_t misses = 0;
  for (const auto& pose : SmoothPoses(full.rig, 20, 1.4)) {
    full.Pose(pose), zero.Pose(pose), guarded.Pose(pose);
    const RunFrame exact = full.Evaluate(), frame = guarded.Evaluate();
    EXPECT_TRUE(SameBytes(zero.Evaluate().points, exact.points));
    const bool miss = frame.full_weight == 1;
    misses += miss;
    EXPECT_EQ(SameBytes(frame.points, exact.points), miss) << frame.text;
  }
  EXPECT_GT(misses, 0u);
  EXPECT_LT(misses, 20u);
}

// --- A rig that travels

class Travelling : public ::testing::Test {
 protected:
  // In the lower joint's space, or in the world's.
  static std::string Rig(const HelloFolder& folder, bool space) {
    folder.Edit("divisions: [2, 5, 2], members: all}", "divisions: [2, 5, 2], members: all, parent: lower}");
    if (space) folder.Edit("subspace: hello.kpsa", "space: lower, subspace: hello.kpsa");
    return folder.rig();
  }
  static void Travel(double t, RigRun* run) {
    run->Set("lower.translateX", 0.3 * t);
    run->Set("lower.translateZ", -0.2 * t);
    run->Set("lower.rotateY", 2.5 * t);
    run->Set("lower.rotateX", -0.7 * t);
  }
  const std::vector<std::string> moving_ = {"lower.translateX", "lower.translateZ", "lower.rotateX",
                                            "lower.rotateY"};
};

// What a stage gives in mesh space is not in the space of a joint, whatever that does.
TEST_F(Travelling, AStageBeforeTheSkinStaysInMeshSpace) {
  const HelloFolder folder;
  folder.Edit("  mush: {type: deltaMush, iterations: 10}\n",
              "  mush: {type: deltaMush, iterations: 10}\n  grip: {type: transform}\n"
              "  push: {type: softMod, matrix: grip.worldMatrix, falloffRadius: 30}\n");
  folder.Edit("[skin, cage, mush]", "[push, mush, skin]");
  folder.Edit("  upper.rotateX:", "  grip.translateX: {min: -5, max: 5}\n  upper.rotateX:");
  folder.Edit("subspace: hello.kpsa", "space: upper, subspace: hello.kpsa");
  const auto trained = TrainRig(folder.rig(), QuickTraining());
  ASSERT_NE(trained, nullptr);
  RigRun full(folder.rig()), run(folder.rig(), {.subspace = trained});
  ASSERT_TRUE(run.ok()) << run.error;
  std::size_t hits = 0;
  for (const auto& pose : SmoothPoses(run.rig, 20, 0.9)) {
    full.Pose(pose), run.Pose(pose);
    const RunFrame frame = run.Evaluate();
    hits += frame.hit;
    EXPECT_LE(LargestDistance(frame.points, full.Evaluate().points), kTolerance);
  }
  EXPECT_GT(hits, 10u);
}

// A character that is put somewhere else is the same character.
TEST_F(Travelling, PlacingTheSpaceKeepsTheSubspace) {
  const HelloFolder folder;
  Rig(folder, true);
  const auto run = [&](const std::vector<std::string>& arguments) {
    const ProcessResult result = RunKpsa(arguments, 60, folder.path());
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return result.out;
  };
  run({"train", "hello.yaml", "--force", "-q", "--tolerance", "10mm"});
  const auto report = nlohmann::json::parse(run(
      {"eval", "hello.yaml", "--accelerate", "--set", "lower.translateX=5000", "-o", "far.npz", "--json"}));
  EXPECT_EQ(report["accelerated"]["misses"], 0) << report.dump();
}

TEST_F(Travelling, RigidMotionOfTheSpaceKeepsEveryHit) {
  const HelloFolder folder;
  const std::string path = Rig(folder, true);
  const auto trained = TrainRig(path, QuickTraining());
  ASSERT_NE(trained, nullptr);
  EXPECT_EQ(trained->space, "lower");
  RigRun full(path, {.varying = moving_}), run(path, {.subspace = trained, .varying = moving_}),
      still(path, {.subspace = trained});
  ASSERT_TRUE(run.ok()) << run.error;
  std::size_t hits = 0, hits_still = 0;
  double travelled = 0;
  const auto poses = SmoothPoses(run.rig, 30, 0.9);
  for (std::size_t f = 0; f < poses.size(); ++f) {
    full.Pose(poses[f]), run.Pose(poses[f]), still.Pose(poses[f]);
    Travel(0.1 * static_cast<double>(f), &full);
    Travel(0.1 * static_cast<double>(f), &run);
    const RunFrame exact = full.Evaluate(), frame = run.Evaluate(), in_place = still.Evaluate();
    hits += frame.hit;
    hits_still += in_place.hit;
    EXPECT_NEAR(frame.score, in_place.score, 0.1);  // the points' rounding grows with the distance
    travelled = std::max(travelled, LargestDistance(exact.points, in_place.points));
    if (frame.hit) {
      EXPECT_LT(LargestDistance(frame.points, exact.points), 1.5 * kTolerance) << f;
    }
  }
  EXPECT_GT(travelled, 1.0);
  EXPECT_GT(hits_still, poses.size() / 2);
  // Frames whose score is about the threshold may fall on either side of it
  EXPECT_NEAR(static_cast<double>(hits), static_cast<double>(hits_still),
              0.1 * static_cast<double>(poses.size()));
}

TEST_F(Travelling, WithoutASpaceItMisses) {
  const HelloFolder folder;
  const std::string path = Rig(folder, false);
  const auto trained = TrainRig(path, QuickTraining());
  ASSERT_NE(trained, nullptr);
  RigRun run(path, {.subspace = WithGuardsOnly(*trained), .varying = moving_});
  ASSERT_TRUE(run.ok()) << run.error;
  EXPECT_TRUE(run.Evaluate().hit);
  Travel(0.1, &run);
  const RunFrame frame = run.Evaluate();
  EXPECT_FALSE(frame.hit);
  EXPECT_EQ(frame.full_weight, 1);
  EXPECT_EQ(frame.text, "lower.matrix is outside its trained range");
}

// The space is no guard. Where its frame is no number, no cue is.
TEST_F(Travelling, CuesThatAreNoNumbersMiss) {
  const HelloFolder folder;
  const std::string path = Rig(folder, true);
  const auto trained = TrainRig(path, QuickTraining());
  ASSERT_NE(trained, nullptr);
  RigRun run(path, {.subspace = trained, .accelerate = {.tolerance = kInfinity}, .varying = moving_});
  const RunFrame before = run.Evaluate();
  EXPECT_TRUE(before.hit);
  run.Set("lower.translateX", std::nan(""));
  const RunFrame frame = run.Evaluate();
  EXPECT_FALSE(frame.hit);
  EXPECT_EQ(frame.reason, MissReason::kNotFinite);
  EXPECT_NE(frame.text.find("is not a number"), std::string::npos) << frame.text;
  EXPECT_LE(std::count(frame.text.begin(), frame.text.end(), '@'), 1) << frame.text;  // mesh@stage, or a plug
  run.Set("lower.translateX", 0);
  EXPECT_TRUE(SameBytes(run.Evaluate().points, before.points));
}

// A deformer that stays in the world while the space leaves it: not rigid, although no guard sees it.
TEST_F(Travelling, LeavingADeformerBehindMissesOrKeepsTheTolerance) {
  const HelloFolder folder;
  folder.Edit("subspace: hello.kpsa", "space: lower, subspace: hello.kpsa");  // the cage has no parent
  const auto trained = TrainRig(folder.rig(), QuickTraining());
  ASSERT_NE(trained, nullptr);
  const std::vector<std::string> moving = {"lower.translateX", "lower.translateY"};
  constexpr double kTight = 1e-4;
  RigRun full(folder.rig(), {.varying = moving}),
      run(folder.rig(), {.subspace = trained, .accelerate = {.tolerance = kTight}, .varying = moving}),
      pure(folder.rig(), {.subspace = trained, .accelerate = {.tolerance = kInfinity}, .varying = moving});
  ASSERT_TRUE(run.ok()) << run.error;
  double unguarded = 0;
  const std::vector<double> bent = {0.1, -0.9};
  for (RigRun* r : {&full, &run, &pure}) r->Pose(bent);
  for (int step = 0; step < 40; ++step) {
    for (const char* plug : {"lower.translateX", "lower.translateY"}) {
      for (RigRun* r : {&full, &run, &pure}) r->Set(plug, 0.0025 * step);
      const std::vector<float> exact = full.Evaluate().points;
      const RunFrame frame = run.Evaluate();
      EXPECT_LE(LargestDistance(frame.points, exact), 1.2 * kTight)
          << plug << " " << step << " " << frame.score;
      unguarded = std::max(unguarded, LargestDistance(pure.Evaluate().points, exact));
    }
  }
  EXPECT_GT(unguarded, 2 * kTight);  // it needed the score
}

// --- Motion that no training pose had

class Untrained : public ::testing::Test {};

// Trained on a clip in which the two controls follow one curve, tried on all their combinations.
TEST_F(Untrained, CombinationsMissOrKeepTheTolerance) {
  const HelloFolder folder;
  TrainOptions options = QuickTraining();
  options.samples = 0;
  options.calibration_poses = 400;
  options.violation_rate = 0.01;
  options.tolerance = 5e-3;  // one curve leaves errors of that size nearby
  const auto trained = TrainRig(folder.rig(), options, {"wave"});
  ASSERT_NE(trained, nullptr);
  RigRun full(folder.rig()), run(folder.rig(), {.subspace = trained}),
      pure(folder.rig(), {.subspace = trained, .accelerate = {.tolerance = kInfinity}});
  ASSERT_TRUE(run.ok()) << run.error;
  std::size_t frames = 0, hits = 0, violations = 0, unguarded = 0;
  for (int i = 0; i <= 14; ++i) {
    for (int j = 0; j <= 14; ++j) {
      std::vector<double> pose;
      for (const auto& [control, step] : {std::pair{0, i}, {1, j}}) {
        const Control& c = run.rig.controls[static_cast<std::size_t>(control)];
        pose.push_back(c.min + (c.max - c.min) * step / 14);
      }
      full.Pose(pose), run.Pose(pose), pure.Pose(pose);
      const std::vector<float> exact = full.Evaluate().points;
      const RunFrame frame = run.Evaluate();
      ++frames;
      hits += frame.hit;
      violations += LargestDistance(frame.points, exact) > options.tolerance;
      const RunFrame any = pure.Evaluate();
      unguarded += any.hit && LargestDistance(any.points, exact) > options.tolerance;
    }
  }
  EXPECT_GT(hits, 10u);
  EXPECT_LE(violations, frames / 20);
  EXPECT_GT(unguarded, frames / 16);  // within the trained ranges, and beyond the tolerance without SoftCache
}

// A clip moves a joint that is no control and never moved in training.
TEST_F(Untrained, AJointThatNeverMovedMissesByName) {
  const HelloFolder folder;
  folder.AddSway();
  const auto trained = TrainRig(folder.rig(), QuickTraining());
  ASSERT_NE(trained, nullptr);
  RigRun full(folder.rig(), {.clip = "sway"});
  const auto guards_only = WithGuardsOnly(*trained);
  RigRun run(folder.rig(), {.subspace = guards_only, .clip = "sway"});
  RigRun wave(folder.rig(), {.subspace = guards_only, .clip = "wave"});
  auto blind = std::make_shared<Subspace>(*guards_only);  // one that calls any motion of that joint trained
  for (int e = 0; e < 12; ++e) {
    const std::string name = "lower.matrix/" + std::to_string(e);
    std::erase_if(blind->ranges, [&](const TrainedRange& range) { return range.plug == name; });
    blind->ranges.push_back({name, -1e9, 1e9});
  }
  RigRun unguarded(folder.rig(), {.subspace = blind, .clip = "sway"});
  ASSERT_TRUE(run.ok() && wave.ok() && unguarded.ok()) << run.error << wave.error << unguarded.error;
  double worst = 0;
  for (int f = 6; f < 48; f += 6) {
    for (RigRun* r : {&full, &run, &wave, &unguarded}) r->SetTime(f / 24.0);
    const RunFrame frame = run.Evaluate();
    const std::vector<float> exact = full.Evaluate().points;
    EXPECT_FALSE(frame.hit) << f;
    EXPECT_EQ(frame.text, "lower.matrix is outside its trained range");
    EXPECT_TRUE(SameBytes(frame.points, exact));
    EXPECT_TRUE(wave.Evaluate().hit) << f;
    const RunFrame hit = unguarded.Evaluate();
    EXPECT_TRUE(hit.hit) << hit.text;
    worst = std::max(worst, LargestDistance(hit.points, exact));
  }
  EXPECT_GT(worst, 10 * kTolerance);  // the guard alone kept it out
}

// A control that the rig got after the training.
TEST_F(Untrained, ANewControlMissesByName) {
  const HelloFolder folder;
  const auto trained = TrainRig(folder.rig(), QuickTraining());
  ASSERT_NE(trained, nullptr);
  folder.Edit("  upper.rotateX:", "  lower.rotateZ: {min: -40, max: 40}\n  upper.rotateX:");
  RigRun run(folder.rig(), {.subspace = WithGuardsOnly(*trained)});
  ASSERT_TRUE(run.ok()) << run.error;
  EXPECT_TRUE(run.Evaluate().hit);
  run.Set("lower.rotateZ", 0.01);
  const RunFrame frame = run.Evaluate();
  EXPECT_EQ(frame.full_weight, 1);
  EXPECT_EQ(frame.text, "lower.matrix is outside its trained range");
}

// A matrix that no transform makes guards itself.
TEST_F(Untrained, ADrivenMatrixMissesByName) {
  const HelloFolder folder;
  folder.Edit("nodes:\n",
              "nodes:\n  m: {type: multiplyDivide}\n  k: {type: composeMatrix, inputTranslate: m.output}\n"
              "  grip: {type: cluster, matrix: k.outputMatrix, members: {vertices: \"700:793\"}}\n");
  folder.Edit("[skin, cage, mush]", "[skin, cage, grip, mush]");
  folder.Edit("  upper.rotateX:", "  m.input1.x: {min: 0, max: 0.001}\n  upper.rotateX:");
  const auto trained = TrainRig(folder.rig(), QuickTraining());
  ASSERT_NE(trained, nullptr);
  const std::vector<std::string> axis = {"m.input1.y"};
  RigRun full(folder.rig(), {.varying = axis}),
      run(folder.rig(), {.subspace = WithGuardsOnly(*trained), .varying = axis});
  ASSERT_TRUE(run.ok()) << run.error;
  EXPECT_TRUE(run.Evaluate().hit);
  for (const char* plug : {"m.input1.x", "m.input1.y"}) {
    for (RigRun* r : {&full, &run}) r->Set(plug, 1);
    const RunFrame frame = run.Evaluate();
    EXPECT_FALSE(frame.hit) << plug;
    EXPECT_EQ(frame.text, "k.outputMatrix is outside its trained range") << plug;
    EXPECT_TRUE(SameBytes(frame.points, full.Evaluate().points));
    for (RigRun* r : {&full, &run}) r->Set(plug, 0);
  }
}

// Another axis of a trained joint, which is no control: but for small tilts about the third axis, which are
// trained.
TEST_F(Untrained, AnotherAxisOfATrainedJointMisses) {
  const HelloFolder folder;
  const auto trained = TrainRig(folder.rig(), QuickTraining());
  ASSERT_NE(trained, nullptr);
  const std::vector<std::string> axis = {"upper.rotateY", "upper.translateX"};
  RigRun full(folder.rig(), {.varying = axis}), run(folder.rig(), {.subspace = trained, .varying = axis});
  ASSERT_TRUE(run.ok()) << run.error;
  for (const std::string& plug : axis) {
    std::size_t hits = 0;
    for (int step = 0; step <= 20; ++step) {
      for (RigRun* r : {&full, &run}) r->Set(plug, 0.0025 * step * step);
      const RunFrame frame = run.Evaluate();
      hits += frame.hit;
      EXPECT_LE(LargestDistance(frame.points, full.Evaluate().points), 1.2 * kTolerance)
          << plug << " " << step;
    }
    EXPECT_GE(hits, plug == "upper.rotateY" ? 3u : 1u) << plug;
    EXPECT_LT(hits, 10u) << plug;
    for (RigRun* r : {&full, &run}) r->Set(plug, 0);
  }
}

}  // namespace
}  // namespace kpsa::engine
