// deltaMush and normals against plain loops in double, and the identities that define them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "nodes/kernels/delta_mush.h"
#include "nodes/kernels/normals.h"
#include "nodes/kernels/weights.h"
#include "tests/nodes/kernel_support.h"

namespace kpsa::engine {
namespace {

using Points = std::vector<Double3>;

PointBuffer ToFloat(const Points& points) {
  PointBuffer buffer(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    buffer.view().x[i] = static_cast<float>(points[i].x);
    buffer.view().y[i] = static_cast<float>(points[i].y);
    buffer.view().z[i] = static_cast<float>(points[i].z);
  }
  return buffer;
}

bool Pinned(const Topology& topology, const DeltaMushSettings& settings, Index p) {
  return topology.neighbors().row(p).size() < 2 || (settings.pin_borders && topology.is_border(p));
}

Points SmoothTwin(const Topology& topology, const DeltaMushSettings& settings, const Points& rest,
                  Points points) {
  for (int iteration = 0; iteration < settings.iterations; ++iteration) {
    Points next = points;
    for (Index p = 0; p < points.size(); ++p) {
      if (Pinned(topology, settings, p)) continue;
      const auto ring = topology.neighbors().row(p);
      double inverse_lengths = 0;
      for (Index q : ring) inverse_lengths += 1 / Length(rest[q] - rest[p]);
      Double3 mean;
      for (Index q : ring) {
        const double by_length = 1 / Length(rest[q] - rest[p]) / inverse_lengths;
        mean = mean + points[q] * ((1 - settings.distance_weight) / static_cast<double>(ring.size()) +
                                   settings.distance_weight * by_length);
      }
      next[p] = points[p] * (1 - settings.step) + mean * settings.step;
    }
    points = next;
  }
  return points;
}

// The rotation nearest to m: Newton's iteration of the polar decomposition.
Matrix4 Polar(Matrix4 m) {
  for (int step = 0; step < 60; ++step) {
    const Matrix4 inverse = InverseOrIdentity(m);
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) m(r, c) = 0.5 * (m(r, c) + inverse(c, r));
    }
  }
  return m;
}

// How the ring around p turned from `rest` to `now`: the least-squares map of its plane, made a rotation. The
// plane is found by inverse iteration, its normal being the direction of least spread.
Matrix4 RingRotation(const Topology& topology, const Points& rest, const Points& now, Index p) {
  const auto ring = topology.neighbors().row(p);
  Matrix4 spread, map;
  for (int i = 0; i < 3; ++i) spread(i, i) = map(i, i) = 0;
  for (Index q : ring) {
    const Double3 a = rest[q] - rest[p], b = now[q] - now[p];
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) spread(r, c) += a[r] * a[c], map(r, c) += b[r] * a[c];
    }
  }
  Matrix4 shifted = spread;
  const double size = spread(0, 0) + spread(1, 1) + spread(2, 2);
  for (int i = 0; i < 3; ++i) shifted(i, i) += 1e-9 * size;
  const Matrix4 inverse = InverseOrIdentity(shifted);
  Double3 normal{0.3, 0.5, 0.8};
  for (int step = 0; step < 200; ++step) {
    normal = TransformVector(inverse, normal);
    normal = normal * (1 / Length(normal));
  }
  // Fill the missing direction: spread along the normal is replaced, so that the map takes normal to new
  // normal
  Matrix4 filled = spread;
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c)
      filled(r, c) -= Dot(normal, TransformVector(spread, normal)) * normal[r] * normal[c];
  }
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) filled(r, c) += size * normal[r] * normal[c];
  }
  // map on the plane: (sum b a^T) (filled)^-1; images of two directions of the plane give the new normal
  const Matrix4 plane = map * InverseOrIdentity(filled);
  const Double3 u = Cross(normal, std::fabs(normal.x) < 0.7 ? Double3{1, 0, 0} : Double3{0, 1, 0});
  const Double3 v = Cross(normal, u);
  const Double3 t = TransformVector(plane, u) * (1 / Length(u)),
                b = TransformVector(plane, v) * (1 / Length(v));
  const Double3 n = Cross(t, b) * (1 / Length(Cross(t, b)));
  const Double3 from[3] = {u * (1 / Length(u)), v * (1 / Length(v)), normal}, to[3] = {t, b, n};
  Matrix4 turn;
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) {
      turn(r, c) = 0;
      for (int k = 0; k < 3; ++k) turn(r, c) += to[k][r] * from[k][c];
    }
  }
  return Polar(turn);
}

Points MushTwin(const Topology& topology, const DeltaMushSettings& settings, const Points& rest,
                const Points& points, double envelope, double displacement) {
  const Points rest_smooth = SmoothTwin(topology, settings, rest, rest),
               smooth = SmoothTwin(topology, settings, rest, points);
  Points result = points;
  for (Index p = 0; p < points.size(); ++p) {
    if (Pinned(topology, settings, p)) continue;
    const Double3 detail =
        TransformVector(RingRotation(topology, rest_smooth, smooth, p), rest[p] - rest_smooth[p]);
    result[p] = points[p] * (1 - envelope) + (smooth[p] + detail * displacement) * envelope;
  }
  return result;
}

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
