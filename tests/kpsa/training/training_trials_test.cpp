// Of what training calibrated, the cheapest stays, with what was tried besides.
#include "kpsa/training/training_trials.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "kpsa/tiles.h"
#include "kpsa/training/eigen_solvers.h"
#include "kpsa/training/pose_matrix.h"
#include "kpsa/training/tile_builder.h"

namespace kpsa::engine {
namespace {

constexpr double kFullCost = 1000;

// Points that bend with the products of what is measured.
TileMap BentTile() {
  constexpr Eigen::Index kPoints = 64, kInputs = 6, kPoses = 600;
  PoseLayout layout;
  layout.points = static_cast<std::size_t>(kPoints);
  PoseMatrix poses(layout);
  const Eigen::MatrixXd measured = RandomNormal(kInputs, kPoses, 5),
                        linear = 1e-2 * RandomNormal(3 * kPoints, kInputs, 3),
                        bends = 1e-2 * RandomNormal(3 * kPoints, kInputs - 1, 4);
  for (Eigen::Index t = 0; t < kPoses; ++t) {
    const Eigen::VectorXd y = measured.col(t);
    const Eigen::VectorXd points = linear * y + bends * y.head(kInputs - 1).cwiseProduct(y.tail(kInputs - 1));
    std::ranges::copy(points.cast<float>().eval(), poses.AddPose().begin());
  }
  const Eigen::VectorXd mean = poses.Mean();
  poses.Subtract(mean);
  TileInputs inputs;
  inputs.samples = measured.leftCols(100);
  inputs.poses = &poses, inputs.measured = &measured;
  return BuildTiles(linear, mean, 3, inputs, {.rms_budget = 5e-6, .max_budget = 1e-4});
}
CalibratedSubspace Costing(double ns, bool by_tile) {
  CalibratedSubspace tried;
  tried.cost.ns = ns;
  if (by_tile) tried.subspace.tiles.push_back(BentTile());
  return tried;
}
// What is taken of two.
double Taken(double by_tile, double for_all, bool tiles_first, double alike) {
  TrainingTrials trials(kFullCost, alike);
  for (const bool tiles : {tiles_first, !tiles_first})
    trials.Add(tiles ? "tiles" : "all", 0, Costing(tiles ? by_tile : for_all, tiles));
  return trials.Take({}).cost.ns;
}

TEST(TrainingTrials, WhatClipsLoseCountsWhereItIsMore) {
  TrainingTrials trials(kFullCost, 1);
  CalibratedSubspace misses_clips = Costing(200, false), hits_them = Costing(250, false);
  misses_clips.cost.misses = 0.02, misses_clips.cost.lost_of_clips = 0.1;
  hits_them.cost.misses = 0.02, hits_them.cost.lost_of_clips = 0.01;
  trials.Add("misses clips", 0, std::move(misses_clips));
  EXPECT_NEAR(trials.least_ns(), 200 + 0.08 * kFullCost, 1e-9);
  trials.Add("hits them", 0, std::move(hits_them));
  EXPECT_EQ(trials.least_ns(), 250) << "less than others is no gain";
}

TEST(TrainingTrials, CuesOfTilesAreTakenAtTheShareThatIsSaid) {
  ASSERT_TRUE(Costing(1, true).subspace.by_tile());
  ASSERT_FALSE(Costing(1, false).subspace.by_tile());
  for (const bool first : {false, true}) {
    EXPECT_EQ(Taken(200, 300, first, 0.85), 200);
    EXPECT_EQ(Taken(290, 300, first, 0.85), 300) << "hardly cheaper, and clips go elsewhere";
    EXPECT_EQ(Taken(310, 300, first, 0.85), 300);
    EXPECT_EQ(Taken(310, 300, first, 1.4), 310) << "hardly dearer, and clips go elsewhere";
    EXPECT_EQ(Taken(430, 300, first, 1.4), 300);
  }
}

TEST(TrainingTrials, TheRecordTellsOfAllAndOfOneThatWasTaken) {
  TrainingTrials trials(kFullCost, 1);
  trials.Add("dear", 50, Costing(400, false));
  trials.Add("cheap", 50, Costing(150, false));
  EXPECT_EQ(trials.least_ns(), 200);
  // Of earlier ones, those that were calibrated since are told once
  const CalibratedSubspace taken = trials.Take({{"dear", 1, 1, 0, 0.3, true}, {"other", 1, 1, 0, 0.6, true}});
  ASSERT_EQ(taken.record.tried.size(), 3u);
  EXPECT_EQ(taken.record.tried[0].what, "other");
  EXPECT_FALSE(taken.record.tried[0].taken);
  EXPECT_DOUBLE_EQ(taken.record.tried[1].cost, 0.45);
  EXPECT_FALSE(taken.record.tried[1].taken);
  EXPECT_DOUBLE_EQ(taken.record.tried[2].cost, 0.2);
  EXPECT_TRUE(taken.record.tried[2].taken);
}

}  // namespace
}  // namespace kpsa::engine
