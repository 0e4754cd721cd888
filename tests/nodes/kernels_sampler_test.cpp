#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "base/scalar_math.h"
#include "nodes/kernels/sampler.h"
#include "nodes/kernels/transform_math.h"
#include "tests/nodes/kernel_support.h"

namespace kpsa::engine {
namespace {

TEST(Sampler, StepHoldsAndLinearGoesStraight) {
  const std::array<float, 3> times = {1, 2, 4};
  const std::array<float, 9> values = {0, 0, 0, 1, 2, 3, 5, 5, 5};
  SamplerKeys keys{times, values, 3, Interpolation::kLinear};
  ASSERT_TRUE(keys.Validate().ok());
  EXPECT_EQ(SampleVec3(keys, -1), (Double3{0, 0, 0}));
  EXPECT_EQ(SampleVec3(keys, 1.5), (Double3{0.5, 1, 1.5}));
  EXPECT_EQ(SampleVec3(keys, 2), (Double3{1, 2, 3}));
  EXPECT_EQ(SampleVec3(keys, 3), (Double3{3, 3.5, 4}));
  EXPECT_EQ(SampleVec3(keys, 4), (Double3{5, 5, 5}));
  EXPECT_EQ(SampleVec3(keys, 99), (Double3{5, 5, 5}));
  keys.interpolation = Interpolation::kStep;
  EXPECT_EQ(SampleVec3(keys, 1.999), (Double3{0, 0, 0}));
  EXPECT_EQ(SampleVec3(keys, 2), (Double3{1, 2, 3}));
  EXPECT_EQ(SampleVec3(keys, 3.999), (Double3{1, 2, 3}));
}

// A third of a second is 0.33333334 in single precision: frame 8 of 24 is that key, and not the one before.
TEST(Sampler, FramesMeetTheKeysThatWereExportedOfThem) {
  for (const double fps : {12.0, 23.976, 24.0, 25.0, 30.0, 60.0, 100.0}) {
    std::vector<float> rounded, multiplied, values;
    std::size_t later = 0;
    for (int frame = 0; frame < 3000; ++frame) {
      rounded.push_back(static_cast<float>(frame / fps));
      multiplied.push_back(static_cast<float>(frame) * static_cast<float>(1 / fps));
      values.push_back(static_cast<float>(frame));
      later += rounded.back() > frame / fps;
    }
    EXPECT_TRUE(later > 100 || fps == 25 || fps == 100) << "some keys are later than their frames";
    for (const std::vector<float>& times : {rounded, multiplied}) {
      const SamplerKeys keys{times, values, 1, Interpolation::kStep};
      ASSERT_TRUE(keys.Validate().ok());
      const KeyTimes shared(times);
      for (int frame = 0; frame < 3000; ++frame) {
        double value = -1;
        SampleScalars(keys, frame / fps, {&value, 1});
        ASSERT_EQ(value, frame) << fps;
        const KeySpan span = shared.Find(frame / fps);
        ASSERT_EQ(span.held, static_cast<std::size_t>(frame)) << fps;
        ASSERT_TRUE(span.key == span.held || span.key + 1 == span.held) << fps;
        SampleScalars(keys, (frame - 1e-3) / fps, {&value, 1});
        ASSERT_EQ(value, std::max(0, frame - 1)) << "and no earlier";
      }
    }
  }
}

TEST(Sampler, CubicFollowsTheHermiteFormula) {
  // A cubic polynomial with its own derivatives as tangents is reproduced between the keys
  const auto f = [](double t) { return 0.5 * t * t * t - 2 * t * t + t + 3; };
  const auto slope = [](double t) { return 1.5 * t * t - 4 * t + 1; };
  const std::array<float, 3> times = {0, 1, 3};
  std::vector<float> values;
  for (float t : times) {
    values.insert(values.end(),
                  {static_cast<float>(slope(t)), static_cast<float>(f(t)), static_cast<float>(slope(t))});
  }
  const SamplerKeys keys{times, values, 1, Interpolation::kCubicSpline};
  ASSERT_TRUE(keys.Validate().ok());
  for (double t = 0; t <= 3; t += 0.0625) {
    double value = 0;
    SampleScalars(keys, t, {&value, 1});
    EXPECT_NEAR(value, f(t), 1e-12) << t;
  }
}

TEST(Sampler, RotationsTakeTheShortWayAndStayUnit) {
  const std::array<float, 2> times = {0, 1};
  const float s = static_cast<float>(std::sin(0.5)), c = static_cast<float>(std::cos(0.5));
  const std::array<float, 8> values = {0, 0, 0, 1, 0, -s, 0, -c};  // the same turn as (0, s, 0, c)
  const SamplerKeys keys{times, values, 4, Interpolation::kLinear};
  ASSERT_TRUE(keys.Validate().ok());
  for (double t = 0; t <= 1; t += 0.125) {
    const Quaternion q = SampleRotation(keys, t);
    EXPECT_NEAR(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w, 1, 1e-14);
    EXPECT_NEAR(RotationVector(q).y, t, 1e-7);
  }
  std::vector<float> cubic;
  for (int key = 0; key < 2; ++key) {
    cubic.insert(cubic.end(), {0, 0.5f, 0, 0});
    cubic.insert(cubic.end(), values.begin() + 4 * key, values.begin() + 4 * key + 4);
    cubic.insert(cubic.end(), {0, 0.5f, 0, 0});
  }
  const SamplerKeys spline{times, cubic, 4, Interpolation::kCubicSpline};
  ASSERT_TRUE(spline.Validate().ok());
  const Quaternion q = SampleRotation(spline, 0.3);
  EXPECT_NEAR(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w, 1, 1e-14);
}

TEST(Sampler, KeysAreFoundHoweverTheyAreSpaced) {
  Random random(9);
  for (int shape = 0; shape < 4; ++shape) {
    for (int count : {1, 2, 3, 100, 1001}) {
      std::vector<float> times;
      double t = random.Signed();
      for (int i = 0; i < count; ++i) {
        times.push_back(static_cast<float>(t));
        const double gaps[4] = {1.0 / 24, 0.01 + random.Unit(), i < count / 2 ? 1e-3 : 5.0,
                                i % 50 == 49 ? 100.0 : 1e-3};
        t += gaps[shape];
      }
      const KeyTimes keys(times);
      for (int i = 0; i < 2000; ++i) {
        double at = times.front() - 1 + random.Unit() * (times.back() - times.front() + 2);
        if (i % 3 == 0) at = times[static_cast<std::size_t>(i) % times.size()];  // a key itself
        if (i % 3 == 1)
          at = std::nextafter(static_cast<double>(times[static_cast<std::size_t>(i) % times.size()]), -1e9);
        const KeySpan span = keys.Find(at);
        const auto next = std::upper_bound(times.begin(), times.end(), at,
                                           [](double a, float b) { return a < static_cast<double>(b); });
        const auto expected = static_cast<std::size_t>(std::max<std::ptrdiff_t>(0, next - times.begin() - 1));
        ASSERT_EQ(span.key, expected) << at << " in " << count << " of shape " << shape;
        const bool between =
            at > static_cast<double>(times.front()) && at < static_cast<double>(times.back());
        const double start = times[expected],
                     width = between ? static_cast<double>(times[expected + 1]) - start : 0;
        ASSERT_EQ(span.t, between ? (at - start) / width : 0);
        ASSERT_EQ(span.width, width);
      }
      EXPECT_EQ(keys.Find(std::nan("")).key, 0u);
    }
  }
}

TEST(Sampler, RotationTracksTurnAsTheSamplerDoes) {
  Random random(10);
  for (Interpolation interpolation :
       {Interpolation::kStep, Interpolation::kLinear, Interpolation::kCubicSpline}) {
    std::vector<float> times, values;
    const std::size_t rows = interpolation == Interpolation::kCubicSpline ? 3 : 1;
    for (int i = 0; i < 50; ++i) {
      times.push_back(static_cast<float>(i) / 10);
      for (std::size_t c = 0; c < 4 * rows; ++c) {
        const bool hold = i % 7 == 6 && rows == 1;  // two keys of the same rotation
        values.push_back(hold ? -2 * values[values.size() - 4] : static_cast<float>(random.Signed()));
      }
    }
    const SamplerKeys keys{times, values, 4, interpolation};
    ASSERT_TRUE(keys.Validate().ok());
    const RotationTrack track(keys);
    const KeyTimes key_times(times);
    EXPECT_FALSE(track.constant());
    for (int i = 0; i < 2000; ++i) {
      const double at = i < 50 ? times[static_cast<std::size_t>(i)] : random.Unit() * 6 - 0.5;
      const Matrix4 got = RotationFromQuaternion(track.At(key_times.Find(at))),
                    expected = RotationFromQuaternion(SampleRotation(keys, at));
      for (std::size_t e = 0; e < 16; ++e) ASSERT_NEAR(got.m[e], expected.m[e], 1e-14) << at;
    }
  }
  const std::array<float, 2> times = {0, 1};
  const std::array<float, 8> still = {0, 0.6f, 0, 0.8f, 0, -0.6f, 0, -0.8f};
  EXPECT_TRUE(RotationTrack(SamplerKeys{times, still, 4, Interpolation::kLinear}).constant());
}

TEST(Sampler, AgreesWithALinearSearch) {
  Random random(5);
  std::vector<float> times, values;
  float t = 0;
  for (int i = 0; i < 100; ++i) {
    t += static_cast<float>(0.01 + random.Unit());
    times.push_back(t);
    for (int c = 0; c < 5; ++c) values.push_back(static_cast<float>(random.Signed()));
  }
  const SamplerKeys keys{times, values, 5, Interpolation::kLinear};
  ASSERT_TRUE(keys.Validate().ok());
  for (int i = 0; i < 1000; ++i) {
    const double at = random.Unit() * (t + 1);
    std::array<double, 5> sampled;
    SampleScalars(keys, at, sampled);
    std::size_t k = 0;
    while (k < 100 && static_cast<double>(times[k]) <= at) ++k;
    for (std::size_t c = 0; c < 5; ++c) {
      double expected = k == 0 ? values[c] : values[5 * 99 + c];
      if (k > 0 && k < 100) {
        const double a = times[k - 1], b = times[k], v = values[5 * (k - 1) + c], w = values[5 * k + c];
        expected = v + (w - v) * (at - a) / (b - a);
      }
      EXPECT_NEAR(sampled[c], expected, 1e-12);
    }
  }
}

TEST(Sampler, BadKeysAreNamed) {
  const std::array<float, 2> times = {0, 1}, same = {1, 1}, nan = {0, NAN};
  const std::array<float, 6> values = {1, 2, 3, 4, 5, 6};
  const std::array<float, 6> infinite = {1, 2, 3, 4, INFINITY, 6};
  EXPECT_TRUE((SamplerKeys{times, values, 3, Interpolation::kStep}.Validate().ok()));
  EXPECT_TRUE((SamplerKeys{times, values, 1, Interpolation::kCubicSpline}.Validate().ok()));
  EXPECT_FALSE((SamplerKeys{{}, {}, 3, Interpolation::kStep}.Validate().ok()));
  EXPECT_FALSE((SamplerKeys{times, values, 0, Interpolation::kStep}.Validate().ok()));
  EXPECT_FALSE((SamplerKeys{times, values, 4, Interpolation::kStep}.Validate().ok()));
  EXPECT_FALSE((SamplerKeys{times, values, 3, Interpolation::kCubicSpline}.Validate().ok()));
  EXPECT_FALSE(
      (SamplerKeys{times, values, std::size_t{1} << 63, Interpolation::kCubicSpline}.Validate().ok()));
  EXPECT_FALSE((SamplerKeys{same, values, 3, Interpolation::kStep}.Validate().ok()));
  EXPECT_FALSE((SamplerKeys{nan, values, 3, Interpolation::kStep}.Validate().ok()));
  EXPECT_FALSE((SamplerKeys{times, infinite, 3, Interpolation::kStep}.Validate().ok()));
}

double MaxDifference(const Matrix4& a, const Matrix4& b) {
  double largest = 0;
  for (std::size_t i = 0; i < 16; ++i) largest = std::max(largest, std::fabs(a.m[i] - b.m[i]));
  return largest;
}

TEST(TransformMath, ComposesInMayasOrder) {
  TransformValues values{{1, 2, 3}, {0.1, 0.2, 0.3}, RotateOrder::kZyx, {2, 3, 4}};
  const Matrix4 parent = ComposeTrs({5, 6, 7}, Quaternion{0, std::sin(0.2), 0, std::cos(0.2)}, {1, 1, 1});
  const Matrix4 expected = parent * Translation({1, 2, 3}) *
                           RotationFromEuler({0.1, 0.2, 0.3}, RotateOrder::kZyx) * Scaling({2, 3, 4});
  EXPECT_LT(MaxDifference(ComposeLocal(parent, values), expected), 1e-14);
  EXPECT_EQ(ComposeLocal(parent, {}), parent);  // a control at rest changes no bit
}

TEST(TransformMath, SwingAndTwistMakeTheRotation) {
  Random random(6);
  for (int i = 0; i < 300; ++i) {
    const Quaternion q = random.Rotation();
    const Double3 axis = RotationVector(random.Rotation());
    const Double3 unit = axis * (1 / Length(axis));
    const SwingTwist parts = DecomposeSwingTwist(q, unit);
    const Quaternion product = parts.swing * parts.twist;
    EXPECT_LT(Length(RotationVector(Conjugate(product) * q)), 1e-12);
    EXPECT_NEAR(Dot(RotationVector(parts.swing), unit), 0, 1e-7);
    EXPECT_NEAR(Length(Cross(RotationVector(parts.twist), unit)), 0, 1e-7);
    const double angle = (random.Signed()) * 3.1;
    const Quaternion twist{unit.x * std::sin(angle / 2), unit.y * std::sin(angle / 2),
                           unit.z * std::sin(angle / 2), std::cos(angle / 2)};
    EXPECT_NEAR(TwistAngle(twist, unit), angle, 1e-12);
    EXPECT_NEAR(TwistAngle({-twist.x, -twist.y, -twist.z, -twist.w}, unit), angle, 1e-12);
  }
  // Turned around: no twist is nearer than another
  const SwingTwist around = DecomposeSwingTwist({1, 0, 0, 0}, {0, 1, 0});
  EXPECT_EQ(around.twist, Quaternion());
}

TEST(TransformMath, PoseRotationIsMeasuredAgainstTheRest) {
  Random random(7);
  const Matrix4 rest = ComposeTrs({1, 2, 3}, random.Rotation(), {2, 2, 2});
  EXPECT_LT(Length(RotationVector(PoseRotation(rest, rest))), 1e-12);
  const Matrix4 posed = rest * RotationFromEuler({0.25, 0, 0}, RotateOrder::kXyz);
  EXPECT_NEAR(RotationVector(PoseRotation(posed, rest)).x, 0.25, 1e-12);
}

}  // namespace
}  // namespace kpsa::engine
