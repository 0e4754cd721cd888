// Dual quaternion skinning against plain loops in double, and what defines it: rigid motions stay rigid.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "base/scalar_math.h"
#include "nodes/kernels/dual_quaternion.h"
#include "nodes/kernels/transform_math.h"
#include "nodes/kernels/weights.h"
#include "tests/nodes/kernel_support.h"

namespace kpsa::engine {
namespace {

Quaternion Plus(Quaternion a, Quaternion b, double w) {
  return {a.x + w * b.x, a.y + w * b.y, a.z + w * b.z, a.w + w * b.w};
}

// The rotation of a matrix by plain Newton steps, and what is left of it.
void PolarTwin(const Matrix4& m, Matrix4* rotation, Matrix4* stretch) {
  *rotation = m;
  rotation->m[12] = rotation->m[13] = rotation->m[14] = 0;
  for (int step = 0; step < 80; ++step) {
    const Matrix4 inverse = InverseOrIdentity(*rotation);
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) (*rotation)(r, c) = 0.5 * ((*rotation)(r, c) + inverse(c, r));
    }
  }
  *stretch = InverseOrIdentity(*rotation) * m;
  stretch->m[12] = stretch->m[13] = stretch->m[14] = 0;
}

std::vector<Double3> DualTwin(const TestSkin& skin, const std::vector<Matrix4>& palette,
                              const std::vector<Double3>& centers, const std::vector<Double3>& points) {
  std::vector<Matrix4> rotations(palette.size()), stretches(palette.size());
  for (std::size_t j = 0; j < palette.size(); ++j) PolarTwin(palette[j], &rotations[j], &stretches[j]);
  std::vector<Double3> result;
  for (std::size_t p = 0; p < points.size(); ++p) {
    Index pivot = skin.offsets[p];
    double sum = 0;
    for (Index e = skin.offsets[p]; e < skin.offsets[p + 1]; ++e) {
      if (skin.weights[e] > skin.weights[pivot]) pivot = e;
      sum += skin.weights[e];
    }
    Quaternion real{0, 0, 0, 0}, dual{0, 0, 0, 0}, first;
    Double3 stretched;
    for (int pass = 0; pass < 2; ++pass) {
      for (Index e = skin.offsets[p]; e < skin.offsets[p + 1]; ++e) {
        const Matrix4& m = palette[skin.joints[e]];
        const Double3 c = centers[skin.joints[e]];
        const Matrix4 &rotation = rotations[skin.joints[e]], &stretch = stretches[skin.joints[e]];
        const Quaternion q = QuaternionFromRotation(rotation);
        if (pass == 0) {
          if (e == pivot) first = q;
          continue;
        }
        const double w = skin.weights[e] / sum;
        stretched = stretched + (c + TransformVector(stretch, points[p] - c)) * w;
        const Double3 t = TransformPoint(m, c) - TransformVector(rotation, c);
        const double sign = q.x * first.x + q.y * first.y + q.z * first.z + q.w * first.w < 0 ? -1 : 1;
        real = Plus(real, q, sign * w);
        dual = Plus(dual, Quaternion{0.5 * t.x, 0.5 * t.y, 0.5 * t.z, 0} * q, sign * w);
      }
    }
    const double length = std::sqrt(real.x * real.x + real.y * real.y + real.z * real.z + real.w * real.w);
    const Quaternion t = dual * Conjugate(real);
    result.push_back(TransformVector(RotationFromQuaternion(real), stretched) +
                     Double3{t.x, t.y, t.z} * (2 / (length * length)));
  }
  return result;
}

class DualQuaternion : public testing::Test {
 protected:
  DualQuaternion()
      : mesh_(MakeSheet(33, 29)), all_(AllPoints(mesh_.count())), rest_(ToDouble(mesh_.rest.view())) {
    Random random(5);
    for (Index j = 0; j < 25; ++j) centers_.push_back(random.Vector() * 0.5);
    for (std::size_t i = 0; i < mesh_.count(); ++i)
      mask_.push_back(i % 4 == 0 ? 0.0f : i % 4 == 1 ? 1.0f : static_cast<float>(random.Unit()));
  }
  PointBuffer Run(const DualQuaternionKernel& kernel, const DualQuaternionKernel::Inputs& inputs,
                  ConstPointsView in) const {
    PointBuffer out(kernel.point_count());
    AlignedFloats scratch(kernel.ScratchFloats());
    kernel.Run(inputs, in, out.view(), scratch.span());
    return out;
  }
  static SkinWeights Weights(const TestSkin& skin) { return {skin.offsets, skin.joints, skin.weights, 25}; }
  ConstPointsView in() const { return mesh_.rest.view(); }

