// Two flaps that bend by themselves, a tile each: what one of them has to learn leaves the other as it is.
#include "kpsa/training/tile_learning.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <random>

#include "kpsa/training/cue_values.h"
#include "kpsa/training/tile_splice.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kFlapPoints = kTilePoints;
constexpr double kFlapTolerance = 2e-3;

PoseLayout FlapsLayout() {
  PoseLayout layout;
  layout.points = 2 * kFlapPoints;
  layout.scalars = 24;  // the matrices of both hinges
  return layout;
}

// Angles of the flaps, each in a range.
struct Bends {
  double lo[2] = {-0.8, -0.8}, hi[2] = {0.8, 0.8};
};
// A flap bends along its length, and bulges with the square of the angle.
PoseMatrix FlapPoses(std::size_t count, unsigned seed, const Bends& bends = {}) {
  std::mt19937 random(seed);
  PoseMatrix poses(FlapsLayout());
  for (std::size_t t = 0; t < count; ++t) {
    const std::span<float> row = poses.AddPose();
    for (std::size_t f = 0; f < 2; ++f) {
      const double angle = std::uniform_real_distribution<double>(bends.lo[f], bends.hi[f])(random);
      Affine hinge;
      hinge << Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()).toRotationMatrix(),
          Eigen::Vector3d(0, 0, static_cast<double>(f));
      for (std::size_t i = 0; i < kFlapPoints; ++i) {
        const double along = (static_cast<double>(i) + 0.5) / kFlapPoints,
                     turn = 2.4 * static_cast<double>(i);
        const double thick = 0.05 * (1 + 0.2 * angle * angle * along);
        const Eigen::AngleAxisd bent(angle * std::min(1.0, 2 * along), Eigen::Vector3d::UnitZ());
        const Eigen::Vector3d at =
            bent * Eigen::Vector3d(along, thick * std::cos(turn), thick * std::sin(turn)) + hinge.col(3);
        for (std::size_t c = 0; c < 3; ++c)
          row[3 * (f * kFlapPoints + i) + c] = static_cast<float>(at[static_cast<Eigen::Index>(c)]);
      }
      for (std::size_t e = 0; e < 12; ++e)
        row[poses.layout().scalar_begin() + 12 * f + e] = static_cast<float>(hinge.data()[e]);
    }
  }
  return poses;
}

double LargestOf(const std::vector<double>& values) { return *std::ranges::max_element(values); }

class TileLearning : public ::testing::Test {
 protected:
  TileLearning() : poses_(FlapPoses(600, 1)), mean_(poses_.Mean()) {
    poses_.Subtract(mean_);
    for (std::size_t f = 0; f < 2; ++f) {
      TileCandidates tile;
      tile.first_column = 3 * kFlapPoints * f, tile.height = 3 * kFlapPoints;
      tile.joints = {static_cast<Index>(12 * f)};
      for (Index i = 0; i < kFlapPoints; i += 8)
        tile.points.push_back({CueKind::kOutput, static_cast<Index>(kFlapPoints * f) + i});
      tile.own_points = tile.points.size();
      candidates_.push_back(std::move(tile));
    }
    training_.mean = &mean_;
    training_.cues.tolerance = kFlapTolerance, training_.cues.mean = &mean_, training_.cues.turn_reach = 0.03;
    training_.storage = {.rms_budget = 0.03 * kFlapTolerance, .max_budget = 0.2 * kFlapTolerance};
    made_ = MakeTileSubspace(mean_, poses_, 0, ChooseTiles(mean_, poses_, candidates_, training_.cues),
                             {{"flaps", 2 * kFlapPoints}}, training_.storage);
    doubt_ = LargestOf(TryTiles(made_, mean_, poses_).of_poses);
  }
  PoseMatrix Centered(PoseMatrix poses) const {
    poses.Subtract(mean_);
    return poses;
  }
  std::vector<char> ToTeach(const TileSubspace& made, const PoseMatrix& poses) const {
    return TilesToTeach(TryTiles(made, mean_, poses), TryTiles(made, mean_, poses_), kFlapTolerance / 2,
                        doubt_);
  }
  // From all poses so far, and these.
  TileSubspace Teach(const TileSubspace& made, const PoseMatrix& lesson) {
    const std::vector<char> taught = ToTeach(made, lesson);
    poses_.Append(lesson);
    return TeachTiles(made, taught, poses_, candidates_, training_);
  }
  // What a tile reads.
  static std::vector<std::pair<CueRef, std::uint32_t>> Read(const TileSubspace& made, std::size_t tile) {
    const TileData& data = made.subspace.tiles[0].data();
    std::vector<std::pair<CueRef, std::uint32_t>> read;
    std::size_t begin = 0;
    for (std::size_t t = 0; t < tile; ++t) begin += data.counts[t];
    for (std::size_t c = begin; c < begin + data.counts[tile]; ++c) {
      const auto cue = static_cast<std::size_t>(std::ranges::upper_bound(made.cues.offsets, data.columns[c]) -
                                                made.cues.offsets.begin() - 1);
      read.emplace_back(made.cues.cues[cue], data.columns[c] - made.cues.offsets[cue]);
    }
    return read;
  }

