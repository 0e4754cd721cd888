#include "kpsa/training/varimax.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/matrix.h"
#include "kpsa/training/cue_selection.h"
#include "kpsa/training/eigen_solvers.h"
#include "tests/kpsa/synthetic.h"

namespace kpsa::engine {
namespace {

Eigen::MatrixXd RandomOrthonormal(Eigen::Index rows, Eigen::Index columns, std::uint64_t seed) {
  Eigen::MatrixXd a = RandomNormal(rows, columns, seed);
  Orthonormalize(&a);
  return a;
}

// Modes that are disjoint bumps: bump k lives on the points [40 k, 40 k + 40) with its peak in the middle.
Eigen::MatrixXd Bumps(Eigen::Index count) {
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(120 * count, count);
  for (Eigen::Index k = 0; k < count; ++k) {
    for (Eigen::Index i = 0; i < 40; ++i) {
      const double q = (static_cast<double>(i) - 19) / 8;
      a.col(k).segment(3 * (40 * k + i), 3) =
          std::exp(-q * q) * Eigen::Vector3d(1, 0.3 * static_cast<double>(k), -0.5);
    }
    a.col(k).normalize();
  }
  return a;
}

TEST(Varimax, KeepsTheSubspaceAndNeverLowersTheCriterion) {
  for (const int components : {3, 1}) {
    const Eigen::MatrixXd before = RandomOrthonormal(240, 12, 1);
    Eigen::MatrixXd after = before;
    const VarimaxResult result = Varimax({}, components, &after);
    EXPECT_LT((after * after.transpose() - before * before.transpose()).cwiseAbs().maxCoeff(), 1e-12);
    EXPECT_LT((after.transpose() * after - Eigen::MatrixXd::Identity(12, 12)).cwiseAbs().maxCoeff(), 1e-12);
    EXPECT_LT((before * result.rotation - after).cwiseAbs().maxCoeff(), 1e-13);
    ASSERT_GT(result.criterion.size(), 2u);
    for (std::size_t i = 1; i < result.criterion.size(); ++i)
      EXPECT_GE(result.criterion[i], result.criterion[i - 1] * (1 - 1e-13));
    EXPECT_GT(result.criterion.back(), result.criterion.front() * 1.05);
    EXPECT_NEAR(VarimaxCriterion(after, components), result.criterion.back(), 1e-9 * result.criterion.back());
  }
}

TEST(Varimax, APairOfModesReachesTheBestAngle) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const Eigen::MatrixXd start = RandomOrthonormal(60, 2, seed);
    double best = 0;
    for (int i = 0; i < 4000; ++i) {
      const double phi = i * 3.14159265358979 / 4000;
      Eigen::Matrix2d turn;
      turn << std::cos(phi), -std::sin(phi), std::sin(phi), std::cos(phi);
      best = std::max(best, VarimaxCriterion(start * turn, 3));
    }
    Eigen::MatrixXd modes = start;
    const VarimaxResult result = Varimax({.max_sweeps = 1}, 3, &modes);
    EXPECT_GE(result.criterion.back(), best * (1 - 1e-9)) << seed;
  }
}

TEST(Varimax, DoesNotDependOnTheFrame) {
  const Eigen::MatrixXd start = RandomOrthonormal(300, 8, 2);
  const Matrix4 frame = RotationFromEuler({0.7, -1.1, 2.3}, RotateOrder::kXyz);
  Eigen::Matrix3d r;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) r(i, j) = frame(i, j);
  }
  Eigen::MatrixXd turned = start;
  for (Eigen::Index i = 0; i < 100; ++i) turned.middleRows(3 * i, 3) = r * start.middleRows(3 * i, 3);
  Eigen::MatrixXd a = start, b = turned;
  const VarimaxResult first = Varimax({}, 3, &a), second = Varimax({}, 3, &b);
  ASSERT_EQ(first.criterion.size(), second.criterion.size());
  for (Eigen::Index i = 0; i < 100; ++i) {
    EXPECT_LT((b.middleRows(3 * i, 3) - r * a.middleRows(3 * i, 3)).cwiseAbs().maxCoeff(), 1e-6);
  }
}

TEST(Varimax, RecoversDisjointBumpsWithKeyPointsOnTheirCentres) {
  const Eigen::MatrixXd bumps = Bumps(6);
  Eigen::MatrixXd mixed = bumps * RandomOrthonormal(6, 6, 3);
  Varimax({}, 3, &mixed);
  const Eigen::MatrixXd overlap = (bumps.transpose() * mixed).cwiseAbs();
  std::vector<Double3> positions;
  for (int i = 0; i < 240; ++i) positions.push_back({static_cast<double>(i), 0, 0});
  const std::vector<CueRef> keys = SelectKeyPoints(mixed, 3, positions, 1, 0);
  ASSERT_EQ(keys.size(), 6u);
  std::vector<bool> found(6);
  for (Eigen::Index k = 0; k < 6; ++k) {
    Eigen::Index bump;
    EXPECT_NEAR(overlap.col(k).maxCoeff(&bump), 1, 1e-6);
    EXPECT_FALSE(found[static_cast<std::size_t>(bump)]);
    found[static_cast<std::size_t>(bump)] = true;
    EXPECT_EQ(keys[static_cast<std::size_t>(k)].index, static_cast<Index>(40 * bump + 19));
  }
}

TEST(KeyPoints, ASecondPointLiesOutsideTheRadiusAndNoPointComesTwice) {
  Eigen::MatrixXd bumps = Bumps(3);
  std::vector<Double3> positions;
  for (int i = 0; i < 120; ++i) positions.push_back({static_cast<double>(i / 2), 0, 0});  // pairs coincide
  const std::vector<CueRef> keys = SelectKeyPoints(bumps, 3, positions, 2, 5);
  ASSERT_EQ(keys.size(), 6u);
  for (std::size_t k = 0; k < 6; k += 2) {
    EXPECT_EQ(keys[k].index, 40 * k / 2 + 19);
    EXPECT_GT(std::fabs(positions[keys[k].index].x - positions[keys[k + 1].index].x), 5);
  }
  Eigen::MatrixXd same(120 * 3, 3);
  same << bumps.col(0), bumps.col(0), bumps.col(0);
  const std::vector<CueRef> distinct = SelectKeyPoints(same, 3, positions, 1, 0);
  ASSERT_EQ(distinct.size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < i; ++j)
      EXPECT_NE(positions[distinct[i].index].x, positions[distinct[j].index].x);
  }
}

}  // namespace
}  // namespace kpsa::engine
