// bend, twist, squash, flare, sine, wave: what they do to single points, and the kernel around them.
#include <gtest/gtest.h>

#include <cmath>

#include "base/scalar_math.h"
#include "nodes/kernels/non_linear.h"
#include "nodes/kernels/weights.h"
#include "tests/nodes/kernel_support.h"

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
    Double3 last = ApplyNonLinear(bend, {});
    ExpectNear(last, {});
    double length = 0;
    for (int i = 1; i <= 1000; ++i) {
      const Double3 p = ApplyNonLinear(bend, {0, i / 1000.0, 0});
      EXPECT_NEAR(Length(p - center), std::fabs(1 / curvature), 1e-9);
      length += Length(p - last);
      last = p;
    }
    EXPECT_NEAR(length, 1, 1e-5);
    ExpectNear(last, {(1 - std::cos(curvature)) / curvature, std::sin(curvature) / curvature, 0}, 1e-9);
    // Straight on beyond the bounds, and nothing below
    const Double3 along{std::sin(curvature), std::cos(curvature), 0};
    ExpectNear(ApplyNonLinear(bend, {0, 3, 0.5}), last + along * 2 + Double3{0, 0, 0.5}, 1e-9);
    ExpectNear(ApplyNonLinear(bend, {0.2, -3, 0}), {0.2, -3, 0});
  }
  ExpectNear(ApplyNonLinear(Bend{kPi / 2, -1, 1}, {0.25, 1, 0}), {2 / kPi, 2 / kPi - 0.25, 0});
}

TEST(NonLinear, BendGoesOverIntoNothing) {
  for (double curvature : {1e-12, 1e-8, 9.99e-4, 1.001e-3}) {
    const Double3 q{0.3, 0.9, 0.1}, p = ApplyNonLinear(Bend{curvature, -1, 1}, q);
    const double a = 0.9 * curvature;
    ExpectNear(p,
               {0.3 * std::cos(a) + 0.9 * (a / 2 - a * a * a / 24),
                0.9 * (1 - a * a / 6 + a * a * a * a / 120) - 0.3 * std::sin(a), 0.1},
               1e-12);
  }
}

TEST(NonLinear, TwistTurnsFromBoundToBound) {
  const Twist twist{kPi / 2, kPi, -1, 3};
  ExpectNear(ApplyNonLinear(twist, {1, -1, 0.5}), {0.5, -1, -1});
  ExpectNear(ApplyNonLinear(twist, {1, -9, 0.5}), {0.5, -9, -1});
  ExpectNear(ApplyNonLinear(twist, {1, 3, 0.5}), {-1, 3, -0.5});
  const double h = std::sqrt(0.5);
  ExpectNear(ApplyNonLinear(twist, {1, 1, 0}), {-h, 1, -h});
  EXPECT_NEAR(ApplyNonLinear(twist, {0.6, 0.1, 0.8}).y, 0.1, 1e-15);
}

TEST(NonLinear, SquashKeepsTheVolumeInTheMiddle) {
  for (double factor : {1.0, -1.0, 0.3}) {
    const double along = factor >= 0 ? 1 + factor : 1 / (1 - factor);
    Squash squash;
    squash.factor = factor;
    const Double3 middle = ApplyNonLinear(squash, {0.5, 0, 0.25});
    EXPECT_NEAR(middle.x, 0.5 / std::sqrt(along), 1e-12);
    EXPECT_NEAR(middle.z, 0.25 / std::sqrt(along), 1e-12);
    ExpectNear(ApplyNonLinear(squash, {0.5, 1, 0.25}), {0.5, along, 0.25});
    ExpectNear(ApplyNonLinear(squash, {0.5, -3, 0.25}), {0.5, -along - 2, 0.25});
    squash.expand = 0;
    ExpectNear(ApplyNonLinear(squash, {0.5, 0.5, 0.25}), {0.5, 0.5 * along, 0.25});
    squash.expand = 2;  // wide at a quarter of the way up
    squash.max_expand_pos = 0.25;
    EXPECT_NEAR(ApplyNonLinear(squash, {1, -0.5, 0}).x, 1 / along, 1e-12);
  }
}

