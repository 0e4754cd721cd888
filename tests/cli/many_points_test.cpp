// Rigs of many points: training chooses by some of them, and makes tiles of all (kpsa/training/whole_subspace.h).
#include <algorithm>

#include "tests/cli/hello_folder.h"
#include "tests/cli/rig_run.h"

namespace kpsa::engine {
namespace {

// hello, with a second mesh that other deformers move.
class ManyPoints : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new HelloFolder;
    folder_->AddShell();
    folder_->Edit("  mush: {type: deltaMush, iterations: 10}\n",
                  "  mush: {type: deltaMush, iterations: 10}\n  soft: {type: deltaMush, iterations: 4}\n");
    folder_->Edit(
        "  - {meshes: [column], stack: [skin, cage, mush]}\n",
        "  - {meshes: [column], stack: [skin, cage, mush]}\n  - {meshes: [shell], stack: [skin, soft]}\n");
    folder_->Edit("points: [column@mush]", "points: [column@mush, shell@soft]");
  }
  static void TearDownTestSuite() { delete folder_; }
  // by_tile: with cues of each tile, or for all points.
  static TrainOptions Options(bool by_tile) {
    TrainOptions options = QuickTraining();
    options.inner = TrainOptions::Inner::kNever;
    options.samples = 300;
    options.calibration_poses = 100;
    options.may_have_cues_by_tile = by_tile;
    if (by_tile) options.max_modes = 3, options.violation_rate = 0.1;  // too few for cues for all points
    return options;
  }
  static std::shared_ptr<const Subspace> Train(TrainOptions options, std::size_t some) {
    if (some > 0) options.many_points = 1, options.some_points = some;
    return TrainRig(folder_->rig(), options);
  }
  static std::size_t Points() {
    RigRun run(folder_->rig());
    EXPECT_TRUE(run.ok()) << run.error;
    return run.ok() ? run.Evaluate().points.size() / 3 : 0;
  }
  static inline const HelloFolder* folder_ = nullptr;
};

// Where some are all, nothing may differ.
TEST_F(ManyPoints, TilesOfPartsAreThoseOfAllAtOnce) {
  const auto whole = Train(Options(true), 0), parts = Train(Options(true), 1u << 20);
  ASSERT_NE(whole, nullptr);
  ASSERT_NE(parts, nullptr);
  ASSERT_TRUE(whole->by_tile());
  ASSERT_TRUE(parts->by_tile());
  EXPECT_EQ(parts->cues, whole->cues);
  EXPECT_TRUE(std::ranges::equal(parts->calibration, whole->calibration, {}, &CalibrationPair::error,
                                 &CalibrationPair::error));
  ASSERT_EQ(parts->tiles.size(), 2u);
  for (std::size_t m = 0; m < 2; ++m) {
    const TileData &a = whole->tiles[m].data(), &b = parts->tiles[m].data();
    EXPECT_EQ(a.columns, b.columns);
    EXPECT_EQ(a.pairs, b.pairs);
    EXPECT_EQ(a.joint_rows, b.joint_rows);
    EXPECT_TRUE(std::ranges::equal(a.u.span(), b.u.span()));
    EXPECT_TRUE(std::ranges::equal(a.v.span(), b.v.span()));
    EXPECT_TRUE(std::ranges::equal(a.mean.span(), b.mean.span()));
    EXPECT_TRUE(std::ranges::equal(a.w.span(), b.w.span()));
  }
}

// How far a point is off, each mesh by itself.
double LargestOfAMesh(const Subspace& trained, const RunFrame& exact, const RunFrame& frame) {
  double most = 0;
  std::size_t first = 0;
  for (const SubspaceOutput& output : trained.outputs) {
    const auto of = [&](const std::vector<float>& all) {
      return std::vector<float>(all.begin() + static_cast<std::ptrdiff_t>(first),
                                all.begin() + static_cast<std::ptrdiff_t>(first + 3 * output.points));
    };
    most = std::max(most, LargestDistance(of(exact.points), of(frame.points)));
    first += 3 * output.points;
  }
  return most;
}

class BySome : public ManyPoints, public ::testing::WithParamInterface<bool> {};

// By three seeds: how many frames hit after so few samples is a matter of luck (0 to 29 of 40, by seed).
TEST_P(BySome, AllPointsKeepTheTolerance) {
  std::size_t poses = 0, hits = 0, beyond = 0;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    TrainOptions options = Options(GetParam());
    options.seed = seed;
    const auto trained = Train(options, Points() / 3);
    ASSERT_NE(trained, nullptr);
    EXPECT_EQ(trained->by_tile(), GetParam());
    RigRun full(folder_->rig()), run(folder_->rig(), {.subspace = trained});
    ASSERT_TRUE(run.ok()) << run.error;
    std::size_t points = 0;
    for (const SubspaceOutput& output : trained->outputs) points += output.points;
    EXPECT_EQ(points, Points());
    for (const auto& pose : SmoothPoses(run.rig, 40, 0.6)) {
      full.Pose(pose), run.Pose(pose);
      const RunFrame exact = full.Evaluate(), frame = run.Evaluate();
      ++poses;
      hits += frame.hit;
      beyond += LargestOfAMesh(*trained, exact, frame) > options.tolerance;
    }
  }
  EXPECT_GT(hits, poses / 4);
  EXPECT_LE(static_cast<double>(beyond), 0.1 * static_cast<double>(poses));
}

INSTANTIATE_TEST_SUITE_P(All, BySome, ::testing::Bool(),
                         [](const auto& tested) { return tested.param ? "ByTile" : "ForAllPoints"; });

TEST_F(ManyPoints, GiveTheSameBytesAgain) {
  const auto once = Train(Options(false), Points() / 4), again = Train(Options(false), Points() / 4);
  ASSERT_NE(once, nullptr);
  ASSERT_NE(again, nullptr);
  const TemporaryFolder folder;
  ASSERT_TRUE(WriteSubspace(*once, folder / "a.kpsa").ok());
  ASSERT_TRUE(WriteSubspace(*again, folder / "b.kpsa").ok());
  EXPECT_EQ(TemporaryFolder::Read(folder / "a.kpsa"), TemporaryFolder::Read(folder / "b.kpsa"));
}

}  // namespace
}  // namespace kpsa::engine