  PoseMatrix poses_;
  Eigen::VectorXd mean_;
  std::vector<TileCandidates> candidates_;
  TileTraining training_;
  TileSubspace made_;
  double doubt_ = 0;
};

constexpr Bends kSecondFar{{-0.8, 1.4}, {0.8, 1.8}}, kFirstFar{{-1.8, -0.8}, {-1.4, 0.8}};

TEST_F(TileLearning, KnownPosesTeachNothing) {
  const PoseMatrix known = Centered(FlapPoses(100, 1));  // these were trained on
  EXPECT_EQ(ToTeach(made_, known), (std::vector<char>{0, 0}));
  const TileSubspace same = Teach(made_, known);
  EXPECT_EQ(SameTiles(same.subspace.tiles[0], made_.subspace.tiles[0]), (std::vector<char>{1, 1}));
  EXPECT_EQ(same.subspace.cue_mean, made_.subspace.cue_mean);
}

TEST_F(TileLearning, OnlyTheTileThatMissesLearns) {
  const PoseMatrix lesson = Centered(FlapPoses(60, 2, kSecondFar)),
                   fresh = Centered(FlapPoses(60, 3, kSecondFar));
  EXPECT_EQ(ToTeach(made_, lesson), (std::vector<char>{0, 1}));
  const TileSubspace taught = Teach(made_, lesson);
  EXPECT_EQ(SameTiles(taught.subspace.tiles[0], made_.subspace.tiles[0]), (std::vector<char>{1, 0}));
  EXPECT_EQ(Read(taught, 0), Read(made_, 0));
  const TileTrial before = TryTiles(made_, mean_, fresh), after = TryTiles(taught, mean_, fresh);
  EXPECT_GT(before.errors[1], 2 * kFlapTolerance);
  EXPECT_LT(after.errors[1], kFlapTolerance);
  EXPECT_EQ(after.errors[0], before.errors[0]) << "bit for bit";
  EXPECT_EQ(after.doubts[0], before.doubts[0]);
  // What it knew, it knows
  const TileTrial old = TryTiles(taught, mean_, Centered(FlapPoses(100, 4)));
  EXPECT_LT(LargestOf(old.errors), kFlapTolerance);
}

TEST_F(TileLearning, WhatWasLearntStaysAsItWasWhileOthersLearn) {
  const TileSubspace second = Teach(made_, Centered(FlapPoses(60, 2, kSecondFar)));
  const PoseMatrix lesson = Centered(FlapPoses(60, 5, kFirstFar));
  EXPECT_EQ(ToTeach(second, lesson), (std::vector<char>{1, 0}));
  const TileSubspace both = Teach(second, lesson);
  EXPECT_EQ(SameTiles(both.subspace.tiles[0], second.subspace.tiles[0]), (std::vector<char>{0, 1}));
  EXPECT_EQ(Read(both, 1), Read(second, 1));
  const Bends far[] = {kSecondFar, kFirstFar};
  for (const Bends& bends : far) {
    const TileTrial trial = TryTiles(both, mean_, Centered(FlapPoses(60, 6, bends)));
    EXPECT_LT(LargestOf(trial.errors), kFlapTolerance);
  }
}

// Against tiles that are known by their bytes.
TEST_F(TileLearning, SplicedTilesAreThoseOfEither) {
  const TileMap& map = made_.subspace.tiles[0];
  TileSubspace taught = Teach(made_, Centered(FlapPoses(60, 2, kSecondFar)));
  TileData wider = map.data();
  wider.inputs = taught.subspace.rows();
  const Result<TileMap> first = TileMap::Make(wider, "first");
  ASSERT_TRUE(first.ok());
  const TileMap& second = taught.subspace.tiles[0];
  for (const std::vector<char>& taken : {std::vector<char>{0, 0}, {0, 1}, {1, 0}, {1, 1}}) {
    const TileMap spliced = SpliceTiles(*first, second, taken);
    const std::vector<char> of_first = SameTiles(spliced, *first), of_second = SameTiles(spliced, second);
    for (std::size_t t = 0; t < 2; ++t) EXPECT_TRUE((taken[t] != 0 ? of_second : of_first)[t]) << t;
    EXPECT_EQ(of_second[1], taken[1]) << "the second one was taught";
  }
}

}  // namespace
}  // namespace kpsa::engine
