// deltaMush in two: the smoothed points and then the frames, against the whole kernel and its twin.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <set>
#include <utility>

#include "base/matrix.h"
#include "nodes/kernels/delta_mush.h"
#include "nodes/kernels/delta_mush_step.h"
#include "nodes/kernels/weights.h"
#include "tests/nodes/delta_mush_twin.h"
#include "tests/nodes/kernel_support.h"

namespace kpsa::engine {
namespace {

using delta_mush_twin::MushTwin;
using delta_mush_twin::Points;
using delta_mush_twin::SmoothTwin;
using delta_mush_twin::ToFloat;

// A sheet with points put into the middle of every fifth triangle, so that rings have 3 to 9 neighbours and more.
TestMesh StuddedSheet() {
  const TestMesh sheet = MakeSheet(21, 17, 5);
  std::vector<float> xyz = sheet.rest.Interleaved();
  const auto from = sheet.topology.triangles();
  std::vector<Index> triangles;
  for (std::size_t t = 0; t < from.size(); t += 3) {
    const Index a = from[t], b = from[t + 1], c = from[t + 2], middle = static_cast<Index>(xyz.size() / 3);
    if (t / 3 % 5 != 0) {
      triangles.insert(triangles.end(), {a, b, c});
      continue;
    }
    for (Index k = 0; k < 3; ++k) {
      xyz.push_back((xyz[3 * a + k] + xyz[3 * b + k] + xyz[3 * c + k]) / 3 + (k == 2 ? 0.004f : 0.0f));
    }
    triangles.insert(triangles.end(), {a, b, middle, b, c, middle, c, a, middle});
  }
  Result<Topology> topology = Topology::Build(xyz.size() / 3, triangles);
  KPSA_CHECK(topology.ok());
  return {PointBuffer::FromInterleaved(xyz), *topology};
}

struct StepCase {
  DeltaMushSettings settings;
  double envelope, displacement;
  bool weighted;
};
std::vector<StepCase> StepCases() {
  std::vector<StepCase> cases;
  for (double distance_weight : {0.0, 0.6}) {
    for (bool pinned : {false, true}) {
      for (bool weighted : {false, true}) {
        cases.push_back({{10, 0.5, distance_weight, pinned}, 1, 1, weighted});
        cases.push_back({{3, 0.8, distance_weight, pinned}, 0.5, 0.7, weighted});
        cases.push_back({{1, 0.5, distance_weight, pinned}, 1, 0, weighted});
      }
    }
  }
  return cases;
}

class DeltaMushSteps : public testing::Test {
 protected:
  DeltaMushSteps()
      : mesh_(StuddedSheet()), all_(AllPoints(mesh_.count())), rest_(ToDouble(mesh_.rest.view())) {
    // Of 0 in a third, where only the first row of it lies beside others; 0.3 and 1 mixed elsewhere
    Random random(3);
    for (Double3 p : rest_)
      weights_.push_back(p.x < -0.2 || random.Below(9) == 0 ? 0.0f : random.Below(2) == 0 ? 1.0f : 0.3f);
  }
  std::vector<float> Weights(const StepCase& c) const { return c.weighted ? weights_ : std::vector<float>(); }
  DeltaMushStep Step(const StepCase& c) const {
    return {mesh_.topology, mesh_.rest.view(), c.settings, {c.envelope, c.displacement, Weights(c)}};
  }
  // Bent, twisted, and with noise of a tenth of an edge.
  PointBuffer Pose(std::uint32_t seed) const {
    Random random(seed);
    const double bend = 1 + random.Unit(), twist = random.Signed();
    Points points;
    for (Double3 p : rest_) {
      const double angle = bend * p.x + twist * p.y;
      points.push_back(Double3{std::sin(angle) * (0.5 + p.z), p.y + 0.03 * std::sin(15 * p.x),
                               std::cos(angle) * (0.5 + p.z)} +
                       random.Vector() * 0.005);
    }
    return ToFloat(points);
  }
  PointBuffer Mush(const StepCase& c, ConstPointsView in) const {
    const DeltaMushKernel kernel(mesh_.topology, mesh_.rest.view(), c.settings, all_, all_, Weights(c));
    PointBuffer out(mesh_.count());
    AlignedFloats scratch(kernel.ScratchFloats());
    kernel.Run({c.envelope, c.displacement, {}}, in, out.view(), scratch.span());
    return out;
  }
  static PointBuffer InnerOf(const DeltaMushStep& step, ConstPointsView in) {
    PointBuffer inner(step.inner_points());
    step.Inner(in, inner.view());
    return inner;
  }
  static PointBuffer RunOf(const DeltaMushStep& step, std::span<const Index> out, ConstPointsView inner) {
    const DeltaMushStep::Part part = step.Bind(out);
    AlignedFloats scratch(part.ScratchFloats());
    PointBuffer points(out.size());
    part.Run(inner, points.view(), scratch.span());
    return points;
  }
  bool SmoothsIn(const StepCase& c, Index p) const {
    return mesh_.topology.neighbors().row(p).size() >= 2 &&
           !(c.settings.pin_borders && mesh_.topology.is_border(p));
  }

