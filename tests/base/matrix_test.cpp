#include "base/matrix.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "base/scalar_math.h"

namespace kpsa::engine {
namespace {

double MaxDifference(const Matrix4& a, const Matrix4& b) {
  double largest = 0;
  for (std::size_t i = 0; i < 16; ++i) largest = std::max(largest, std::fabs(a.m[i] - b.m[i]));
  return largest;
}

TEST(ScalarMath, AgreesWithTheCLibraryToAFewUlp) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> wide(-50, 50), unit(-1, 1);
  for (int i = 0; i < 100000; ++i) {
    const double x = wide(random), u = unit(random), v = unit(random);
    EXPECT_NEAR(Sin(x), std::sin(x), 3e-16);
    EXPECT_NEAR(Cos(x), std::cos(x), 3e-16);
    EXPECT_NEAR(Atan2(u, v), std::atan2(u, v), 1e-15);
    EXPECT_NEAR(Acos(u), std::acos(u), 1e-15);
    EXPECT_NEAR(Asin(u), std::asin(u), 1e-15);
    EXPECT_NEAR(Exp(x) / std::exp(x), 1, 2e-15);
    EXPECT_NEAR(Log(std::fabs(x) + 1e-9), std::log(std::fabs(x) + 1e-9), 1e-14);
  }
  EXPECT_EQ(Atan2(0.0, -1.0), kPi);
  EXPECT_EQ(Atan2(-0.0, -1.0), -kPi);
  EXPECT_TRUE(std::isnan(Sin(INFINITY)));
  EXPECT_NEAR(Sin(1e8), std::sin(1e8), 1e-8);
}

TEST(Vectors, UnitOrZeroHasNoOtherLength) {
  EXPECT_EQ(UnitOrZero({0, -4, 0}), (Double3{0, -1, 0}));
  EXPECT_NEAR(Length(UnitOrZero({1e-3, 2, -5e4})), 1, 1e-15);
  EXPECT_EQ(UnitOrZero({}), Double3());
  EXPECT_EQ(UnitOrZero({1, NAN, 0}), Double3());
  EXPECT_EQ(UnitOrZero({0, INFINITY, 0}), Double3());
  EXPECT_EQ(UnitOrZero({1e200, 1, -1e200}), Double3());
  EXPECT_EQ(UnitOrZero({0, 1e-170, 0}), Double3());
}

TEST(Matrix, EulerAnglesComeBackForEveryOrder) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> angle(-1.5, 1.5);
  for (int order = 0; order < 6; ++order) {
    for (int i = 0; i < 200; ++i) {
      const Double3 euler{angle(random), angle(random), angle(random)};
      const Matrix4 m = RotationFromEuler(euler, static_cast<RotateOrder>(order));
      const Double3 back = EulerFromRotation(m, static_cast<RotateOrder>(order));
      EXPECT_LT(MaxDifference(m, RotationFromEuler(back, static_cast<RotateOrder>(order))), 1e-12);
    }
  }
}

// Angles that walk anywhere, far beyond a turn and through gimbal lock: what EulerFromRotation makes of them comes back
// near to where it was a step before.
TEST(Matrix, EulerAnglesFollowAMotion) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> step(-0.05, 0.05), start(-4, 4);
  double apart = 0;  // of EulerFromRotation's own angles, from one step to the next
  for (int order = 0; order < 6; ++order) {
    const auto in_order = static_cast<RotateOrder>(order);
    constexpr int kMiddle[6] = {1, 2, 0, 2, 0, 1};
    for (int walk = 0; walk < 20; ++walk) {
      Double3 angles{start(random), start(random), start(random)}, followed = angles, wrapped = angles;
      for (int i = 0; i < 400; ++i) {
        for (int axis = 0; axis < 3; ++axis) angles[axis] += step(random) + (walk % 3 == axis ? 0.03 : 0);
        if (i % 50 == 0) angles[kMiddle[order]] = kPi / 2 * (i % 100 == 0 ? 1 : -1);
        const Matrix4 m = RotationFromEuler(angles, in_order);
        const Double3 from = EulerFromRotation(m, in_order), to = EulerNear(from, in_order, angles);
        ASSERT_LT(MaxDifference(m, RotationFromEuler(to, in_order)), 2e-4);
        ASSERT_LT(Length(to - angles), 1e-3) << order << " " << walk << " " << i;
        followed = EulerNear(from, in_order, followed);
        ASSERT_LT(MaxDifference(m, RotationFromEuler(followed, in_order)), 2e-4);
        apart = std::max(apart, Length(from - wrapped));
        wrapped = from;
      }
    }
  }
  EXPECT_GT(apart, 3);
}

TEST(Matrix, XyzTurnsAboutXFirst) {
  const Matrix4 m = RotationFromEuler({kPi / 2, 0, kPi / 2}, RotateOrder::kXyz);
  const Double3 p = TransformVector(m, {0, 1, 0});  // X takes y to z; Z leaves z alone
  EXPECT_NEAR(p.z, 1, 1e-12);
}

TEST(Matrix, GimbalLockKeepsTheRotation) {
  for (int order = 0; order < 6; ++order) {
    for (double middle : {kPi / 2, -kPi / 2}) {
      Double3 euler{0.3, 0.3, 0.3};
      constexpr int kMiddle[6] = {1, 2, 0, 2, 0, 1};
      euler[kMiddle[order]] = middle;
      const Matrix4 m = RotationFromEuler(euler, static_cast<RotateOrder>(order));
      const Double3 back = EulerFromRotation(m, static_cast<RotateOrder>(order));
      EXPECT_LT(MaxDifference(m, RotationFromEuler(back, static_cast<RotateOrder>(order))), 1e-7);
    }
  }
}

TEST(Matrix, InverseAndDecomposition) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (int i = 0; i < 200; ++i) {
    const Quaternion q = Normalized({unit(random), unit(random), unit(random), unit(random)});
    const Double3 t{unit(random), unit(random), unit(random)}, s{-0.5, 1.5, 2 + unit(random)};
    const Matrix4 m = ComposeTrs(t, q, s);
    Matrix4 inverse;
    ASSERT_TRUE(Invert(m, &inverse));
    EXPECT_LT(MaxDifference(m * inverse, Matrix4()), 1e-12);
    Double3 t2, s2;
    Quaternion q2;
    DecomposeTrs(m, &t2, &q2, &s2);
    EXPECT_LT(MaxDifference(ComposeTrs(t2, q2, s2), m), 1e-12);
  }
  Matrix4 singular = Scaling({1, 0, 1}), inverse;
  EXPECT_FALSE(Invert(singular, &inverse));
}

TEST(Matrix, SlerpTakesTheShortWay) {
  const Quaternion a, b{0, 0, std::sin(0.5), std::cos(0.5)};
  const Quaternion half = Slerp(a, {-b.x, -b.y, -b.z, -b.w}, 0.5);
  EXPECT_NEAR(half.z, std::sin(0.25), 1e-14);
  EXPECT_NEAR(RotationVector(b).z, 1.0, 1e-14);
}

}  // namespace
}  // namespace kpsa::engine
