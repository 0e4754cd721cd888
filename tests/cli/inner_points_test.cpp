// Subspaces that reconstruct the points before the last step of a deltaMush, and run that step themselves: of all points,
// or of some.
#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <numeric>
#include <utility>

#include "kpsa/partial_step.h"
#include "kpsa/training_record.h"
#include "tests/cli/hello_folder.h"
#include "tests/cli/process.h"
#include "tests/cli/rig_run.h"

namespace kpsa::engine {
namespace {

TrainOptions InnerTraining(TrainOptions::Inner inner = TrainOptions::Inner::kAlways) {
  TrainOptions options = QuickTraining();
  options.inner = inner;
  return options;
}

// Points lie in the space of a joint, and so does what deforms them.
void CarryByLower(const HelloFolder& folder) {
  folder.Edit("mush: {type: deltaMush, iterations: 10}",
              "mush: {type: deltaMush, iterations: 10, parent: lower}");
  folder.Edit("divisions: [2, 5, 2], members: all}", "divisions: [2, 5, 2], members: all, parent: lower}");
  folder.Edit("subspace: hello.kpsa", "space: lower, subspace: hello.kpsa");
}

// Which points go through the step: of tiles, as files of version 12 have them, or any. These lie about the bend.
enum class Stepped : std::uint8_t { kAll, kTiles, kPoints };

class InnerPoints : public ::testing::TestWithParam<Stepped> {
 protected:
  void SetUp() override {
    if (folder_ == nullptr) WriteRig();
    std::shared_ptr<const Subspace>& known = prepared_[GetParam()];
    if (known == nullptr) {
      TrainOptions options = InnerTraining();
      options.stepped = {SteppedOf(GetParam())};
      known = TrainRig(folder_->rig(), options);
    }
    trained_ = known;
    ASSERT_NE(trained_, nullptr);
    ASSERT_EQ(trained_->outputs.size(), 1u);
    EXPECT_EQ(trained_->outputs[0].stepped, SteppedOf(GetParam()));
  }
  static SteppedPoints SteppedOf(Stepped which) {
    RigRun run(folder_->rig());
    const auto total = run.rig.scene.meshes[0].mesh().point_count();
    if (which == Stepped::kAll) return {};
    if (which == Stepped::kTiles) return {PointsOfTiles(std::vector<Index>{2, 3}, total), {}};
    std::vector<Index> points = PointsOfTiles(std::vector<Index>{2, 3}, total);
    std::erase_if(points, [](Index p) { return p % 37 == 0; });
    run.target = MakeTarget(run.rig, run.rig.accelerate[0]);
    const auto split = SplitMeshes(*run.rig.graph, &run.compiler, run.target);
    return LayOut(*split->at(0).step, points);
  }
  static void WriteRig() {
    folder_ = new HelloFolder;
    CarryByLower(*folder_);
  }
  static void TearDownTestSuite() {
    trained_.reset(), prepared_.clear();
    delete std::exchange(folder_, nullptr);
  }
  static inline const HelloFolder* folder_ = nullptr;
  static inline std::shared_ptr<const Subspace> trained_;
  static inline std::map<Stepped, std::shared_ptr<const Subspace>> prepared_;
};

TEST_P(InnerPoints, HitsRunNoMushAndKeepTheTolerance) {
  const SubspaceOutput& output = trained_->outputs[0];
  if (GetParam() == Stepped::kAll) {
    EXPECT_EQ(output.inner, output.points) << "all weights are 1";
  } else {
    EXPECT_GT(output.inner, output.points) << "what frames about the others read";
    EXPECT_LT(output.inner, 2 * output.points);
  }
  EXPECT_EQ(trained_->outputs[0].name, "column@mush");
  RigRun full(folder_->rig()), run(folder_->rig(), {.subspace = trained_});
  ASSERT_TRUE(run.ok()) << run.error;
  std::size_t hits = 0, beyond = 0, misses = 0;
  auto poses = SmoothPoses(run.rig, 60, 1.3);
  for (const Control& control : run.rig.controls) {  // far beyond all ranges
    std::vector<double>& far = poses.emplace_back();
    for (const Control& other : run.rig.controls) far.push_back(&other == &control ? 4 * other.max : 0);
  }
  for (const auto& pose : poses) {
    full.Pose(pose), run.Pose(pose);
    const RunFrame exact = full.Evaluate(), frame = run.Evaluate();
    hits += frame.hit, misses += frame.full_weight == 1;
    if (frame.hit) beyond += LargestDistance(frame.points, exact.points) > kQuickTolerance;
    EXPECT_EQ(SameBytes(frame.points, exact.points), frame.full_weight == 1);
  }
  EXPECT_GT(hits, poses.size() / 4);
  EXPECT_LE(beyond, poses.size() / 20);
  EXPECT_GT(misses, 0u);
  EXPECT_EQ(run.Computes("mush"), poses.size() - hits) << "blends and misses";
}

// The step runs in the space: what carries that, turns it and makes it larger does the same to the detail.
TEST_P(InnerPoints, GrowAndTravelWithTheSpace) {
  const std::vector<std::string> moving = {"lower.translateX", "lower.rotateY", "lower.scaleX",
                                           "lower.scaleY", "lower.scaleZ"};
  RigRun full(folder_->rig(), {.varying = moving}),
      run(folder_->rig(), {.subspace = trained_, .varying = moving});
  ASSERT_TRUE(run.ok()) << run.error;
  std::size_t hits = 0;
  for (const auto& pose : SmoothPoses(run.rig, 20, 0.7)) {
    const double t = static_cast<double>(hits + 1) / 20;
    for (RigRun* of : {&full, &run}) {
      of->Pose(pose);
      of->Set("lower.translateX", 3 * t), of->Set("lower.rotateY", 2 * t);
      for (const char* scale : {"lower.scaleX", "lower.scaleY", "lower.scaleZ"}) of->Set(scale, 1 + 0.7 * t);
    }
    const RunFrame frame = run.Evaluate();
    if (!frame.hit) continue;
    ++hits;
    EXPECT_LE(LargestDistance(frame.points, full.Evaluate().points), 1.5 * kQuickTolerance);
  }
  EXPECT_GT(hits, 5u);
}

TEST_P(InnerPoints, SomePointsHaveTheBitsOfAll) {
  RigRun run(folder_->rig(), {.subspace = trained_, .accelerate = {.tolerance = kInfinity}});
  ASSERT_TRUE(run.ok()) << run.error;
  const auto total = static_cast<Index>(trained_->outputs[0].points);
  ExpectBitsOfAll(&run, {{0}, {total / 2}, {1, 5, total / 3, total - 1}, {total - 2, total - 1}});
}

// What the step has besides points may vary: then nothing is reconstructed.
TEST_P(InnerPoints, MissWhereTheStepVaries) {
  const std::vector<std::string> varying = {"mush.envelope"};
  RigRun full(folder_->rig(), {.varying = varying}),
      run(folder_->rig(), {.subspace = trained_, .varying = varying});
  ASSERT_TRUE(run.ok()) << run.error;
  for (const double envelope : {1.0, 0.5}) {
    for (const auto& pose : SmoothPoses(run.rig, 3, 0.8)) {
      for (RigRun* of : {&full, &run}) of->Pose(pose), of->Set("mush.envelope", envelope);
      EXPECT_TRUE(SameBytes(run.Evaluate().points, full.Evaluate().points));
    }
  }
}

TEST_P(InnerPoints, AreInTheFile) {
  const std::string path = *folder_ / "inner.kpsa";
  ASSERT_TRUE(WriteSubspace(*trained_, path).ok());
  const std::string bytes = folder_->Read(path);
  const int versions[] = {kInnerVersion, kPartialVersion, kSteppedPointsVersion};
  EXPECT_NE(bytes.find(fmt::format("\"version\":\"{}\"", versions[static_cast<int>(GetParam())])),
            std::string::npos)
      << "programs that do not know of them say so";
  const Result<Subspace> read = ReadSubspace(path);
  ASSERT_TRUE(read.ok()) << read.status().ToString();
  EXPECT_EQ(read->outputs, trained_->outputs);
  RigRun before(folder_->rig(), {.subspace = trained_}),
      after(folder_->rig(), {.subspace = std::make_shared<const Subspace>(*read)});
  for (const auto& pose : SmoothPoses(before.rig, 5, 0.8)) {
    before.Pose(pose), after.Pose(pose);
    EXPECT_TRUE(SameBytes(before.Evaluate().points, after.Evaluate().points));
  }
  const ProcessResult inspected = RunKpsa({"inspect", path});
  const std::size_t stepped = trained_->outputs[0].stepped.points.size();
  EXPECT_NE(
      inspected.out.find(stepped == 0 ? "points before the last step"
                                      : fmt::format("points, and {} of them before the last step", stepped)),
      std::string::npos)
      << inspected.out << inspected.err;
  Subspace fewer = *trained_;
  fewer.outputs[0].inner = fewer.outputs[0].points - 1;
  EXPECT_FALSE(ValidateSubspace(fewer).ok());
  const auto total = static_cast<Index>(trained_->outputs[0].points);
  for (const std::vector<Index>& points : {std::vector<Index>{1, 1}, {2, 1}, {total}, {5}}) {
    Subspace wrong = *trained_;
    wrong.outputs[0].stepped = {points, {}};
    EXPECT_FALSE(ValidateSubspace(wrong).ok()) << points[0];
  }
  for (const std::vector<Index>& starts : {std::vector<Index>{0, 16}, {16, 32}, {0, 0}, {0, 8}}) {
    Subspace wrong = *trained_;
    wrong.outputs[0].stepped = {{5}, starts};
    EXPECT_FALSE(ValidateSubspace(wrong).ok()) << starts[0] << " " << starts[1];
  }
}

// Points about which the rig's step reads others.
TEST_P(InnerPoints, OfOtherPointsAreRefused) {
  Subspace other = *trained_;
  other.outputs[0].stepped = {PointsOfTiles(std::vector<Index>{0, 2, 4}, other.outputs[0].points), {}};
  const RigRun run(folder_->rig(), {.subspace = std::make_shared<const Subspace>(std::move(other))});
  ASSERT_FALSE(run.ok());
  EXPECT_NE(run.error.find("train it again"), std::string::npos) << run.error;
}

// A value outside its range costs the patches that it speaks of. Only where a tile holds all that the step reads about its
// points are others what they would be without it.
TEST_P(InnerPoints, MissInPartsWhereTilesHoldWhatTheirStepsRead) {
  ASSERT_GT(trained_->doubt_inputs(), 0u);
  auto guarded = std::make_shared<Subspace>(*WithGuardsOnly(*trained_));
  guarded->score = {0, 1 / kQuickTolerance};
  guarded->patches = MakePatchLayout(guarded->tiles_of_outputs());
  ASSERT_GT(guarded->patches.tiles, 0u);
  for (const PatchRegion& region : guarded->patches.regions)
    guarded->patches.costs.push_back(0.02 * region.count);
  TrainedRange& range =
      *std::ranges::max_element(guarded->ranges, {}, [](const TrainedRange& one) { return one.hi - one.lo; });
  range.hi = range.lo + 0.4 * (range.hi - range.lo), range.ramp = (range.hi - range.lo) / 20;
  constexpr std::size_t kPatch = 2;
  for (TrainedRange& one : guarded->ranges) one.patches = std::uint64_t{1} << kPatch;
  if (GetParam() != Stepped::kPoints) {
    const std::string refused = ValidateSubspace(*guarded).ToString();
    EXPECT_NE(refused.find(fmt::format("inner ones of 3 components in {} patches", guarded->patches.tiles)),
              std::string::npos)
        << refused;
    return;
  }
  const std::string path = *folder_ / "parts.kpsa";
  ASSERT_TRUE(WriteSubspace(*guarded, path).ok()) << ValidateSubspace(*guarded).ToString();
  EXPECT_NE(folder_->Read(path).find(fmt::format("\"version\":\"{}\"", kSteppedPatchesVersion)),
            std::string::npos);
  const Result<Subspace> read = ReadSubspace(path);
  ASSERT_TRUE(read.ok()) << read.status().ToString();
  EXPECT_EQ(read->patches, guarded->patches);
  RigRun full(folder_->rig()), run(folder_->rig(), {.subspace = std::make_shared<const Subspace>(*read)}),
      pure(folder_->rig(), {.subspace = trained_, .accelerate = {.tolerance = kInfinity}});
  ASSERT_TRUE(run.ok()) << run.error;
  const PatchPoints& patch = run.accelerated.config->data().patches[kPatch];
  const SubspaceOutput& output = trained_->outputs[0];
  const std::size_t tiles = guarded->patches.tiles;
  const Index first = output.stepped.PointsOf(kPatch * tiles, output.points).begin,
              end = output.stepped.PointsOf((kPatch + 1) * tiles - 1, output.points).end;
  EXPECT_NE(first % kTilePoints, 0u) << "tiles have fewer points";
  std::size_t hits = 0, misses = 0;
  for (const auto& pose : SmoothPoses(run.rig, 60, 0.9)) {
    for (RigRun* of : {&full, &run, &pure}) of->Pose(pose);
    const RunFrame exact = full.Evaluate(), frame = run.Evaluate(), reconstructed = pure.Evaluate();
    hits += frame.hit;
    EXPECT_EQ(frame.hit, SameBytes(frame.points, reconstructed.points));
    if (frame.hit || frame.full_weight < 1 / static_cast<double>(guarded->patches.patches) - 1e-6) continue;
    EXPECT_EQ(frame.reason, MissReason::kOutOfRange);
    if (frame.full_weight > 1.5 / static_cast<double>(guarded->patches.patches)) continue;  // all guards ask
    ++misses;
    for (std::size_t i = 0; i < output.points; ++i) {
      const bool reached = std::ranges::binary_search(patch.points, static_cast<Index>(i));
      for (std::size_t a = 0; a < 3; ++a) {
        const std::size_t at = a * output.points + i;
        if (!reached) {
          ASSERT_EQ(frame.points[at], reconstructed.points[at]) << i;
        } else if (i >= first && i < end) {
          ASSERT_EQ(frame.points[at], exact.points[at]) << i;
        }
      }
    }
  }
  EXPECT_GT(hits, 5u);
  EXPECT_GT(misses, 3u);
}

std::string NameOf(const ::testing::TestParamInfo<Stepped>& of) {
  const char* const names[] = {"AllPoints", "SomeTiles", "SomePoints"};
  return names[static_cast<int>(of.param)];
}
INSTANTIATE_TEST_SUITE_P(Of, InnerPoints, ::testing::Values(Stepped::kAll, Stepped::kTiles, Stepped::kPoints),
                         NameOf);

// Of some smooth poses, those that hit: more than five, within a tolerance and a half.
void ExpectHitsNear(const HelloFolder& folder, const std::shared_ptr<const Subspace>& trained,
                    double tolerance) {
  RigRun full(folder.rig()), run(folder.rig(), {.subspace = trained});
  ASSERT_TRUE(run.ok()) << run.error;
  std::size_t hits = 0;
  for (const auto& pose : SmoothPoses(run.rig, 20, 0.7)) {
    full.Pose(pose), run.Pose(pose);
    const RunFrame frame = run.Evaluate();
    if (!frame.hit) continue;
    ++hits;
    EXPECT_LE(LargestDistance(frame.points, full.Evaluate().points), 1.5 * tolerance);
  }
  EXPECT_GT(hits, 5u);
}

// Points that are mixed with what comes in need both; borders and weights of 0 are what comes in.
TEST(InnerPointsOfRigs, OfAMushWithAWeightMap) {
  const HelloFolder folder;
  const std::size_t count = RigRun(folder.rig()).rig.scene.meshes[0].mesh().point_count();
  folder.Write("mush.json",
               fmt::format(R"({{"kpsa": "weights", "version": 1, "mesh": "column", "points": {}, "maps": {{
      "mush": {{"default": 0.4, "indices": [0, 1, 2, 40, 41, 42], "values": [0, 1, 1, 0, 1, 0]}}}}}})",
                           count));
  folder.Edit("mush: {type: deltaMush, iterations: 10}",
              "mush: {type: deltaMush, iterations: 10, weights: \"mush.json#mush\"}");
  const auto trained = TrainRig(folder.rig(), InnerTraining());
  ASSERT_NE(trained, nullptr);
  EXPECT_GT(trained->outputs[0].inner, trained->outputs[0].points);
  ExpectHitsNear(folder, trained, kQuickTolerance);
}

