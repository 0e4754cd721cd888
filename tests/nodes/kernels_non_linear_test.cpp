// bend, twist, squash, flare, sine, wave: what their twin in double does to single points, and that the kernel
// does the same.
#include <gtest/gtest.h>

#include <cmath>

#include "base/scalar_math.h"
#include "nodes/kernels/non_linear.h"
#include "nodes/kernels/weights.h"
#include "tests/nodes/kernel_support.h"
#include "tests/nodes/non_linear_twin.h"

namespace kpsa::engine {
namespace {

void ExpectNear(Double3 a, Double3 b, double tolerance = 1e-12) {
  EXPECT_LT(Length(a - b), tolerance)
      << a.x << " " << a.y << " " << a.z << " instead of " << b.x << " " << b.y << " " << b.z;
}

TEST(NonLinear, BendPutsTheAxisOnACircle) {
  for (double curvature : {0.5, -2.0, 1e-3, 3.0}) {
    const Bend bend{curvature, 0, 1};
    const Double3 center{1 / curvature, 0, 0};
    Double3 last = non_linear_twin::Apply(bend, {});
    ExpectNear(last, {});
    double length = 0;
    for (int i = 1; i <= 1000; ++i) {
      const Double3 p = non_linear_twin::Apply(bend, {0, i / 1000.0, 0});
      EXPECT_NEAR(Length(p - center), std::fabs(1 / curvature), 1e-9);
      length += Length(p - last);
      last = p;
    }
    EXPECT_NEAR(length, 1, 1e-5);
    ExpectNear(last, {(1 - std::cos(curvature)) / curvature, std::sin(curvature) / curvature, 0}, 1e-9);
    // Straight on beyond the bounds, and nothing below
    const Double3 along{std::sin(curvature), std::cos(curvature), 0};
    ExpectNear(non_linear_twin::Apply(bend, {0, 3, 0.5}), last + along * 2 + Double3{0, 0, 0.5}, 1e-9);
    ExpectNear(non_linear_twin::Apply(bend, {0.2, -3, 0}), {0.2, -3, 0});
  }
  ExpectNear(non_linear_twin::Apply(Bend{kPi / 2, -1, 1}, {0.25, 1, 0}), {2 / kPi, 2 / kPi - 0.25, 0});
}

TEST(NonLinear, BendGoesOverIntoNothing) {
  for (double curvature : {1e-12, 1e-8, 9.99e-4, 1.001e-3}) {
    const Double3 q{0.3, 0.9, 0.1}, p = non_linear_twin::Apply(Bend{curvature, -1, 1}, q);
    const double a = 0.9 * curvature;
    ExpectNear(p,
               {0.3 * std::cos(a) + 0.9 * (a / 2 - a * a * a / 24),
                0.9 * (1 - a * a / 6 + a * a * a * a / 120) - 0.3 * std::sin(a), 0.1},
               1e-12);
  }
}

TEST(NonLinear, TwistTurnsFromBoundToBound) {
  const Twist twist{kPi / 2, kPi, -1, 3};
  ExpectNear(non_linear_twin::Apply(twist, {1, -1, 0.5}), {0.5, -1, -1});
  ExpectNear(non_linear_twin::Apply(twist, {1, -9, 0.5}), {0.5, -9, -1});
  ExpectNear(non_linear_twin::Apply(twist, {1, 3, 0.5}), {-1, 3, -0.5});
  const double h = std::sqrt(0.5);
  ExpectNear(non_linear_twin::Apply(twist, {1, 1, 0}), {-h, 1, -h});
  EXPECT_NEAR(non_linear_twin::Apply(twist, {0.6, 0.1, 0.8}).y, 0.1, 1e-15);
}

TEST(NonLinear, SquashKeepsTheVolumeInTheMiddle) {
  for (double factor : {1.0, -1.0, 0.3}) {
    const double along = factor >= 0 ? 1 + factor : 1 / (1 - factor);
    Squash squash;
    squash.factor = factor;
    const Double3 middle = non_linear_twin::Apply(squash, {0.5, 0, 0.25});
    EXPECT_NEAR(middle.x, 0.5 / std::sqrt(along), 1e-12);
    EXPECT_NEAR(middle.z, 0.25 / std::sqrt(along), 1e-12);
    ExpectNear(non_linear_twin::Apply(squash, {0.5, 1, 0.25}), {0.5, along, 0.25});
    ExpectNear(non_linear_twin::Apply(squash, {0.5, -3, 0.25}), {0.5, -along - 2, 0.25});
    squash.expand = 0;
    ExpectNear(non_linear_twin::Apply(squash, {0.5, 0.5, 0.25}), {0.5, 0.5 * along, 0.25});
    squash.expand = 2;  // wide at a quarter of the way up
    squash.max_expand_pos = 0.25;
    EXPECT_NEAR(non_linear_twin::Apply(squash, {1, -0.5, 0}).x, 1 / along, 1e-12);
  }
}

TEST(NonLinear, SmoothnessTakesTheCornersOfSquashAway) {
  Squash squash;
  squash.factor = -0.5;
  const auto slope = [&](double y, double step) {
    return (non_linear_twin::Apply(squash, {1, y + step, 0}).x -
            non_linear_twin::Apply(squash, {1, y, 0}).x) /
           step;
  };
  EXPECT_GT(slope(-1, 1e-6), 0.1);
  EXPECT_GT(slope(1, -1e-6), -100);
  squash.start_smoothness = 1;
  EXPECT_LT(std::fabs(slope(-1, 1e-6)), 1e-4);
  EXPECT_GT(std::fabs(slope(1, -1e-6)), 0.1);
  squash.end_smoothness = 1;
  EXPECT_LT(std::fabs(slope(1, -1e-6)), 1e-4);
}

TEST(NonLinear, FlareScalesAcross) {
  const Flare flare{2, 0.5, 3, 1, 0.25, 0, 2};
  ExpectNear(non_linear_twin::Apply(flare, {1, 0, 1}), {2, 0, 0.5});
  ExpectNear(non_linear_twin::Apply(flare, {1, -5, 1}), {2, -5, 0.5});
  ExpectNear(non_linear_twin::Apply(flare, {1, 2, 1}), {3, 2, 1});
  ExpectNear(non_linear_twin::Apply(flare, {1, 1, 1}), {2.5 + 0.25, 1, 0.75 + 0.25});
  ExpectNear(non_linear_twin::Apply(flare, {1, 9, 1}), {3, 9, 1});
}

TEST(NonLinear, SineWavesAndFades) {
  Sine sine{0.25, 2, 0, 0, -1, 1};
  ExpectNear(non_linear_twin::Apply(sine, {1, 0.5, 1}), {1.25, 0.5, 1});
  ExpectNear(non_linear_twin::Apply(sine, {1, -0.5, 1}), {0.75, -0.5, 1});
  sine.offset = 0.5;
  ExpectNear(non_linear_twin::Apply(sine, {0, 1, 0}), {0.25, 1, 0});
  ExpectNear(non_linear_twin::Apply(sine, {0, 7, 0}), {0.25, 7, 0});
  sine.dropoff = 1;
  ExpectNear(non_linear_twin::Apply(sine, {0, 1, 0}), {0, 1, 0});
  ExpectNear(non_linear_twin::Apply(sine, {0, -1, 0}), {0, -1, 0});
  ExpectNear(non_linear_twin::Apply(sine, {0, 0, 0}), {-0.25, 0, 0});
  sine.dropoff = -1;
  ExpectNear(non_linear_twin::Apply(sine, {0, 0, 0}), {0, 0, 0});
  ExpectNear(non_linear_twin::Apply(sine, {0, 1, 0}), {0.25, 1, 0});
}

TEST(NonLinear, WaveMakesRings) {
  Wave wave{0.1, 1, 0, 0, 0.5, 1.25};
  for (double angle : {0.0, 1.0, 2.5}) {
    const double c = std::cos(angle), s = std::sin(angle);
    ExpectNear(non_linear_twin::Apply(wave, {0.75 * c, 2, 0.75 * s}), {0.75 * c, 1.9, 0.75 * s});
    ExpectNear(non_linear_twin::Apply(wave, {5 * c, 2, 5 * s}), {5 * c, 2.1, 5 * s});  // as at 1.25
    ExpectNear(non_linear_twin::Apply(wave, {0.1 * c, 2, 0.1 * s}), {0.1 * c, 2, 0.1 * s});
  }
  wave.dropoff = 1;
  ExpectNear(non_linear_twin::Apply(wave, {2, 0, 0}), {2, 0, 0});
  EXPECT_NEAR(non_linear_twin::Apply(wave, {0.75, 0, 0}).y, -0.1 * (1 - 1 / 3.0), 1e-12);
}

const std::vector<NonLinearMap>& Maps() {
  static const std::vector<NonLinearMap> maps = {Bend{1.2, -0.4, 0.5},
                                                 Twist{0.3, -2, -0.3, 0.4},
                                                 Squash{-0.7, 1.2, 0.3, 0.4, 0.6, -0.3, 0.5},
                                                 Flare{1.5, 0.5, 0.7, 1.2, 0.3, -0.4, 0.3},
                                                 Sine{0.1, 0.4, 0.05, 0.5, -0.4, 0.5},
                                                 Wave{0.1, 0.3, 0.05, -0.5, 0.1, 0.5}};
  return maps;
}

TEST(NonLinear, EveryMapIsContinuous) {
  Random random(4);
  for (const NonLinearMap& map : Maps()) {
    for (int i = 0; i < 20; ++i) {
      const Double3 a = random.Vector(), b = random.Vector();
      Double3 last = non_linear_twin::Apply(map, a);
      for (int k = 1; k <= 2000; ++k) {
        const Double3 p = non_linear_twin::Apply(map, a + (b - a) * (k / 2000.0));
        ASSERT_LT(Length(p - last), 0.03) << map.index();
        last = p;
      }
    }
  }
}

TEST(NonLinear, SettingsThatMakeNoSenseDoNoHarm) {
  const Double3 q{0.1, 0.2, 0.3};
  const double infinite = INFINITY, nan = NAN;
  for (const NonLinearMap& map : std::vector<NonLinearMap>{
           Bend{1, 1, -1}, Bend{infinite, -1, 1}, Twist{0, nan, 1, 1}, Twist{0, 1, 0, 0},
           Squash{1, infinite, 0, 0, 0, 0, 0}, Squash{infinite, 1, 1, 0, 0, -1, 1},
           Flare{1, 1, 1, 1, nan, 0, 0}, Sine{1, 0, 0, 0, 0, 0}, Sine{1, 1e-300, 0, 0, 0, 0},
           Wave{1, nan, 0, 0, 1, 0}}) {
    (void)non_linear_twin::Apply(map, q);
    (void)non_linear_twin::Apply(map, {nan, nan, nan});
  }
  ExpectNear(non_linear_twin::Apply(Sine{1, 0, 0, 0, -1, 1}, q), q);
  ExpectNear(non_linear_twin::Apply(Twist{1, 1, 0, 0}, {0, 1, 0}), {0, 1, 0});
}

class NonLinearKernels : public testing::Test {
 protected:
  NonLinearKernels()
      : mesh_(MakeSheet(37, 31)), all_(AllPoints(mesh_.count())), rest_(ToDouble(mesh_.rest.view())) {
    Random random(31);
    for (std::size_t i = 0; i < mesh_.count(); ++i)
      mask_.push_back(i % 4 == 0 ? 0.0f : static_cast<float>(random.Unit()));
  }
  std::vector<float> Run(const NonLinearKernel& kernel, const NonLinearKernel::Inputs& inputs,
                         ConstPointsView in) const {
    PointBuffer out(mesh_.count());
    kernel.Run(inputs, in, out.view(), {});
    return out.Interleaved();
  }
  TestMesh mesh_;
  std::vector<Index> all_;
  std::vector<Double3> rest_;
  std::vector<float> mask_;
};

std::vector<Double3> Triples(const std::vector<float>& xyz) {
  std::vector<Double3> points;
  for (std::size_t i = 0; i < xyz.size(); i += 3) points.push_back({xyz[i], xyz[i + 1], xyz[i + 2]});
  return points;
}

TEST_F(NonLinearKernels, ActInTheHandlesFrame) {
  const Matrix4 frame = ComposeTrs({0.1, 0.05, 0.2}, Random(2).Rotation(), {0.8, 1.5, 0.5});
  const Matrix4 inverse = InverseOrIdentity(frame);
  const NonLinearKernel kernel(all_, mask_);
  for (const NonLinearMap& map : Maps()) {
    std::vector<Double3> expected;
    for (std::size_t i = 0; i < rest_.size(); ++i) {
      const Double3 moved =
          TransformPoint(frame, non_linear_twin::Apply(map, TransformPoint(inverse, rest_[i])));
      expected.push_back(rest_[i] + (moved - rest_[i]) * (0.75 * mask_[i]));
    }
    const std::vector<float> result = Run(kernel, {map, frame, 0.75}, mesh_.rest.view());
    EXPECT_LT(MaxDistance(Triples(result), expected), 2.5e-7) << map.index();
    EXPECT_GT(MaxDistance(Triples(result), rest_), 0.01) << map.index();
    const std::vector<float> rest = mesh_.rest.Interleaved();
    for (std::size_t i = 0; i < rest_.size(); i += 4)
      ASSERT_EQ(std::memcmp(&result[3 * i], &rest[3 * i], 12), 0) << map.index();
  }
}

// Any settings, handles and places, against the bound that the header states.
TEST_F(NonLinearKernels, AreAsNearTheirTwinAsTheySay) {
  Random random(41);
  const auto between = [&](double low, double high) { return low + (high - low) * random.Unit(); };
  const auto settings = [&](int kind) -> NonLinearMap {
    const double low = -between(0, 1), high = between(0, 1), small = between(0, 1) < 0.3 ? 1e-3 : 1;
    switch (kind) {
      case 0:
        return Bend{small * between(-4, 4), low, high};
      case 1:
        return Twist{small * between(-9, 9), small * between(-9, 9), low, high};
      case 2:
        return Squash{small * between(-2, 2),
                      between(-1, 2),
                      between(0.01, 0.99),
                      random.Unit(),
                      random.Unit(),
                      low,
                      high};
      case 3:
        return Flare{between(0, 2),          between(0, 2), between(0, 2), between(0, 2),
                     small * between(-1, 1), low,           high};
      case 4:
        return Sine{
            small * between(-0.5, 0.5), between(0.05, 3), between(-100, 100), between(-1, 1), low, high};
      default:
        return Wave{small * between(-0.5, 0.5),
                    between(0.05, 3),
                    between(-100, 100),
                    between(-1, 1),
                    between(0, 0.5),
                    between(0.5, 2)};
    }
  };
  double nearest_to_bound = 0;
  for (int trial = 0; trial < 600; ++trial) {
    const NonLinearMap map = settings(trial % 6);
    const double far = trial % 5 == 0 ? 1000 : 1, size = std::pow(10, between(-1.5, 1.5));
    const Matrix4 frame = ComposeTrs(random.Vector() * far, random.Rotation(), Double3{1, 1, 1} * size);
    const Matrix4 inverse = InverseOrIdentity(frame);
    std::vector<float> xyz;
    for (int i = 0; i < 33; ++i) {
      const Double3 p = TransformPoint(frame, random.Vector() * 1.5);
      for (int a = 0; a < 3; ++a) xyz.push_back(static_cast<float>(p[a]));
    }
    const PointBuffer in = PointBuffer::FromInterleaved(xyz);
    PointBuffer out(in.count());
    NonLinearKernel(AllPoints(in.count())).Run({map, frame, 1}, std::as_const(in).view(), out.view(), {});
    const std::vector<Double3> points = Triples(xyz), results = Triples(out.Interleaved());
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Double3 q = TransformPoint(inverse, points[i]), f = non_linear_twin::Apply(map, q);
      const Double3 expected = TransformPoint(frame, f);
      double steepness = 1;
      for (int side = 0; side < 6; ++side) {
        Double3 step;
        step[side / 2] = side % 2 == 0 ? 1e-6 : -1e-6;
        steepness = std::max(steepness, Length(non_linear_twin::Apply(map, q + step) - f) / 1e-6);
      }
      const Double3 origin{frame(0, 3), frame(1, 3), frame(2, 3)};
      const double scale = Length(points[i] - origin) + Length(points[i]) + Length(expected - points[i]);
      const double share = Length(results[i] - expected) / (std::ldexp(8.0, -24) * steepness * scale);
      ASSERT_LT(share, 1) << "map " << map.index() << ", trial " << trial;
      nearest_to_bound = std::max(nearest_to_bound, share);
    }
  }
  EXPECT_GT(nearest_to_bound, 0.1);  // a bound that says something
}

TEST_F(NonLinearKernels, StayWhereTheFrameHasNoInverse) {
  const NonLinearKernel kernel(all_);
  for (const Matrix4& frame : {Scaling({1, 0, 1}), Scaling({1e-45, 1e-45, 1e-45}),
                               Scaling({1e60, 1e60, 1e60}), Scaling({NAN, 1, 1})}) {
    for (const NonLinearMap& map : Maps())
      EXPECT_EQ(Run(kernel, {map, frame, 1}, mesh_.rest.view()), mesh_.rest.Interleaved()) << map.index();
  }
}

// Settings that a rig may hold, though they say nothing: points stay points, or become not-a-number.
TEST_F(NonLinearKernels, KernelsTakeSettingsThatMakeNoSense) {
  const NonLinearKernel kernel(all_);
  const double infinite = INFINITY;
  for (const NonLinearMap& map : std::vector<NonLinearMap>{
           Bend{1, 1, -1}, Twist{0, 1, 0, 0}, Twist{0, 1, 0, 1e-42}, Squash{1, 0.5, 0, 0, 0, 0, 0},
           Flare{1, 1, 2, 2, 0, 0, 0}, Sine{0.1, 0.5, 0, 1, 0, 0}, Sine{0.1, 2e-9, 0, 0, -1, 1},
           Sine{0.1, 1, 1e12, 0, 1, -1}, Wave{0.1, 0.2, 0, 1, 1, 0}, Wave{0.1, 0.2, 0, 1, 0.2, 0.2}}) {
    const std::vector<Double3> results = Triples(Run(kernel, {map, Matrix4(), 1}, mesh_.rest.view()));
    for (std::size_t i = 0; i < results.size(); ++i) {
      ASSERT_LT(Length(results[i]), 4) << map.index();  // false of what is not a number
    }
  }
  (void)Run(kernel, {Bend{infinite, -1, 1}, Matrix4(), 1}, mesh_.rest.view());
}

TEST_F(NonLinearKernels, WhatIsNotANumberStaysThat) {
  PointBuffer points(mesh_.count());
  CopyPoints(mesh_.rest.view(), points.view());
  points.view().y[5] = NAN;
  const NonLinearKernel kernel(all_);
  for (const NonLinearMap& map : Maps()) {
    const std::vector<float> result = Run(kernel, {map, Matrix4(), 1}, points.view());
    EXPECT_TRUE(std::isnan(result[16])) << map.index();
    EXPECT_EQ(std::count_if(result.begin(), result.end(), [](float f) { return std::isnan(f); }), 3)
        << map.index();
  }
}

TEST_F(NonLinearKernels, CommuteWithRigidMotion) {
  const Matrix4 frame = ComposeTrs({0.1, 0.05, 0.2}, Random(2).Rotation(), {1, 1, 1});
  const Matrix4 motion = ComposeTrs({1, -2, 0.5}, Random(1).Rotation(), {1, 1, 1});
  std::vector<float> xyz;
  for (Double3 p : rest_) {
    const Double3 q = TransformPoint(motion, p);
    for (int a = 0; a < 3; ++a) xyz.push_back(static_cast<float>(q[a]));
  }
  const PointBuffer moved = PointBuffer::FromInterleaved(xyz);
  const NonLinearKernel kernel(all_);
  for (const NonLinearMap& map : Maps()) {
    std::vector<Double3> expected = Triples(Run(kernel, {map, frame, 1}, mesh_.rest.view()));
    for (Double3& p : expected) p = TransformPoint(motion, p);
    EXPECT_LT(MaxDistance(Triples(Run(kernel, {map, motion * frame, 1}, moved.view())), expected), 4e-6)
        << map.index();
  }
}

TEST_F(NonLinearKernels, NothingToDoIsBitForBit) {
  PointBuffer points(mesh_.count());
  CopyPoints(mesh_.rest.view(), points.view());
  for (std::size_t i = 0; i < points.count(); i += 3) points.view().x[i] = -0.0f;
  const std::vector<float> rest = points.Interleaved();
  const auto same = [&](const std::vector<float>& other) {
    return std::memcmp(other.data(), rest.data(), rest.size() * sizeof(float)) == 0;
  };
  const Matrix4 frame = ComposeTrs({0.1, 0.05, 0.2}, Random(2).Rotation(), {0.8, 1.5, 0.5});
  const NonLinearKernel kernel(all_);
  for (const NonLinearMap& map :
       std::vector<NonLinearMap>{Bend(), Twist(), Squash(), Flare(), Sine(), Wave()})
    EXPECT_TRUE(same(Run(kernel, {map, frame, 1}, points.view()))) << map.index();
  for (const NonLinearMap& map : Maps()) {
    EXPECT_TRUE(same(Run(kernel, {map, frame, 0}, points.view()))) << map.index();
    EXPECT_TRUE(same(Run(kernel, {map, Scaling({1, 0, 1}), 1}, points.view()))) << map.index();
  }
}

}  // namespace
}  // namespace kpsa::engine