  TestMesh mesh_;
  std::vector<Index> all_;
  std::vector<Double3> rest_, centers_;
  std::vector<float> mask_;
};

bool SamePoint(ConstPointsView a, ConstPointsView b, std::size_t i) {
  return std::memcmp(a.x + i, b.x + i, 4) == 0 && std::memcmp(a.y + i, b.y + i, 4) == 0 &&
         std::memcmp(a.z + i, b.z + i, 4) == 0;
}

std::vector<Matrix4> RigidPalette(Double3 place) {
  Random random(6);
  std::vector<Matrix4> palette;
  for (int j = 0; j < 25; ++j)
    palette.push_back(ComposeTrs(place + random.Vector() * 0.2, random.Rotation(), {1, 1, 1}));
  return palette;
}

TEST_F(DualQuaternion, AgreesWithItsTwin) {
  for (int influences : {1, 2, 4, 7}) {
    const TestSkin skin = MakeSkin(mesh_.count(), 25, influences, influences == 7);
    const DualQuaternionKernel kernel(Weights(skin), centers_, all_);
    for (const std::vector<Matrix4>& palette : {RigidPalette({0, 1, 0}), MakePalette(25, {0, 1, 0})}) {
      EXPECT_LT(MaxDistance(ToDouble(Run(kernel, {{Pointers(palette)}, 1}, in()).view()),
                            DualTwin(skin, palette, centers_, rest_)),
                5e-6)
          << influences;
    }
  }
}

TEST_F(DualQuaternion, OneInfluenceIsTheJointsTransform) {
  const TestSkin skin = MakeSkin(mesh_.count(), 25, 1, false);
  for (std::vector<Matrix4> palette : {RigidPalette({0, 1, 0}), MakePalette(25, {0, 1, 0})}) {
    palette[3] = Scaling({-1, 2, 1});  // a reflection
    palette[4] = Scaling({0, 1, 1});   // pressed flat
    palette[5](0, 1) = 0.5;            // a shear
    std::vector<Double3> expected;
    for (std::size_t p = 0; p < rest_.size(); ++p)
      expected.push_back(TransformPoint(palette[skin.joints[p]], rest_[p]));
    EXPECT_LT(MaxDistance(ToDouble(Run(DualQuaternionKernel(Weights(skin), centers_, all_),
                                       {{Pointers(palette)}, 1}, in())
                                       .view()),
                          expected),
              3e-6);
  }
}

// Half way between two joints that are turned against each other by `apart` about x.
Double3 HalfWay(double from, double apart, Double3 p) {
  const std::vector<Index> offsets = {0, 2}, joints = {0, 1}, one = {0};
  const std::vector<float> weights = {0.5f, 0.5f};
  const std::vector<Matrix4> palette = {RotationFromEuler({from, 0, 0}, RotateOrder::kXyz),
                                        RotationFromEuler({from + apart, 0, 0}, RotateOrder::kXyz)};
  const std::vector<Double3> centers(2);
  const DualQuaternionKernel kernel({offsets, joints, weights, 2}, centers, one);
  PointBuffer points(1);
  points.view().x[0] = static_cast<float>(p.x), points.view().y[0] = static_cast<float>(p.y);
  points.view().z[0] = static_cast<float>(p.z);
  AlignedFloats scratch(kernel.ScratchFloats());
  kernel.Run({{Pointers(palette)}, 1}, points.view(), points.view(), scratch.span());
  return {points.view().x[0], points.view().y[0], points.view().z[0]};
}

TEST_F(DualQuaternion, ATwistKeepsItsThicknessWhateverTheSignsOfTheQuaternions) {
  for (double from = -7; from < 7; from += 0.37) {
    for (double apart : {0.5, -1.5, 3.0, -3.0}) {
      const Double3 p = HalfWay(from, apart, {0.3, 1, 0});
      const double angle = from + apart / 2;
      EXPECT_LT(Length(p - Double3{0.3, std::cos(angle), std::sin(angle)}), 1e-6) << from << " " << apart;
    }
  }
}

