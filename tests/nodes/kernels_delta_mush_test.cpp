// deltaMush and normals against plain loops in double, and the identities that define them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "nodes/kernels/delta_mush.h"
#include "nodes/kernels/normals.h"
#include "nodes/kernels/weights.h"
#include "tests/nodes/delta_mush_twin.h"
#include "tests/nodes/kernel_support.h"

namespace kpsa::engine {
namespace {

using delta_mush_twin::MushTwin;
using delta_mush_twin::Points;
using delta_mush_twin::SmoothTwin;
using delta_mush_twin::ToFloat;

class DeltaMush : public testing::Test {
 protected:
  DeltaMush() : mesh_(MakeSheet(23, 19)), all_(AllPoints(mesh_.count())), rest_(ToDouble(mesh_.rest.view())) {
    for (Double3 p : rest_) {  // bent about y, with a wave
      const double angle = 1.5 * p.x;
      pose_.push_back(
          {std::sin(angle) * (0.5 + p.z), p.y + 0.03 * std::sin(15 * p.x), std::cos(angle) * (0.5 + p.z)});
    }
    posed_ = ToFloat(pose_);
    pose_ = ToDouble(posed_.view());
  }
  Points Run(const DeltaMushSettings& settings, ConstPointsView in,
             const DeltaMushKernel::Inputs& inputs = {}) const {
    const DeltaMushKernel kernel(mesh_.topology, mesh_.rest.view(), settings, all_, all_);
    PointBuffer out(mesh_.count());
    AlignedFloats scratch(kernel.ScratchFloats());
    kernel.Run(inputs, in, out.view(), scratch.span());
    return ToDouble(out.view());
  }

  TestMesh mesh_;
  std::vector<Index> all_;
  Points rest_, pose_;
  PointBuffer posed_;
};

TEST_F(DeltaMush, AgreesWithItsTwin) {
  for (const DeltaMushSettings& settings :
       {DeltaMushSettings{1, 0.5, 0, false}, DeltaMushSettings{10, 0.5, 0, false},
        DeltaMushSettings{6, 1, 0, true}, DeltaMushSettings{8, 0.3, 1, true},
        DeltaMushSettings{5, 0.5, 0.5, false}}) {
    // The rotation amplifies the rounding of a ring's edges (a hundredth of the mesh) by what is left of the
    // detail
    EXPECT_LT(MaxDistance(Run(settings, posed_.view(), {0.75, 0.9, {}}),
                          MushTwin(mesh_.topology, settings, rest_, pose_, 0.75, 0.9)),
              2e-6)
        << settings.iterations << " " << settings.distance_weight;
  }
}

TEST_F(DeltaMush, TheRestShapeComesBack) {
  for (int iterations : {1, 5, 40})
    EXPECT_LT(MaxDistance(Run({iterations, 0.5, 0, false}, mesh_.rest.view()), rest_), 2e-7);
}

// Pressed flat and through itself, frames turn over: points go on where they were.
TEST_F(DeltaMush, FoldingOverIsContinuous) {
  const auto pressed = [&](double amount) {
    Points points = rest_;
    for (Double3& p : points) p = {amount * p.x, p.y, p.z};
    return Run({10, 0.5, 0, false}, ToFloat(points).view());
  };
  EXPECT_LT(MaxDistance(pressed(1e-4), pressed(-1e-4)), 2e-4);
  // The canary: there is detail to turn over, and it is all there on both sides
  EXPECT_GT(MaxDistance(SmoothTwin(mesh_.topology, {10, 0.5, 0, false}, rest_, rest_), rest_), 2e-3);
  EXPECT_LT(MaxDistance(pressed(1), rest_), 2e-7);
  EXPECT_GT(MaxDistance(pressed(0.4), pressed(-0.4)), 2e-3);
}

TEST_F(DeltaMush, NothingToDoIsBitForBit) {
  EXPECT_EQ(Run({0, 0.5, 0, false}, posed_.view()), pose_);
  EXPECT_EQ(Run({10, 0, 0, false}, posed_.view()), pose_);
  EXPECT_EQ(Run({10, 0.5, 0, false}, posed_.view(), {0, 1, {3, 4, 5}}), pose_);
}

TEST_F(DeltaMush, CommutesWithRigidMotion) {
  const Matrix4 motion = ComposeTrs({1, -2, 0.5}, Random(1).Rotation(), {1, 1, 1});
  Points moved;
  for (Double3 p : pose_) moved.push_back(TransformPoint(motion, p));
  Points expected = Run({}, posed_.view());
  for (Double3& p : expected) p = TransformPoint(motion, p);
  EXPECT_LT(MaxDistance(Run({}, ToFloat(moved).view()), expected), 5e-6);
}

TEST_F(DeltaMush, KeepsTheShapeAThousandMetresAway) {
  // The input is off by half the spacing of float there (3e-5 an axis), the output by as much again; the
  // frames turn with the noise of the ring's edges. Without a pivot every iteration rounds once more.
  Points moved, expected = Run({}, posed_.view());
  for (Double3 p : pose_) moved.push_back(p + Double3{1000, 1000, 1000});
  for (Double3& p : expected) p = p + Double3{1000, 1000, 1000};
  const double with_pivot = MaxDistance(Run({}, ToFloat(moved).view(), {1, 1, {1000, 1000, 1000}}), expected);
  const double without = MaxDistance(Run({}, ToFloat(moved).view()), expected);
  EXPECT_LT(with_pivot, 1.5e-4);
  EXPECT_LT(without, 6e-4);
  EXPECT_LT(with_pivot, without);
}

TEST_F(DeltaMush, PinnedBordersStay) {
  const Points out = Run({10, 0.5, 0, true}, posed_.view());
  std::size_t borders = 0;
  for (Index p = 0; p < out.size(); ++p) {
    if (!mesh_.topology.is_border(p)) continue;
    ++borders;
    EXPECT_EQ(out[p], pose_[p]);
  }
  EXPECT_EQ(borders, 2 * (23 + 19) - 4u);
}

TEST_F(DeltaMush, DegenerateRingsStayFinite) {
  // A strip that is a line, a loose triangle, a point without triangles; and a pose that collapses everything
  const std::vector<Index> triangles = {0, 1, 2, 1, 2, 3, 4, 5, 6};
  const Result<Topology> topology = Topology::Build(8, triangles);
  ASSERT_TRUE(topology.ok());
  const Points rest = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0},
                       {0, 1, 0}, {1, 1, 0}, {0, 2, 0}, {5, 5, 5}};
  const PointBuffer rest_points = ToFloat(rest);
  const std::vector<Index> all = AllPoints(8);
  const DeltaMushKernel kernel(*topology, rest_points.view(), {}, all, all);
  PointBuffer out(8);
  AlignedFloats scratch(kernel.ScratchFloats());
  kernel.Run({}, rest_points.view(), out.view(), scratch.span());
  EXPECT_LT(MaxDistance(ToDouble(out.view()), rest), 1e-6);
  const PointBuffer collapsed(8);
  kernel.Run({}, collapsed.view(), out.view(), scratch.span());
  for (Double3 p : ToDouble(out.view()))
    EXPECT_TRUE(std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z));
}