TEST(InnerPointsOfRigs, NotWhereAControlReachesTheStep) {
  const HelloFolder folder;
  folder.Edit("  upper.rotateX:", "  mush.displacement: {min: 0, max: 1}\n  upper.rotateX:");
  const auto trained = TrainRig(folder.rig(), InnerTraining());
  ASSERT_NE(trained, nullptr);
  EXPECT_FALSE(trained->of_inner());
}

// They are tried where what comes out is dear, and taken where they are clearly cheaper. Of several with inner points,
// cues of tiles and fine tiles have to be clearly cheaper than others.
TEST(InnerPointsOfRigs, AreTakenWhereTheyCostLess) {
  const HelloFolder folder;
  std::size_t inner = 0, tried = 0;
  for (const double tolerance : {2e-5, 5e-4, 1e-2}) {
    TrainOptions options = InnerTraining(TrainOptions::Inner::kIfCheaper);
    options.tolerance = tolerance;
    const auto trained = TrainRig(folder.rig(), options);
    ASSERT_NE(trained, nullptr);
    double least_of_inner = kInfinity, taken = 0;
    bool took_inner = false;
    for (const TrainingRecord::Tried& one : ParseTraining(trained->training).tried) {
      if (one.what.ends_with(kBeforeLastStep)) least_of_inner = std::min(least_of_inner, one.cost);
      if (one.taken) taken = one.cost, took_inner = one.what.ends_with(kBeforeLastStep);
    }
    tried += least_of_inner < kInfinity, inner += trained->of_inner();
    EXPECT_EQ(took_inner, trained->of_inner());
    if (took_inner) {
      EXPECT_LT(0.85 * 0.9 * taken, least_of_inner);
    }
    if (least_of_inner < 0.5 * taken) ADD_FAILURE() << tolerance << " takes what costs twice as much";
  }
  EXPECT_GE(tried, 1u);
  EXPECT_GE(inner, 1u);
  EXPECT_LT(tried, 3u) << "not where hits cost next to nothing";
}