TEST(NonLinear, SmoothnessTakesTheCornersOfSquashAway) {
  Squash squash;
  squash.factor = -0.5;
  const auto slope = [&](double y, double step) {
    return (ApplyNonLinear(squash, {1, y + step, 0}).x - ApplyNonLinear(squash, {1, y, 0}).x) / step;
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
  ExpectNear(ApplyNonLinear(flare, {1, 0, 1}), {2, 0, 0.5});
  ExpectNear(ApplyNonLinear(flare, {1, -5, 1}), {2, -5, 0.5});
  ExpectNear(ApplyNonLinear(flare, {1, 2, 1}), {3, 2, 1});
  ExpectNear(ApplyNonLinear(flare, {1, 1, 1}), {2.5 + 0.25, 1, 0.75 + 0.25});
  ExpectNear(ApplyNonLinear(flare, {1, 9, 1}), {3, 9, 1});
}

TEST(NonLinear, SineWavesAndFades) {
  Sine sine{0.25, 2, 0, 0, -1, 1};
  ExpectNear(ApplyNonLinear(sine, {1, 0.5, 1}), {1.25, 0.5, 1});
  ExpectNear(ApplyNonLinear(sine, {1, -0.5, 1}), {0.75, -0.5, 1});
  sine.offset = 0.5;
  ExpectNear(ApplyNonLinear(sine, {0, 1, 0}), {0.25, 1, 0});
  ExpectNear(ApplyNonLinear(sine, {0, 7, 0}), {0.25, 7, 0});
  sine.dropoff = 1;
  ExpectNear(ApplyNonLinear(sine, {0, 1, 0}), {0, 1, 0});
  ExpectNear(ApplyNonLinear(sine, {0, -1, 0}), {0, -1, 0});
  ExpectNear(ApplyNonLinear(sine, {0, 0, 0}), {-0.25, 0, 0});
  sine.dropoff = -1;
  ExpectNear(ApplyNonLinear(sine, {0, 0, 0}), {0, 0, 0});
  ExpectNear(ApplyNonLinear(sine, {0, 1, 0}), {0.25, 1, 0});
}

TEST(NonLinear, WaveMakesRings) {
  Wave wave{0.1, 1, 0, 0, 0.5, 1.25};
  for (double angle : {0.0, 1.0, 2.5}) {
    const double c = std::cos(angle), s = std::sin(angle);
    ExpectNear(ApplyNonLinear(wave, {0.75 * c, 2, 0.75 * s}), {0.75 * c, 1.9, 0.75 * s});
    ExpectNear(ApplyNonLinear(wave, {5 * c, 2, 5 * s}), {5 * c, 2.1, 5 * s});  // as at 1.25
    ExpectNear(ApplyNonLinear(wave, {0.1 * c, 2, 0.1 * s}), {0.1 * c, 2, 0.1 * s});
  }
  wave.dropoff = 1;
  ExpectNear(ApplyNonLinear(wave, {2, 0, 0}), {2, 0, 0});
  EXPECT_NEAR(ApplyNonLinear(wave, {0.75, 0, 0}).y, -0.1 * (1 - 1 / 3.0), 1e-12);
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
      Double3 last = ApplyNonLinear(map, a);
      for (int k = 1; k <= 2000; ++k) {
        const Double3 p = ApplyNonLinear(map, a + (b - a) * (k / 2000.0));
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
    (void)ApplyNonLinear(map, q);
    (void)ApplyNonLinear(map, {nan, nan, nan});
  }
  ExpectNear(ApplyNonLinear(Sine{1, 0, 0, 0, -1, 1}, q), q);
  ExpectNear(ApplyNonLinear(Twist{1, 1, 0, 0}, {0, 1, 0}), {0, 1, 0});
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
      const Double3 moved = TransformPoint(frame, ApplyNonLinear(map, TransformPoint(inverse, rest_[i])));
      expected.push_back(rest_[i] + (moved - rest_[i]) * (0.75 * mask_[i]));
    }
    const std::vector<float> result = Run(kernel, {map, frame, 0.75}, mesh_.rest.view());
    EXPECT_LT(MaxDistance(Triples(result), expected), 2e-7) << map.index();
    EXPECT_GT(MaxDistance(Triples(result), rest_), 0.01) << map.index();
    const std::vector<float> rest = mesh_.rest.Interleaved();
    for (std::size_t i = 0; i < rest_.size(); i += 4)
      ASSERT_EQ(std::memcmp(&result[3 * i], &rest[3 * i], 12), 0) << map.index();
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