TEST_F(DeltaMush, ASubsetCostsItsRings) {
  const std::vector<Index> one = {200};
  const DeltaMushSettings settings{4, 0.5, 0, false};
  const std::vector<Index> demand = DeltaMushDemand(mesh_.topology, settings, one);
  EXPECT_EQ(demand, mesh_.topology.Dilate(one, 5));
  const DeltaMushKernel kernel(mesh_.topology, mesh_.rest.view(), settings, one, demand);
  std::size_t steps = 0;
  for (int ring = 4; ring >= 1; --ring) steps += mesh_.topology.Dilate(one, ring).size();
  EXPECT_EQ(kernel.SmoothingSteps(), steps);
  // A point of weight 0 needs itself only
  const float zero = 0;
  EXPECT_EQ(DeltaMushDemand(mesh_.topology, settings, one, {&zero, 1}), one);
}

TEST_F(DeltaMush, BadSettingsAreNamed) {
  EXPECT_TRUE((DeltaMushSettings{0, 0, 0, false}.Validate().ok()));
  EXPECT_FALSE((DeltaMushSettings{-1, 0.5, 0, false}.Validate().ok()));
  EXPECT_FALSE((DeltaMushSettings{1001, 0.5, 0, false}.Validate().ok()));
  EXPECT_FALSE((DeltaMushSettings{1, NAN, 0, false}.Validate().ok()));
  EXPECT_FALSE((DeltaMushSettings{1, 0.5, 1.5, false}.Validate().ok()));
}

TEST_F(DeltaMush, NormalsAgreeWithTheirTwin) {
  const NormalsKernel kernel(mesh_.topology, all_, all_);
  PointBuffer out(mesh_.count());
  AlignedFloats scratch(kernel.ScratchFloats());
  kernel.Run(posed_.view(), out.view(), scratch.span());
  Points expected(mesh_.count());
  const auto triangles = mesh_.topology.triangles();
  for (std::size_t t = 0; t < triangles.size(); t += 3) {
    const Double3 a = pose_[triangles[t]];
    const Double3 cross = Cross(pose_[triangles[t + 1]] - a, pose_[triangles[t + 2]] - a);
    for (std::size_t c = 0; c < 3; ++c) expected[triangles[t + c]] = expected[triangles[t + c]] + cross;
  }
  for (Double3& n : expected) n = n * (1 / Length(n));
  EXPECT_LT(MaxDistance(ToDouble(out.view()), expected), 1e-5);
  const PointBuffer collapsed(mesh_.count());
  kernel.Run(collapsed.view(), out.view(), scratch.span());
  for (Double3 n : ToDouble(out.view())) ASSERT_EQ(n, Double3());
}

}  // namespace
}  // namespace kpsa::engine