// What is set on the step was never seen: every frame is evaluated fully.
TEST(InnerPointsOfRigs, AnotherEnvelopeMisses) {
  const HelloFolder folder;
  const auto trained = TrainRig(folder.rig(), InnerTraining());
  ASSERT_NE(trained, nullptr);
  for (const char* envelope : {"0", "0.5"}) {
    folder.Write("hello.yaml", HelloFolder::Yaml());
    folder.Edit("mush: {type: deltaMush, iterations: 10}",
                std::string("mush: {type: deltaMush, iterations: 10, envelope: ") + envelope + "}");
    RigRun full(folder.rig()),
        run(folder.rig(), {.subspace = trained, .accelerate = {.stale_is_miss = true}});
    ASSERT_TRUE(run.ok()) << run.error;
    for (const auto& pose : SmoothPoses(run.rig, 4, 0.7)) {
      full.Pose(pose), run.Pose(pose);
      const RunFrame frame = run.Evaluate();
      EXPECT_EQ(frame.full_weight, 1);
      EXPECT_TRUE(SameBytes(frame.points, full.Evaluate().points));
    }
  }
}

// Training finds the points: those of the bend, and fewer for a larger tolerance; also where it looks at some of them.
TEST(InnerPointsOfRigs, AreOfThePointsThatNeedThem) {
  const HelloFolder folder;
  CarryByLower(folder);
  std::vector<std::size_t> stepped;
  for (const auto& [tolerance, many] : {std::pair{2e-4, 24'000u}, {2e-3, 24'000u}, {2e-3, 500u}}) {
    SCOPED_TRACE(fmt::format("{} {}", tolerance, many));
    TrainOptions options = InnerTraining(TrainOptions::Inner::kIfCheaper);
    options.tolerance = tolerance;
    options.rows = 60, options.min_points = 4, options.max_modes = 8;  // that miss much
    options.many_points = many, options.some_points = many;
    const auto trained = TrainRig(folder.rig(), options);
    ASSERT_NE(trained, nullptr);
    const SubspaceOutput& output = trained->outputs[0];
    stepped.push_back(output.stepped.points.size());
    EXPECT_LT(stepped.back(), output.points / 2);
    ExpectHitsNear(folder, trained, tolerance);
  }
  EXPECT_GT(stepped[0], stepped[1]);
  EXPECT_GT(stepped[1], 0u);
  EXPECT_GT(stepped[2], stepped[1]) << "and those between them";

  // With many tiles before anything is found for all points, where few are poor
  TrainOptions options = InnerTraining(TrainOptions::Inner::kIfCheaper);
  options.tolerance = 2e-3, options.many_tiles = 1;
  const auto first = TrainRig(folder.rig(), options);
  ASSERT_NE(first, nullptr);
  EXPECT_GT(first->outputs[0].stepped.points.size(), 0u);
  const std::vector<TrainingRecord::Tried> tried = ParseTraining(first->training).tried;
  ASSERT_FALSE(tried.empty());
  for (const TrainingRecord::Tried& one : tried)
    EXPECT_TRUE(one.what.ends_with(kBeforeLastStepOfSome)) << one.what;
  ExpectHitsNear(folder, first, options.tolerance);
}

// Few of the judges miss, but calibration costs clips more than a frame in twenty: what a step of some points would save is
// then looked at, too.
TEST(InnerPointsOfRigs, AreTakenForWhatClipsLose) {
  const HelloFolder folder;
  CarryByLower(folder);
  TrainOptions options = InnerTraining(TrainOptions::Inner::kIfCheaper);
  options.tolerance = 4e-3, options.many_tiles = 1, options.samples = 500;
  options.violation_rate = 0.1, options.calibration_poses = 60;
  const auto trained = TrainRig(folder.rig(), options, {"wave"});
  ASSERT_NE(trained, nullptr);
  EXPECT_GT(trained->outputs[0].stepped.points.size(), 0u);
  double of_all = 0, taken = kInfinity;
  for (const TrainingRecord::Tried& one : ParseTraining(trained->training).tried) {
    if (one.what == kByTile) of_all = one.cost;
    if (!one.taken) continue;
    EXPECT_TRUE(one.what.ends_with(kBeforeLastStepOfSome)) << one.what;
    taken = one.cost;
  }
  EXPECT_LT(taken, 0.5 * of_all) << "which had been calibrated";
  ExpectHitsNear(folder, trained, options.tolerance);
}

}  // namespace
}  // namespace kpsa::engine
