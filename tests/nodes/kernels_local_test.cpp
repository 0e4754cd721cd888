// The local kernels against plain loops in double, and what must hold exactly.
#include <algorithm>
#include <cmath>
#include <functional>

#include "base/simd.h"
#include "nodes/kernels/blend_shape.h"
#include "nodes/kernels/lattice.h"
#include "nodes/kernels/skin.h"
#include "nodes/kernels/soft_mod.h"
#include "nodes/kernels/weights.h"
#include "tests/nodes/local_kernels.h"

namespace kpsa::engine {
namespace {

// ----------------------------------------------------------------------------------------------------
// skinCluster

std::vector<Double3> SkinTwin(const TestSkin& skin, const std::vector<Matrix4>& palette,
                              const std::vector<Double3>& points, bool normalize) {
  std::vector<Double3> result;
  for (std::size_t p = 0; p < points.size(); ++p) {
    Double3 sum;
    double weights = 0;
    for (Index e = skin.offsets[p]; e < skin.offsets[p + 1]; ++e) {
      sum = sum + TransformPoint(palette[skin.joints[e]], points[p]) * skin.weights[e];
      weights += skin.weights[e];
    }
    result.push_back(normalize ? sum * (1 / weights) : sum);
  }
  return result;
}

TEST_F(LocalKernels, SkinAgreesWithItsTwin) {
  for (int influences : {1, 2, 3, 4, 5, 6, 7, 8, 12}) {
    const TestSkin skin = MakeSkin(mesh_.count(), 25, influences, influences == 12);
    const std::vector<Matrix4> palette = MakePalette(25, {0, 1, 0});
    const SkinKernel kernel({skin.offsets, skin.joints, skin.weights, 25}, all_);
    EXPECT_LT(MaxDistance(ToDouble(Evaluate(kernel, {{Pointers(palette)}, 1}, in()).view()),
                          SkinTwin(skin, palette, rest_, false)),
              1e-6)
        << influences;
  }
}

TEST_F(LocalKernels, SkinKeepsTheShapeAThousandMetresAway) {
  // The spacing of float at 1,000 m is 6.1e-5: a coordinate is off by half of it where the shape is kept
  const TestSkin skin = MakeSkin(mesh_.count(), 25, 4, false);
  const std::vector<Matrix4> palette = MakePalette(25, {1000, -900, 800});
  const SkinKernel kernel({skin.offsets, skin.joints, skin.weights, 25}, all_);
  const std::vector<Double3> moved = ToDouble(Evaluate(kernel, {{Pointers(palette)}, 1}, in()).view());
  const std::vector<Double3> twin = SkinTwin(skin, palette, rest_, true);
  for (std::size_t i = 0; i < moved.size(); ++i) {
    for (int a = 0; a < 3; ++a) ASSERT_NEAR(moved[i][a], twin[i][a], 3.1e-5);
  }
}

TEST_F(LocalKernels, SkinLeavesWhatTheEnvelopeLeaves) {
  TestSkin skin = MakeSkin(mesh_.count(), 25, 3, false);
  for (std::size_t e = 0; e < 60; ++e)
    skin.weights[e] *= e < 30 ? 0.0f : 0.5f;  // 10 points of none, 10 of a half
  const std::vector<Matrix4> palette = MakePalette(25, {0, 1, 0});
  const SkinKernel kernel({skin.offsets, skin.joints, skin.weights, 25}, all_, mask_);
  const std::vector<Double3> skinned = SkinTwin(skin, palette, rest_, false);
  std::vector<Double3> expected;
  for (std::size_t i = 0; i < rest_.size(); ++i) {
    expected.push_back(i < 10 ? rest_[i] : rest_[i] + (skinned[i] - rest_[i]) * (0.5 * mask_[i]));
  }
  const PointBuffer moved = Evaluate(kernel, {{Pointers(palette)}, 0.5}, in());
  EXPECT_LT(MaxDistance(ToDouble(moved.view()), expected), 2e-6);
  for (std::size_t i = 0; i < rest_.size(); ++i) {
    EXPECT_EQ(SameBits(moved.view(), in(), i), i < 10 || mask_[i] == 0) << i;
  }
}

TEST_F(LocalKernels, SkinReadsTheJointsItNames) {
  TestSkin skin = MakeSkin(mesh_.count(), 25, 3, false);
  const std::vector<Index> few = {100, 700};
  const SkinKernel kernel({skin.offsets, skin.joints, skin.weights, 25}, few);
  std::vector<Matrix4> palette = MakePalette(25, {0, 1, 0}), poisoned = palette;
  for (Index j = 1; j < 25; ++j) {
    if (!std::binary_search(kernel.joints().begin(), kernel.joints().end(), j)) poisoned[j].m.fill(NAN);
  }
  PointBuffer points(2);
  GatherPoints(in(), few, points.view());
  const PointBuffer a = Evaluate(kernel, {{Pointers(palette)}, 1}, points.view()),
                    b = Evaluate(kernel, {{Pointers(poisoned)}, 1}, points.view());
  EXPECT_TRUE(SameBits(a.view(), b.view(), 0) && SameBits(a.view(), b.view(), 1));
  EXPECT_LE(kernel.joints().size(), 6u);
}

TEST(SkinWeights, BadOnesAreNamed) {
  const std::vector<Index> offsets = {0, 1, 2}, joints = {0, 1};
  const std::vector<float> weights = {1, 1};
  EXPECT_TRUE((SkinWeights{offsets, joints, weights, 2}.Validate().ok()));
  EXPECT_FALSE((SkinWeights{{}, joints, weights, 2}.Validate().ok()));
  EXPECT_FALSE((SkinWeights{offsets, joints, weights, 1}.Validate().ok()));
  EXPECT_FALSE((SkinWeights{offsets, joints, weights, 0}.Validate().ok()));
  EXPECT_FALSE((SkinWeights{offsets, std::span(joints).first(1), weights, 2}.Validate().ok()));
  EXPECT_FALSE((SkinWeights{offsets, joints, std::vector<float>{1, NAN}, 2}.Validate().ok()));
  EXPECT_FALSE((SkinWeights{std::vector<Index>{0, 7, 2}, joints, weights, 2}.Validate().ok()));
  EXPECT_FALSE((SkinWeights{std::vector<Index>{1, 1, 2}, joints, weights, 2}.Validate().ok()));
}

// -----------------------------------------------------------------------------------------------------
// blendShape

TEST_F(LocalKernels, BlendShapeAgreesWithItsTwin) {
  const std::vector<TestTarget> targets = MakeTargets(mesh_.count(), 20, 0.25);
  std::vector<BlendTarget> views;
  for (const TestTarget& target : targets) views.push_back({target.points, target.deltas});
  ASSERT_TRUE((BlendShapeTargets{mesh_.count(), views}.Validate().ok()));
  const BlendShapeKernel kernel({mesh_.count(), views}, all_, mask_);
  std::vector<double> weights;
  for (int k = 0; k < 20; ++k) weights.push_back(k % 3 == 0 ? 0 : 0.3 * k - 2);
  std::vector<Double3> expected = rest_;
  for (std::size_t k = 0; k < 20; ++k) {
    for (std::size_t i = 0; i < targets[k].points.size(); ++i) {
      const Index p = targets[k].points[i];
      const float* d = &targets[k].deltas[3 * i];
      expected[p] = expected[p] + Double3{d[0], d[1], d[2]} * (0.8 * weights[k] * mask_[p]);
    }
  }
  EXPECT_LT(MaxDistance(ToDouble(Evaluate(kernel, {weights, 0.8}, in()).view()), expected), 1e-6);
}

TEST_F(LocalKernels, ABlendShapeAtRestPassesPointsThroughBitForBit) {
  PointBuffer points(mesh_.count());
  CopyPoints(in(), points.view());
  for (std::size_t i = 0; i < points.count(); i += 3) points.view().x[i] = -0.0f;
  const std::vector<Index> moved = {5};
  const std::vector<float> delta = {1, 2, 3};
  const BlendTarget target{moved, delta};
  const BlendShapeKernel kernel({mesh_.count(), {&target, 1}}, all_);
  const double off = 0, on = 1;
  const PointBuffer rest = Evaluate(kernel, {{&off, 1}, 1}, points.view());
  const PointBuffer posed = Evaluate(kernel, {{&on, 1}, 1}, points.view());
  for (std::size_t i = 0; i < points.count(); ++i) {
    EXPECT_TRUE(SameBits(rest.view(), points.view(), i));
    EXPECT_EQ(SameBits(posed.view(), points.view(), i), i != 5);
  }
}

TEST(BlendShapeTargets, BadOnesAreNamed) {
  const std::vector<Index> points = {1, 3}, descending = {3, 1};
  const std::vector<float> deltas = {1, 2, 3, 4, 5, 6}, nan = {1, 2, 3, 4, NAN, 6};
  const auto ok = [](std::size_t count, BlendTarget target) {
    return BlendShapeTargets{count, {&target, 1}}.Validate().ok();
  };
  EXPECT_TRUE(ok(4, {points, deltas}));
  EXPECT_FALSE(ok(3, {points, deltas}));
  EXPECT_FALSE(ok(4, {descending, deltas}));
  EXPECT_FALSE(ok(4, {points, std::span(deltas).first(5)}));
  EXPECT_FALSE(ok(4, {points, nan}));
}

// -------------------------------------------------------------------------------------------- cluster and
// softMod

TEST_F(LocalKernels, ClusterAgreesWithItsTwin) {
  const Matrix4 delta = ComposeTrs({0.1, 0.2, 0.3}, Random(2).Rotation(), {1, 2, 0.5});
  const ClusterKernel kernel(all_, mask_);
  const PointBuffer out = Evaluate(kernel, {delta, {0.1, 0, 0}, 0.75}, in());
  std::vector<Double3> expected;
  for (std::size_t i = 0; i < rest_.size(); ++i) {
    expected.push_back(rest_[i] + (TransformPoint(delta, rest_[i]) - rest_[i]) * (0.75 * mask_[i]));
    EXPECT_EQ(SameBits(out.view(), in(), i), mask_[i] == 0);
  }
  EXPECT_LT(MaxDistance(ToDouble(out.view()), expected), 1e-6);
}

TEST_F(LocalKernels, ClusterIsPreciseFarAway) {
  // A turn about a place 1,000 m from the origin, of points there
  const Double3 place{1000, 500, -700};
  const Matrix4 delta =
      Translation(place) * ComposeTrs({}, Random(3).Rotation(), {1, 1, 1}) * Translation(place * -1);
  PointBuffer far(mesh_.count());
  for (std::size_t i = 0; i < mesh_.count(); ++i) {
    far.view().x[i] = static_cast<float>(rest_[i].x + place.x);
    far.view().y[i] = static_cast<float>(rest_[i].y + place.y);
    far.view().z[i] = static_cast<float>(rest_[i].z + place.z);
  }
  std::vector<Double3> expected;
  for (Double3 p : ToDouble(far.view())) expected.push_back(TransformPoint(delta, p));
  const std::vector<Double3> turned =
      ToDouble(Evaluate(ClusterKernel(all_), {delta, place, 1}, far.view()).view());
  for (std::size_t i = 0; i < turned.size(); ++i) {
    for (int a = 0; a < 3; ++a) ASSERT_NEAR(turned[i][a], expected[i][a], 3.2e-5);
  }
}

// --------------------------------------------------------------------------------------------------------
// lattice

// The textbook definitions: binomials, and the recursion of Cox and de Boor over an explicit knot vector.
double BernsteinTwin(int n, int i, double x) {
  double binomial = 1;
  for (int k = 0; k < i; ++k) binomial = binomial * (n - k) / (k + 1);
  return binomial * std::pow(x, i) * std::pow(1 - x, n - i);
}
double SplineTwin(const std::vector<double>& knots, std::size_t i, int order, double x) {
  if (order == 1) {
    const bool last = knots[i + 1] == knots.back() && knots[i] < knots[i + 1];
    return x >= knots[i] && (x < knots[i + 1] || (last && x == knots[i + 1])) ? 1 : 0;
  }
  const std::size_t k = static_cast<std::size_t>(order);
  double value = 0;
  if (knots[i + k - 1] > knots[i])
    value += (x - knots[i]) / (knots[i + k - 1] - knots[i]) * SplineTwin(knots, i, order - 1, x);
  if (knots[i + k] > knots[i + 1])
    value += (knots[i + k] - x) / (knots[i + k] - knots[i + 1]) * SplineTwin(knots, i + 1, order - 1, x);
  return value;
}
double BasisTwin(int divisions, int order, int i, double x) {
  if (order == 0) return BernsteinTwin(divisions - 1, i, x);
  std::vector<double> knots(static_cast<std::size_t>(order - 1), 0.0);
  for (int k = 0; k <= divisions - order + 1; ++k)
    knots.push_back(static_cast<double>(k) / (divisions - order + 1));
  knots.insert(knots.end(), static_cast<std::size_t>(order - 1), 1.0);
  return SplineTwin(knots, static_cast<std::size_t>(i), order, x);
}

TEST(Lattice, TheBasisIsTheTextbooks) {
  for (int divisions : {2, 3, 5, 9}) {
    for (int order : {0, 2, 3, 4}) {
      if (order > divisions) continue;
      for (int step = 0; step <= 40; ++step) {
        const double x = step / 40.0;
        const std::vector<double> w = LatticeBasis(divisions, order, x);
        double sum = 0;
        for (int i = 0; i < divisions; ++i) {
          EXPECT_NEAR(w[static_cast<std::size_t>(i)], BasisTwin(divisions, order, i, x), 1e-12)
              << divisions << " " << order << " " << x;
          sum += w[static_cast<std::size_t>(i)];
        }
        EXPECT_NEAR(sum, 1, 1e-13);
      }
    }
  }
}

std::vector<Double3> LatticeTwin(const LatticeSettings& settings, const Matrix4& lattice_from_rest,
                                 const LatticeKernel::Inputs& inputs, const std::vector<Double3>& rest,
                                 const std::vector<Double3>& points, std::span<const float> mask) {
  std::vector<Double3> result;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Double3 bound = TransformPoint(lattice_from_rest, rest[i]) + Double3{.5, .5, .5};
    Double3 inside;
    for (int a = 0; a < 3; ++a) inside[a] = std::clamp(bound[a], 0.0, 1.0);
    const double distance = Length(bound - inside);
    double weight = inputs.envelope * (mask.empty() ? 1.0f : mask[i]);
    if (settings.outside == LatticeOutside::kInside && distance > 1e-6) weight = 0;
    if (settings.outside == LatticeOutside::kFalloff)
      weight *= std::max(0.0, 1 - distance / settings.falloff_distance);
    Double3 q = TransformPoint(InverseOrIdentity(inputs.base_matrix), points[i]);
    std::size_t control = 0;
    const auto order = [&](std::size_t a) {
      return settings.local ? std::min(settings.influence[a], settings.divisions[a]) : 0;
    };
    for (int u = 0; u < settings.divisions[2]; ++u) {
      for (int t = 0; t < settings.divisions[1]; ++t) {
        for (int s = 0; s < settings.divisions[0]; ++s, ++control) {
          q = q + inputs.offsets[control] * (BasisTwin(settings.divisions[0], order(0), s, inside.x) *
                                             BasisTwin(settings.divisions[1], order(1), t, inside.y) *
                                             BasisTwin(settings.divisions[2], order(2), u, inside.z));
        }
      }
    }
    result.push_back(points[i] + (TransformPoint(inputs.matrix, q) - points[i]) * weight);
  }
  return result;
}

TEST_F(LocalKernels, LatticeAgreesWithItsTwin) {
  const Matrix4 base = ComposeTrs({0.1, 0, 0.1}, Random(8).Rotation(), {0.7, 0.8, 0.9});
  const Matrix4 moved = base * ComposeTrs({0.1, 0, 0}, Random(9).Rotation(), {1, 1.2, 1});
  std::vector<Double3> incoming = rest_;
  PointBuffer points(mesh_.count());
  for (std::size_t i = 0; i < incoming.size(); ++i) {
    points.view().x[i] = static_cast<float>(rest_[i].x);
    points.view().y[i] = static_cast<float>(rest_[i].y + 0.05 * std::sin(9 * rest_[i].x));
    points.view().z[i] = static_cast<float>(rest_[i].z);
  }
  incoming = ToDouble(points.view());
  for (const LatticeSettings& settings :
       {LatticeSettings{{2, 2, 2}}, LatticeSettings{{5, 5, 5}}, LatticeSettings{{5, 5, 5}, true, {4, 4, 4}},
        LatticeSettings{{5, 4, 3}, false}, LatticeSettings{{9, 8, 7}, true, {2, 2, 2}, LatticeOutside::kAll},
        LatticeSettings{{3, 9, 3}, true, {2, 3, 5}, LatticeOutside::kFalloff, 0.25}}) {
    ASSERT_TRUE(settings.Validate().ok());
    const LatticeKernel kernel(settings, in(), InverseOrIdentity(base), all_, mask_);
    Random random(9);
    std::vector<Double3> offsets(kernel.control_count());
    for (Double3& o : offsets) o = random.Vector() * 0.2;
    const std::vector<Index> every = AllPoints(offsets.size());
    for (const Matrix4& now : {base, moved}) {
      const LatticeKernel::Inputs inputs{offsets, every, base, now, 0.75};
      EXPECT_LT(MaxDistance(ToDouble(Evaluate(kernel, inputs, points.view()).view()),
                            LatticeTwin(settings, InverseOrIdentity(base), inputs, rest_, incoming, mask_)),
                1e-6)
          << settings.divisions[0] << " " << settings.divisions[1] << " " << settings.local;
    }
  }
}

TEST_F(LocalKernels, ALatticeThatMovesAsAWholeMovesItsPoints) {
  const Matrix4 base = Scaling({2, 2, 2});
  const LatticeSettings settings{{3, 4, 5}, true, {3, 2, 2}};
  const LatticeKernel kernel(settings, in(), InverseOrIdentity(base), all_);
  const std::vector<Double3> still(kernel.control_count()),
      shifted(kernel.control_count(), Double3{0.25, 0.5, -0.125});
  // At rest: bit for bit
  const PointBuffer rest = Evaluate(kernel, {still, {}, base, base, 1}, in());
  for (std::size_t i = 0; i < rest_.size(); ++i) ASSERT_TRUE(SameBits(rest.view(), in(), i));
  // All controls shifted, in a lattice of size 2
  std::vector<Double3> expected;
  for (Double3 p : rest_) expected.push_back(p + Double3{0.5, 1, -0.25});
  EXPECT_LT(
      MaxDistance(ToDouble(Evaluate(kernel, {shifted, MovedControls(shifted), base, base, 1}, in()).view()),
                  expected),
      3e-7);
  // The lattice itself turned
  const Matrix4 turn = ComposeTrs({1, 0, 0}, Random(4).Rotation(), {1, 1, 1});
  for (std::size_t i = 0; i < rest_.size(); ++i) expected[i] = TransformPoint(turn, rest_[i]);
  EXPECT_LT(MaxDistance(ToDouble(Evaluate(kernel, {still, {}, base, turn * base, 1}, in()).view()), expected),
            3e-7);
}

// Whether controls that rest are named as moved changes no bit; the offsets of those that are not are not read.
TEST_F(LocalKernels, ALatticeReadsTheOffsetsOfMovedControlsAlone) {
  const Matrix4 base = ComposeTrs({0.1, 0, 0.1}, Random(8).Rotation(), {0.7, 0.8, 0.9});
  Matrix4 none = base;
  none(1, 1) = NAN;
  std::size_t differ = 0;
  for (const LatticeSettings& settings :
       {LatticeSettings{{5, 4, 3}, false},
        LatticeSettings{{9, 8, 7}, true, {2, 2, 2}, LatticeOutside::kAll}}) {
    const LatticeKernel kernel(settings, in(), InverseOrIdentity(base), all_, mask_);
    std::vector<Double3> offsets(kernel.control_count()), unread(offsets.size(), Double3{NAN, NAN, NAN});
    for (const std::size_t c : {std::size_t{7}, std::size_t{8}, offsets.size() / 2})
      unread[c] = offsets[c] = {0.1, -0.2, 0.05};
    const std::vector<Index> every = AllPoints(offsets.size()), moved = MovedControls(offsets);
    ASSERT_EQ(moved.size(), 3u);
    for (const Matrix4& matrix : {base, none}) {
      const PointBuffer a = Evaluate(kernel, {offsets, every, matrix, matrix, 0.75}, in()),
                        b = Evaluate(kernel, {unread, moved, matrix, matrix, 0.75}, in());
      for (std::size_t i = 0; i < rest_.size(); ++i) {
        ASSERT_TRUE(SameBits(a.view(), b.view(), i)) << i;
        differ += !SameBits(a.view(), in(), i);
      }
    }
  }
  EXPECT_GT(differ, 100u);
}

TEST_F(LocalKernels, ASmallestLatticeShears) {
  const LatticeKernel kernel({{2, 2, 2}}, in(), Scaling({0.5, 0.5, 0.5}), all_);
  std::vector<Double3> offsets(8);
  for (std::size_t c = 0; c < 8; ++c)
    offsets[c].x = (c & 2) != 0 ? 0.25 : 0;  // the upper half goes to the side
  const Matrix4 base = Scaling({2, 2, 2});
  std::vector<Double3> expected;
  for (Double3 p : rest_) expected.push_back({p.x + 0.5 * (p.y / 2 + 0.5), p.y, p.z});
  EXPECT_LT(
      MaxDistance(ToDouble(Evaluate(kernel, {offsets, MovedControls(offsets), base, base, 1}, in()).view()),
                  expected),
      2e-7);
}

TEST_F(LocalKernels, ALatticeTurnedByItsParentTurnsItsResult) {
  const Matrix4 base = Scaling({2, 2, 2}), parent = ComposeTrs({1, 2, 3}, Random(5).Rotation(), {1, 1, 1});
  const LatticeKernel kernel({{4, 4, 4}}, in(), InverseOrIdentity(base), all_);
  Random random(6);
  std::vector<Double3> offsets(64);
  for (Double3& o : offsets) o = random.Vector() * 0.1;
  PointBuffer carried(mesh_.count());
  for (std::size_t i = 0; i < rest_.size(); ++i) {
    const Double3 p = TransformPoint(parent, rest_[i]);
    carried.view().x[i] = static_cast<float>(p.x);
    carried.view().y[i] = static_cast<float>(p.y);
    carried.view().z[i] = static_cast<float>(p.z);
  }
  std::vector<Double3> expected =
      ToDouble(Evaluate(kernel, {offsets, MovedControls(offsets), base, base, 1}, in()).view());
  for (Double3& p : expected) p = TransformPoint(parent, p);
  EXPECT_LT(MaxDistance(
                ToDouble(Evaluate(kernel, {offsets, MovedControls(offsets), parent * base, parent * base, 1},
                                  carried.view())
                             .view()),
                expected),
            1e-6);
}

TEST_F(LocalKernels, PointsOutsideOfALatticeStay) {
  const Matrix4 base = Scaling({0.5, 0.5, 2});
  const std::vector<Double3> shifted(8, Double3{1, 0, 0});
  const LatticeKernel kernel({{2, 2, 2}}, in(), InverseOrIdentity(base), all_);
  const PointBuffer out = Evaluate(kernel, {shifted, MovedControls(shifted), base, base, 1}, in());
  std::size_t outside = 0;
  for (std::size_t i = 0; i < rest_.size(); ++i) {
    const bool far = std::fabs(rest_[i].x) > 0.26 || std::fabs(rest_[i].y) > 0.26;
    const bool near = std::fabs(rest_[i].x) < 0.25 && std::fabs(rest_[i].y) < 0.25;
    if (far) {
      ++outside;
      EXPECT_TRUE(SameBits(out.view(), in(), i));
    } else if (near) {
      EXPECT_NEAR(out.view().x[i], rest_[i].x + 0.5, 1e-6);
    }
  }
  EXPECT_GT(outside, 100u);
}

TEST(Lattice, MovedControlsAreFoundOnEveryVectorUnit) {
  for (const std::string target : {"avx512", "avx2", "scalar"}) {
    if (!SelectSimdTarget(target)) continue;
    for (const Index count : {8u, 27u, 48u, 125u}) {
      const PointBuffer rest(count);
      PointBuffer now(count);
      const PointsView places = now.view();
      for (std::size_t i = count; i < PaddedCount(count); ++i)
        places.x[i] = 5;    // what is behind them is none
      places.x[1] = -0.0f;  // has not moved
      places.x[2] = 1, places.y[5] = NAN, places.z[count - 1] = -1;
      std::vector<Index> moved(count);
      moved.resize(FindMovedControls(places, rest.view(), moved.data()));
      EXPECT_EQ(moved, (std::vector<Index>{2, 5, count - 1})) << target << ", " << count;
    }
  }
  SelectSimdTarget("");
}

TEST(Lattice, BadSettingsAreNamed) {
  EXPECT_TRUE((LatticeSettings{{2, 32, 5}}.Validate().ok()));
  EXPECT_FALSE((LatticeSettings{{1, 5, 5}}.Validate().ok()));
  EXPECT_FALSE((LatticeSettings{{2, 33, 5}}.Validate().ok()));
  EXPECT_FALSE((LatticeSettings{{2, 5, 5}, true, {1, 2, 2}}.Validate().ok()));
  EXPECT_FALSE((LatticeSettings{{2, 5, 5}, true, {2, 2, 2}, LatticeOutside::kFalloff, 0}.Validate().ok()));
  EXPECT_FALSE((LatticeSettings{{2, 5, 5}, true, {2, 2, 2}, LatticeOutside::kFalloff, NAN}.Validate().ok()));
}

// -------------------------------------------------------------------------------------------------------
// together

TEST_F(LocalKernels, AChainInPlaceIsTheChainApart) {
  const TestSkin skin = MakeSkin(mesh_.count(), 25, 4, true);
  const std::vector<Matrix4> palette = MakePalette(25, {0, 1, 0});
  const SkinKernel skin_kernel({skin.offsets, skin.joints, skin.weights, 25}, all_);
  const ClusterKernel cluster(all_, mask_);
  const LatticeKernel lattice({{3, 3, 3}}, in(), {}, all_);
  const std::vector<Double3> offsets(27, Double3{0.1, 0, 0});
  const std::vector<Index> all = AllPoints(27);
  const Matrix4 turn = ComposeTrs({}, Random(1).Rotation(), {1, 1, 1});
  AlignedFloats scratch(10000);
  const PointBuffer a = Evaluate(skin_kernel, {{Pointers(palette)}, 1}, in()),
                    b = Evaluate(cluster, {turn, {}, 1}, a.view());
  const PointBuffer c = Evaluate(lattice, {offsets, all, {}, turn, 1}, b.view());
  PointBuffer d(mesh_.count());
  CopyPoints(in(), d.view());
  skin_kernel.Run({{Pointers(palette)}, 1}, d.view(), d.view(), scratch.span());
  cluster.Run({turn, {}, 1}, d.view(), d.view(), scratch.span());
  lattice.Run({offsets, all, {}, turn, 1}, d.view(), d.view(), scratch.span());
  for (std::size_t i = 0; i < rest_.size(); ++i) ASSERT_TRUE(SameBits(c.view(), d.view(), i));
}

}  // namespace
}  // namespace kpsa::engine
