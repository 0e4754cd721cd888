// The wire's kernel against plain loops in double, and what must hold exactly.
#include <algorithm>
#include <cmath>

#include "nodes/kernels/wire.h"
#include "tests/nodes/local_kernels.h"

namespace kpsa::engine {
namespace {

std::vector<Double3> Curve(std::size_t n) {
  std::vector<Double3> vertices;
  for (std::size_t i = 0; i < n; ++i) {
    const double x = static_cast<double>(i);
    vertices.push_back({-0.5 + x / 6, 0.15 * std::sin(2 * x), 0.2 + 0.05 * std::cos(3 * x)});
  }
  return vertices;
}

TEST(Curve, WeightsSumToOneAndCurvesAreContinuous) {
  for (CurveBasis basis : {CurveBasis::kLinear, CurveBasis::kCatmullRom, CurveBasis::kBSpline}) {
    for (bool closed : {false, true}) {
      for (std::size_t n : {2ul, 3ul, 4ul, 7ul}) {
        if (closed && n < 3) continue;
        const CurveShape shape{basis, closed, n};
        const std::vector<Double3> vertices = Curve(n);
        Double3 last = shape.Point(vertices, 0);
        for (double u = 0; u <= static_cast<double>(shape.spans()); u += 0.01) {
          Index controls[4];
          double weights[4];
          shape.Weights(u, controls, weights);
          EXPECT_NEAR(weights[0] + weights[1] + weights[2] + weights[3], 1, 1e-14);
          for (Index c : controls) EXPECT_LT(c, n);
          const Double3 p = shape.Point(vertices, u);
          EXPECT_LT(Length(p - last), 0.02);
          last = p;
        }
        EXPECT_LT(
            Length(shape.Point(vertices, closed ? static_cast<double>(n) : 0) - shape.Point(vertices, 0)),
            1e-12);
        if (basis == CurveBasis::kBSpline) continue;
        for (std::size_t i = 0; i < n; ++i)
          EXPECT_LT(Length(shape.Point(vertices, static_cast<double>(i)) - vertices[i]), 1e-12);
      }
    }
  }
  EXPECT_LT(Length(CurveShape{CurveBasis::kBSpline, false, 5}.Point(Curve(5), 4) - Curve(5)[4]), 1e-12);
}

TEST(Curve, NearestIsNearerThanEverySample) {
  Random random(7);
  for (CurveBasis basis : {CurveBasis::kLinear, CurveBasis::kCatmullRom, CurveBasis::kBSpline}) {
    for (bool closed : {false, true}) {
      const CurveShape shape{basis, closed, 6};
      const std::vector<Double3> vertices = Curve(6);
      for (int i = 0; i < 50; ++i) {
        const Double3 p = random.Vector() * 0.6;
        const double found = Length(shape.Point(vertices, shape.Nearest(vertices, p)) - p);
        for (double u = 0; u <= static_cast<double>(shape.spans()); u += 0.002) {
          ASSERT_LE(found, Length(shape.Point(vertices, u) - p) + 1e-9);
        }
      }
    }
  }
}

TEST_F(LocalKernels, WireAgreesWithItsTwin) {
  const std::vector<Double3> vertices = Curve(6);
  Random random(8);
  std::vector<Double3> offsets;
  for (std::size_t i = 0; i < 6; ++i) offsets.push_back(random.Vector() * 0.1);
  for (CurveBasis basis : {CurveBasis::kLinear, CurveBasis::kCatmullRom, CurveBasis::kBSpline}) {
    for (bool closed : {false, true}) {
      WireSettings settings{basis, closed, 0.3, {FalloffCurve::kSmooth, {}}};
      ASSERT_TRUE(WireKernel::Validate(settings, vertices).ok());
      const WireKernel kernel(settings, vertices, in(), all_, mask_);
      const PointBuffer out = Evaluate(kernel, {WireOffsets(offsets), 0.5}, in());
      const CurveShape shape{basis, closed, 6};
      std::vector<Double3> moved = vertices;
      for (std::size_t i = 0; i < 6; ++i) moved[i] = moved[i] + offsets[i];
      double largest = 0;
      std::size_t still = 0;
      for (std::size_t i = 0; i < rest_.size(); ++i) {
        // Brute force
        double best = 1e9, best_u = 0;
        for (double u = 0; u <= static_cast<double>(shape.spans()); u += 0.002) {
          const double d = Length(shape.Point(vertices, u) - rest_[i]);
          if (d < best) best = d, best_u = u;
        }
        const double w = 0.5 * mask_[i] * settings.profile.Evaluate(best / settings.dropoff);
        const Double3 expected = rest_[i] + (shape.Point(moved, best_u) - shape.Point(vertices, best_u)) * w;
        const Double3 got{out.view().x[i], out.view().y[i], out.view().z[i]};
        largest = std::max(largest, Length(got - expected));
        if (best <= 0.31) continue;
        ++still;
        EXPECT_TRUE(SameBits(out.view(), in(), i));
      }
      EXPECT_LT(largest, 4e-4) << static_cast<int>(basis) << closed;  // the twin's sampling
      EXPECT_GT(still, 10u);
      EXPECT_LT(kernel.affected_points(), rest_.size());
    }
  }
}

TEST_F(LocalKernels, AWireThatMovesAsAWholeMovesThePointsOnIt) {
  const std::vector<Double3> vertices = Curve(6), offsets(6, Double3{0.1, 0.2, 0.3});
  WireSettings settings;
  settings.profile.curve = FalloffCurve::kNone;
  settings.dropoff = 10;
  std::vector<Double3> expected;
  for (Double3 p : rest_) expected.push_back(p + offsets[0]);
  EXPECT_LT(
      MaxDistance(
          ToDouble(
              Evaluate(WireKernel(settings, vertices, in(), all_), {WireOffsets(offsets), 1}, in()).view()),
          expected),
      2e-7);
}

TEST_F(LocalKernels, OneOfSeveralCurvesIsTheWire) {
  const std::vector<Double3> vertices = Curve(6);
  Random random(8);
  std::vector<Double3> offsets;
  for (std::size_t i = 0; i < 6; ++i) offsets.push_back(random.Vector() * 0.1);
  WireSettings settings;
  settings.dropoff = 0.3;
  const WireCurve curve{settings, vertices};
  const PointBuffer one =
      Evaluate(WireKernel(settings, vertices, in(), all_, mask_), {WireOffsets(offsets), 0.5}, in());
  for (double crossing : {0.0, 1.0}) {
    const WireKernel kernel({&curve, 1}, crossing, in(), all_, mask_);
    const PointBuffer several = Evaluate(kernel, {WireOffsets(offsets), 0.5}, in());
    for (std::size_t i = 0; i < rest_.size(); ++i) ASSERT_TRUE(SameBits(one.view(), several.view(), i));
  }
}

TEST_F(LocalKernels, CurvesThatLieTogetherMovePointsOnceUnlessTheyAddUp) {
  const std::vector<Double3> vertices = Curve(6), offsets(6, Double3{0.1, 0.2, 0.3}),
                             twice(12, Double3{0.1, 0.2, 0.3});
  WireSettings settings;
  settings.dropoff = 0.3;
  const WireCurve curves[] = {{settings, vertices}, {settings, vertices}};
  const std::vector<Double3> one =
      ToDouble(Evaluate(WireKernel(settings, vertices, in(), all_), {WireOffsets(offsets), 1}, in()).view());
  EXPECT_LT(
      MaxDistance(ToDouble(Evaluate(WireKernel(curves, 0, in(), all_), {WireOffsets(twice), 1}, in()).view()),
                  one),
      1e-6);
  std::vector<Double3> expected;
  for (std::size_t i = 0; i < rest_.size(); ++i) expected.push_back(rest_[i] + (one[i] - rest_[i]) * 2.0);
  EXPECT_LT(
      MaxDistance(ToDouble(Evaluate(WireKernel(curves, 1, in(), all_), {WireOffsets(twice), 1}, in()).view()),
                  expected),
      1e-6);
}

// Two straight curves that move up and down: between them points change over from one to the other.
TEST_F(LocalKernels, NearCurvesTakeOverFromFarOnes) {
  const std::vector<Double3> left = {{-0.3, -1, 0}, {-0.3, 1, 0}}, right = {{0.3, -1, 0}, {0.3, 1, 0}};
  WireSettings settings;
  settings.basis = CurveBasis::kLinear;
  settings.profile.curve = FalloffCurve::kLinear;
  settings.dropoff = 0.8;
  WireSettings wide = settings;
  wide.dropoff = 1;
  const WireCurve curves[] = {{settings, left}, {wide, right}};
  const std::vector<Double3> offsets = {{0, 0, 1}, {0, 0, 1}, {0, 0, -2}, {0, 0, -2}};
  for (double crossing : {0.0, 0.4, 1.0}) {
    const WireKernel kernel(curves, crossing, in(), all_, mask_);
    std::vector<Double3> expected;
    for (std::size_t i = 0; i < rest_.size(); ++i) {
      const Double3 p = rest_[i];
      const double a = std::max(0.0, 1 - std::hypot(p.x + 0.3, p.z) / 0.8);
      const double b = std::max(0.0, 1 - std::hypot(p.x - 0.3, p.z));
      const double whole = a + b > 0 ? a + b : 1;
      const double move =
          a * (crossing + (1 - crossing) * a / whole) - 2 * b * (crossing + (1 - crossing) * b / whole);
      expected.push_back(p + Double3{0, 0, 0.9 * mask_[i] * move});
    }
    EXPECT_LT(MaxDistance(ToDouble(Evaluate(kernel, {WireOffsets(offsets), 0.9}, in()).view()), expected),
              1e-6);
  }
}

TEST(Wire, BadSettingsAreNamed) {
  const std::vector<Double3> vertices = Curve(3);
  EXPECT_TRUE(WireKernel::Validate({}, vertices).ok());
  EXPECT_FALSE(WireKernel::Validate({}, std::span(vertices).first(1)).ok());
  EXPECT_FALSE(WireKernel::Validate({CurveBasis::kLinear, true, 1, {}}, std::span(vertices).first(2)).ok());
  EXPECT_FALSE(WireKernel::Validate({CurveBasis::kLinear, false, 0, {}}, vertices).ok());
  EXPECT_FALSE(
      WireKernel::Validate({CurveBasis::kLinear, false, 1, {FalloffCurve::kRamp, {}}}, vertices).ok());
  std::vector<Double3> bad = vertices;
  bad[1].y = NAN;
  EXPECT_FALSE(WireKernel::Validate({}, bad).ok());
}

}  // namespace
}  // namespace kpsa::engine