TEST_F(DualQuaternion, CommutesWithRigidMotion) {
  const TestSkin skin = MakeSkin(mesh_.count(), 25, 4, true);
  const DualQuaternionKernel kernel(Weights(skin), centers_, all_);
  const std::vector<Matrix4> palette = MakePalette(25, {0, 1, 0});
  const Matrix4 motion = ComposeTrs({1, -2, 0.5}, Random(1).Rotation(), {1, 1, 1});
  std::vector<Matrix4> moved = palette;
  for (Matrix4& m : moved) m = motion * m;
  std::vector<Double3> expected = ToDouble(Run(kernel, {{Pointers(palette)}, 1}, in()).view());
  for (Double3& p : expected) p = TransformPoint(motion, p);
  EXPECT_LT(MaxDistance(ToDouble(Run(kernel, {{Pointers(moved)}, 1}, in()).view()), expected), 4e-6);
}

// Where mesh space has its origin says nothing: joints stretch about their own places.
TEST_F(DualQuaternion, DoesNotDependOnTheOriginOfMeshSpace) {
  const TestSkin skin = MakeSkin(mesh_.count(), 25, 4, true);
  const DualQuaternionKernel kernel(Weights(skin), centers_, all_);
  const std::vector<Matrix4> palette = MakePalette(25, {0, 1, 0});
  const Double3 shift{0.5, -1, 0.25};
  std::vector<Matrix4> shifted = palette;
  std::vector<Double3> centers = centers_;
  for (Matrix4& m : shifted) m = m * Translation(shift * -1.0);
  for (Double3& c : centers) c = c + shift;
  PointBuffer points(mesh_.count());
  for (std::size_t i = 0; i < rest_.size(); ++i) {
    points.view().x[i] = static_cast<float>(rest_[i].x + shift.x);
    points.view().y[i] = static_cast<float>(rest_[i].y + shift.y);
    points.view().z[i] = static_cast<float>(rest_[i].z + shift.z);
  }
  const DualQuaternionKernel shifted_kernel(Weights(skin), centers, all_);
  EXPECT_LT(MaxDistance(ToDouble(Run(shifted_kernel, {{Pointers(shifted)}, 1}, points.view()).view()),
                        ToDouble(Run(kernel, {{Pointers(palette)}, 1}, in()).view())),
            1e-5);
}

TEST_F(DualQuaternion, ScaleAloneIsBlendedLinearly) {
  const TestSkin skin = MakeSkin(mesh_.count(), 25, 3, false);
  std::vector<Matrix4> palette;
  for (Index j = 0; j < 25; ++j) {
    palette.push_back(Translation(centers_[j]) * Scaling({1 + 0.1 * j, 1, 2 - 0.05 * j}) *
                      Translation(centers_[j] * -1.0));
  }
  const SkinKernel linear(Weights(skin), all_);
  PointBuffer expected(mesh_.count());
  AlignedFloats scratch(linear.ScratchFloats());
  linear.Run({{Pointers(palette)}, 1}, in(), expected.view(), scratch.span());
  EXPECT_LT(MaxDistance(ToDouble(Run(DualQuaternionKernel(Weights(skin), centers_, all_),
                                     {{Pointers(palette)}, 1}, in())
                                     .view()),
                        ToDouble(expected.view())),
            1e-6);
}

TEST_F(DualQuaternion, KeepsTheShapeAThousandMetresAway) {
  const TestSkin skin = MakeSkin(mesh_.count(), 25, 4, false);
  const DualQuaternionKernel kernel(Weights(skin), centers_, all_);
  const std::vector<Matrix4> palette = RigidPalette({1000, -900, 800});
  const std::vector<Double3> moved = ToDouble(Run(kernel, {{Pointers(palette)}, 1}, in()).view());
  const std::vector<Double3> twin = DualTwin(skin, palette, centers_, rest_);
  for (std::size_t i = 0; i < moved.size(); ++i) {
    for (int a = 0; a < 3; ++a) ASSERT_NEAR(moved[i][a], twin[i][a], 3.3e-5);
  }
}

TEST_F(DualQuaternion, LeavesWhatTheEnvelopeLeaves) {
  TestSkin skin = MakeSkin(mesh_.count(), 25, 3, false);
  for (std::size_t e = 0; e < 30; ++e) skin.weights[e] = 0;  // 10 points of none
  const std::vector<Matrix4> palette = RigidPalette({0, 1, 0});
  const DualQuaternionKernel kernel(Weights(skin), centers_, all_, mask_);
  const std::vector<Double3> skinned = DualTwin(skin, palette, centers_, rest_);
  std::vector<Double3> expected;
  for (std::size_t i = 0; i < rest_.size(); ++i) {
    expected.push_back(i < 10 ? rest_[i] : rest_[i] + (skinned[i] - rest_[i]) * (0.5 * mask_[i]));
  }
  const PointBuffer moved = Run(kernel, {{Pointers(palette)}, 0.5}, in());
  EXPECT_LT(MaxDistance(ToDouble(moved.view()), expected), 3e-6);
  for (std::size_t i = 0; i < rest_.size(); ++i)
    EXPECT_EQ(SamePoint(moved.view(), in(), i), i < 10 || mask_[i] == 0) << i;
}