  TestMesh mesh_;
  std::vector<Index> all_;
  Points rest_;
  std::vector<float> weights_;
};

TEST_F(DeltaMushSteps, AreTriedOnRingsOfAllSizes) {
  std::set<std::size_t> sizes;
  for (Index p : all_) sizes.insert(mesh_.topology.neighbors().row(p).size());
  for (std::size_t size = 3; size <= 9; ++size) EXPECT_TRUE(sizes.contains(size)) << size;
}

TEST_F(DeltaMushSteps, OneAfterTheOtherAreTheKernel) {
  double worst = 0, moved = 0;
  for (const StepCase& c : StepCases()) {
    const DeltaMushStep step = Step(c);
    ASSERT_TRUE(step.changes());
    for (std::uint32_t seed = 1; seed <= 3; ++seed) {
      const PointBuffer pose = Pose(seed), mush = Mush(c, pose.view());
      const PointBuffer out = RunOf(step, all_, InnerOf(step, pose.view()).view());
      const double apart = MaxDistance(ToDouble(out.view()), ToDouble(mush.view()));
      EXPECT_LT(apart, 1e-6) << c.settings.iterations << " " << c.settings.distance_weight << " "
                             << c.weighted;
      worst = std::max(worst, apart);
      moved = std::max(moved, MaxDistance(ToDouble(out.view()), ToDouble(pose.view())));
    }
  }
  EXPECT_GT(worst, 0);  // the canary: they are not the same code
  EXPECT_GT(moved, 1e-2);
}

TEST_F(DeltaMushSteps, AgreeWithTheTwin) {
  for (const StepCase& c : StepCases()) {
    const DeltaMushStep step = Step(c);
    const PointBuffer pose = Pose(7);
    const Points points = ToDouble(pose.view());
    Points expected = MushTwin(mesh_.topology, c.settings, rest_, points, c.envelope, c.displacement);
    if (c.weighted) {
      for (Index p : all_) expected[p] = points[p] + (expected[p] - points[p]) * weights_[p];
    }
    EXPECT_LT(MaxDistance(ToDouble(RunOf(step, all_, InnerOf(step, pose.view()).view()).view()), expected),
              2e-6)
        << c.settings.iterations << " " << c.settings.distance_weight << " " << c.weighted;
  }
}

// What is smoothed, what is as it came in, and how few points are there twice.
TEST_F(DeltaMushSteps, InnerPointsAreSmoothedWhereAFrameReadsThem) {
  for (const StepCase& c : StepCases()) {
    const DeltaMushStep step = Step(c);
    const PointBuffer pose = Pose(9), inner_points = InnerOf(step, pose.view());
    const Points points = ToDouble(pose.view()), inner = ToDouble(inner_points.view());
    const Points smoothed = SmoothTwin(mesh_.topology, c.settings, rest_, points);
    const auto mix = [&](Index p) { return c.envelope * (c.weighted ? weights_[p] : 1.0f); };
    std::vector<bool> read(points.size(), false);
    for (Index p : all_) {
      if (mix(p) == 0 || !SmoothsIn(c, p)) continue;
      read[p] = true;
      for (Index q : mesh_.topology.neighbors().row(p)) read[q] = true;
    }
    std::size_t row = points.size(), unread = 0;
    for (Index p : all_) {
      if (read[p] && SmoothsIn(c, p)) {
        ASSERT_LT(Length(inner[p] - smoothed[p]), 1e-6) << p;
        ASSERT_GT(Length(inner[p] - points[p]), 1e-6) << p;
        if (mix(p) == 1) continue;
        ASSERT_LT(row, inner.size());
        ASSERT_EQ(inner[row++], points[p]) << p;
      } else {
        ASSERT_EQ(inner[p], points[p]) << p;
        unread += !read[p];
      }
    }
    EXPECT_EQ(row, inner.size());
    if (!c.weighted && c.envelope == 1) {
      EXPECT_EQ(inner.size(), points.size());
    }
    if (c.weighted) {
      EXPECT_GT(unread, 50u);
    }
  }
}

// Of the inner points that a part does not name, nothing is read: they are not numbers.
TEST_F(DeltaMushSteps, PartsGiveTheBitsOfTheWhole) {
  Random random(11);
  for (const StepCase& c : StepCases()) {
    const DeltaMushStep step = Step(c);
    const PointBuffer inner = InnerOf(step, Pose(4).view());
    const PointBuffer whole = RunOf(step, all_, inner.view());
    for (std::size_t size : {0u, 1u, 2u, 40u, 300u}) {
      std::set<Index> chosen;
      while (chosen.size() < size) chosen.insert(random.Below(all_.size()));
      const std::vector<Index> out(chosen.begin(), chosen.end());
      const std::vector<Index> named = step.Bind(out).inner();
      ASSERT_TRUE(IsSortedSet(named, step.inner_points()));
      EXPECT_LE(named.size(), 14 * size);
      constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
      PointBuffer some(step.inner_points());
      std::fill_n(some.view().x, PaddedCount(some.count()), kNan);
      std::fill_n(some.view().y, PaddedCount(some.count()), kNan);
      std::fill_n(some.view().z, PaddedCount(some.count()), kNan);
      for (Index i : named) {
        some.view().x[i] = inner.view().x[i], some.view().y[i] = inner.view().y[i];
        some.view().z[i] = inner.view().z[i];
      }
      const PointBuffer part = RunOf(step, out, some.view());
      for (std::size_t i = 0; i < size; ++i) {
        const ConstPointsView a = std::as_const(part).view(), b = std::as_const(whole).view();
        ASSERT_EQ(std::memcmp(a.x + i, b.x + out[i], sizeof(float)), 0);
        ASSERT_EQ(std::memcmp(a.y + i, b.y + out[i], sizeof(float)), 0);
        ASSERT_EQ(std::memcmp(a.z + i, b.z + out[i], sizeof(float)), 0);
      }
    }
  }
}

TEST_F(DeltaMushSteps, WhatDoesNotChangeComesOutBitForBit) {
  const StepCase c{{10, 0.5, 0, true}, 1, 1, true};
  const DeltaMushStep step = Step(c);
  const PointBuffer pose = Pose(5);
  const Points in = ToDouble(pose.view()),
               out = ToDouble(RunOf(step, all_, InnerOf(step, pose.view()).view()).view());
  std::size_t through = 0;
  for (Index p : all_) {
    if (weights_[p] != 0 && SmoothsIn(c, p)) continue;
    EXPECT_EQ(out[p], in[p]);
    ++through;
  }
  EXPECT_GT(through, 100u);
}

// Moved and turned, both do as the points that came in; scaled, the inner points do, and what comes out where the
// detail is scaled as well.
TEST_F(DeltaMushSteps, GoWithThePointsThatComeIn) {
  for (const StepCase& c : StepCases()) {
    for (double scale : {1.0, 2.5}) {
      const Matrix4 motion = ComposeTrs({0.3, -1, 0.5}, Random(1).Rotation(), {scale, scale, scale});
      const DeltaMushStep step = Step(c);
      StepCase grown_case = c;
      grown_case.displacement *= scale;
      const DeltaMushStep grown = Step(grown_case);
      const auto moved = [&](ConstPointsView points) {
        Points result;
        for (Double3 p : ToDouble(points)) result.push_back(TransformPoint(motion, p));
        return result;
      };
      const PointBuffer pose = Pose(6), inner = InnerOf(step, pose.view());
      const PointBuffer moved_inner = InnerOf(step, ToFloat(moved(pose.view())).view());
      EXPECT_LT(MaxDistance(ToDouble(moved_inner.view()), moved(inner.view())), 1e-6 * scale);
      EXPECT_LT(MaxDistance(ToDouble(RunOf(grown, all_, moved_inner.view()).view()),
                            moved(RunOf(step, all_, inner.view()).view())),
                2e-6 * scale);
    }
  }
}

TEST_F(DeltaMushSteps, TheRestShapeComesBackFarAway) {
  PointBuffer rest(mesh_.count());
  for (Index p : all_) {
    rest.view().x[p] = mesh_.rest.view().x[p] + 1000;
    rest.view().y[p] = mesh_.rest.view().y[p] - 1000;
    rest.view().z[p] = mesh_.rest.view().z[p] + 1000;
  }
  const DeltaMushStep step(mesh_.topology, rest.view(), {}, {});
  const PointBuffer out = RunOf(step, all_, InnerOf(step, rest.view()).view());
  EXPECT_LT(MaxDistance(ToDouble(out.view()), ToDouble(rest.view())), 1e-4);  // floats are 6e-5 apart there
}

TEST_F(DeltaMushSteps, AreNoneWhereNothingChanges) {
  const auto changes = [&](DeltaMushSettings settings, double envelope, std::vector<float> weights) {
    return DeltaMushStep(mesh_.topology, mesh_.rest.view(), settings, {envelope, 1, std::move(weights)})
        .changes();
  };
  EXPECT_TRUE(changes({}, 1, {}));
  EXPECT_FALSE(changes({0, 0.5, 0, false}, 1, {}));
  EXPECT_FALSE(changes({10, 0, 0, false}, 1, {}));
  EXPECT_FALSE(changes({}, 0, {}));
  std::vector<float> weights(mesh_.count(), 0.0f);
  EXPECT_FALSE(changes({}, 1, weights));
  weights[0] = 1;  // a corner
  EXPECT_TRUE(changes({}, 1, weights));
  EXPECT_FALSE(changes({10, 0.5, 0, true}, 1, weights));
}

}  // namespace
}  // namespace kpsa::engine
