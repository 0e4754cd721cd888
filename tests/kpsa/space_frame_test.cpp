#include "kpsa/space_frame.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "base/matrix.h"

namespace kpsa::engine {
namespace {

const Matrix4 kTurn = RotationFromEuler({0.4, -0.7, 1.1}, RotateOrder::kXyz);

// Largest difference of the entries.
double Difference(const Matrix4& a, const Matrix4& b) {
  double largest = 0;
  for (std::size_t i = 0; i < 16; ++i) largest = std::max(largest, std::fabs(a.m[i] - b.m[i]));
  return largest;
}

TEST(SpaceFrame, RigidMotionIsItsOwnFrame) {
  const Matrix4 world = Translation({1e5, -2, 3}) * kTurn;
  EXPECT_EQ(InverseRestStretch(world), Matrix4());
  const SpaceFrame frame = SpaceFrameOf(world, Matrix4());
  EXPECT_EQ(frame.world_from_space, world);
  EXPECT_EQ(frame.scale, 1);
  EXPECT_EQ(frame.stretch, 0);
}

// What stands above the space at rest is divided out: its scale, a stretch, even a mirror.
TEST(SpaceFrame, WhatIsThereAtRestIsNoStretch) {
  for (const Double3 scale : {Double3{100, 100, 100}, Double3{0.01, 0.01, 0.01}, Double3{1, 5, 1},
                              Double3{-1, 1, 1}, Double3{-2, -2, -2}}) {
    const Matrix4 rest = Translation({1, 2, 3}) * kTurn * Scaling(scale);
    const Matrix4 inverse = InverseRestStretch(rest);
    const Matrix4 now = Translation({5, 6, 7}) * RotationFromEuler({1, 2, 0.5}, RotateOrder::kXyz) * rest;
    for (const Matrix4& world : {rest, now}) {
      const SpaceFrame frame = SpaceFrameOf(world, inverse);
      EXPECT_NEAR(frame.scale, 1, 1e-9) << scale.x << " " << scale.y;
      EXPECT_LT(frame.stretch, 1e-9) << scale.x << " " << scale.y;
      const Matrix4& f = frame.world_from_space;
      EXPECT_NEAR(Determinant3(f), 1, 1e-9) << "a rotation";
    }
    const SpaceFrame moved = SpaceFrameOf(now, inverse), still = SpaceFrameOf(rest, inverse);
    EXPECT_LT(Difference(moved.world_from_space * InverseOrIdentity(still.world_from_space),
                         now * InverseOrIdentity(rest)),
              1e-9)
        << "the frame moves as the space does";
  }
}

TEST(SpaceFrame, GrowthSinceRestIsAScale) {
  const Matrix4 rest = kTurn * Scaling({100, 100, 100});
  const SpaceFrame frame = SpaceFrameOf(Scaling({3, 3, 3}) * rest, InverseRestStretch(rest));
  EXPECT_NEAR(frame.scale, 3, 1e-9);
  EXPECT_LT(frame.stretch, 1e-9);
}

TEST(SpaceFrame, AnythingElseIsAStretch) {
  EXPECT_NEAR(SpaceFrameOf(Scaling({1, 1.02, 1}), Matrix4()).stretch, 0.0134, 1e-3);
  EXPECT_GT(SpaceFrameOf(kTurn * Scaling({1, 5, 1}), Matrix4()).stretch, 0.5);
  for (const Matrix4& bad : {Scaling({-1, 1, 1}), Scaling({0, 0, 0}), Scaling({1, std::nan(""), 1})})
    EXPECT_EQ(SpaceFrameOf(bad, Matrix4()).stretch, std::numeric_limits<double>::infinity());
  // A stretch that was there at rest, turned by what hangs below it
  const Matrix4 stretch = Scaling({1, 5, 1});
  EXPECT_GT(SpaceFrameOf(stretch * kTurn, InverseRestStretch(stretch)).stretch, 0.1);
}

}  // namespace
}  // namespace kpsa::engine