TEST_F(DualQuaternion, BlendWeightsGoFromTheLinearResultToIts) {
  const TestSkin skin = MakeSkin(mesh_.count(), 25, 4, true);
  const std::vector<Matrix4> palette = MakePalette(25, {0, 1, 0});
  const SkinKernel linear_kernel(Weights(skin), all_);
  PointBuffer linear(mesh_.count());
  AlignedFloats scratch(linear_kernel.ScratchFloats());
  linear_kernel.Run({{Pointers(palette)}, 1}, in(), linear.view(), scratch.span());
  const PointBuffer dual =
      Run(DualQuaternionKernel(Weights(skin), centers_, all_), {{Pointers(palette)}, 1}, in());
  const DualQuaternionKernel kernel(Weights(skin), centers_, all_, {}, mask_);
  const PointBuffer mixed = Run(kernel, {{Pointers(palette)}, 1, std::as_const(linear).view()}, in());
  const std::vector<Double3> a = ToDouble(linear.view()), b = ToDouble(dual.view());
  std::vector<Double3> expected;
  for (std::size_t i = 0; i < rest_.size(); ++i) {
    expected.push_back(a[i] + (b[i] - a[i]) * mask_[i]);
    if (mask_[i] != 0 && mask_[i] != 1) continue;
    EXPECT_TRUE(SamePoint(mixed.view(), mask_[i] == 0 ? linear.view() : dual.view(), i));
  }
  EXPECT_LT(MaxDistance(ToDouble(mixed.view()), expected), 1e-6);
  EXPECT_GT(MaxDistance(a, b), 0.1);  // the two differ
}

TEST_F(DualQuaternion, ReadsTheJointsItNames) {
  const TestSkin skin = MakeSkin(mesh_.count(), 25, 3, false);
  const std::vector<Index> few = {100, 700};
  const DualQuaternionKernel kernel(Weights(skin), centers_, few);
  std::vector<Matrix4> palette = MakePalette(25, {0, 1, 0}), poisoned = palette;
  for (Index j = 1; j < 25; ++j) {
    if (!std::binary_search(kernel.joints().begin(), kernel.joints().end(), j)) poisoned[j].m.fill(NAN);
  }
  PointBuffer points(2);
  GatherPoints(in(), few, points.view());
  const PointBuffer a = Run(kernel, {{Pointers(palette)}, 1}, points.view()),
                    b = Run(kernel, {{Pointers(poisoned)}, 1}, points.view());
  EXPECT_TRUE(SamePoint(a.view(), b.view(), 0) && SamePoint(a.view(), b.view(), 1));
}

TEST_F(DualQuaternion, WeightsThatCancelAndMatricesOfNothingStayFinite) {
  const std::vector<Index> offsets = {0, 2}, joints = {0, 1}, one = {0};
  const std::vector<float> weights = {1, -1};
  const std::vector<Double3> centers(2);
  const DualQuaternionKernel kernel({offsets, joints, weights, 2}, centers, one);
  for (const Matrix4& m : {Matrix4(), Scaling({0, 0, 0})}) {
    const std::vector<Matrix4> palette(2, m);
    PointBuffer points(1);
    points.view().x[0] = 1;
    AlignedFloats scratch(kernel.ScratchFloats());
    kernel.Run({{Pointers(palette)}, 1}, points.view(), points.view(), scratch.span());
    EXPECT_TRUE(std::isfinite(points.view().x[0]));
  }
}

TEST(NearestRotation, IsThatOfThePolarDecomposition) {
  Random random(9);
  for (int i = 0; i < 50; ++i) {
    const Matrix4 turn = RotationFromQuaternion(random.Rotation()),
                  axes = RotationFromQuaternion(random.Rotation());
    Matrix4 back = axes;
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) back(r, c) = axes(c, r);
    }
    const Double3 scale{0.001 + random.Unit(), 0.5 + 100 * random.Unit(), 1};
    const Matrix4 found = NearestRotation(turn * axes * Scaling(scale) * back);
    for (std::size_t k = 0; k < 16; ++k) EXPECT_NEAR(found.m[k], turn.m[k], 1e-9);
  }
  const Matrix4 flat = NearestRotation(Scaling({0, 1, 1}));
  EXPECT_NEAR(Determinant3(flat), 1, 1e-12);
}

}  // namespace
}  // namespace kpsa::engine
