#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "nodes/kernels/falloff.h"
#include "nodes/kernels/topology.h"
#include "nodes/kernels/weights.h"
#include "tests/nodes/kernel_support.h"

namespace kpsa::engine {
namespace {

std::vector<Index> Vector(std::span<const Index> span) { return {span.begin(), span.end()}; }

TEST(Topology, TwoTrianglesAndALoosePoint) {
  // 0 - 1
  // | / |
  // 2 - 3    4
  const Index triangles[] = {0, 2, 1, 1, 2, 3};
  const Result<Topology> t = Topology::Build(5, triangles);
  ASSERT_TRUE(t.ok());
  EXPECT_EQ(Vector(t->neighbors().row(0)), (std::vector<Index>{1, 2}));
  EXPECT_EQ(Vector(t->neighbors().row(1)), (std::vector<Index>{0, 2, 3}));
  EXPECT_TRUE(t->neighbors().row(4).empty());
  EXPECT_EQ(Vector(t->point_triangles().row(2)), (std::vector<Index>{0, 1}));
  for (Index p : {0u, 1u, 2u, 3u}) EXPECT_TRUE(t->is_border(p));
  EXPECT_FALSE(t->is_border(4));
  Index components = 0;
  EXPECT_EQ(t->Components(&components), (std::vector<Index>{0, 0, 0, 0, 1}));
  EXPECT_EQ(components, 2u);
}

TEST(Topology, AClosedMeshHasNoBorder) {
  const Index tetrahedron[] = {0, 1, 2, 0, 2, 3, 0, 3, 1, 1, 3, 2};
  const Result<Topology> t = Topology::Build(4, tetrahedron);
  ASSERT_TRUE(t.ok());
  for (Index p = 0; p < 4; ++p) EXPECT_FALSE(t->is_border(p));
}

TEST(Topology, TrianglesThatWeldingMadeFlatConnectAndCountForNothingElse) {
  const Index triangles[] = {0, 1, 2, 1, 1, 3, 4, 4, 4};
  const Result<Topology> t = Topology::Build(5, triangles);
  ASSERT_TRUE(t.ok());
  EXPECT_EQ(t->triangle_count(), 3u);
  EXPECT_EQ(Vector(t->neighbors().row(3)), (std::vector<Index>{1}));
  EXPECT_FALSE(t->is_border(3));
  EXPECT_TRUE(t->point_triangles().row(3).empty());
  EXPECT_TRUE(t->neighbors().row(4).empty());
}

TEST(Topology, BadTrianglesAreNamed) {
  const Index short_list[] = {0, 1}, far_index[] = {0, 1, 2, 0, 1, 7};
  EXPECT_NE(Topology::Build(3, short_list).status().ToString().find("multiple of 3"), std::string::npos);
  EXPECT_NE(Topology::Build(3, far_index).status().ToString().find("triangle 1 names point 7"),
            std::string::npos);
  EXPECT_FALSE(Topology::Build(std::size_t{1} << 31, {}).ok());
  EXPECT_TRUE(Topology::Build(0, {}).ok());
}

TEST(Topology, DilationAgreesWithRingsOfSets) {
  const TestMesh mesh = MakeSheet(20, 17);
  Random random(1);
  for (int round = 0; round < 20; ++round) {
    std::vector<Index> points;
    for (int i = 0; i < 3; ++i) points.push_back(random.Below(mesh.count()));
    std::set<Index> grown(points.begin(), points.end());
    for (int rings = 0; rings < 6; ++rings) {
      std::vector<int> ring_of;
      const std::vector<Index> dilated = mesh.topology.Dilate(points, rings, &ring_of);
      EXPECT_EQ(dilated, std::vector<Index>(grown.begin(), grown.end()));
      EXPECT_EQ(dilated, mesh.topology.Dilate(points, rings));
      const std::vector<Index> inner = mesh.topology.Dilate(points, std::max(0, rings - 1));
      for (std::size_t i = 0; i < dilated.size(); ++i) {
        if (rings == 0) continue;
        EXPECT_EQ(ring_of[i] == rings, !std::binary_search(inner.begin(), inner.end(), dilated[i]));
      }
      std::set<Index> next = grown;
      for (Index p : grown)
        next.insert(mesh.topology.neighbors().row(p).begin(), mesh.topology.neighbors().row(p).end());
      grown = next;
    }
  }
}

TEST(Weights, MapsAreChecked) {
  const Index indices[] = {1, 3}, twice[] = {1, 1}, outside[] = {1, 4};
  const float values[] = {0.5f, 2.0f}, nan[] = {0.5f, NAN};
  const Result<std::vector<float>> weights = WeightsFromMap(4, indices, values, 0.25f);
  ASSERT_TRUE(weights.ok());
  EXPECT_EQ(*weights, (std::vector<float>{0.25f, 0.5f, 0.25f, 2.0f}));
  EXPECT_FALSE(WeightsFromMap(4, twice, values, 0).ok());
  EXPECT_FALSE(WeightsFromMap(4, outside, values, 0).ok());
  EXPECT_FALSE(WeightsFromMap(4, indices, nan, 0).ok());
  EXPECT_FALSE(WeightsFromMap(4, indices, std::span(values, 1), 0).ok());
  EXPECT_FALSE(WeightsFromMap(4, indices, values, INFINITY).ok());
}

TEST(Weights, SetsAndProducts) {
  EXPECT_TRUE(IsSortedSet(std::vector<Index>{0, 4}, 5));
  EXPECT_FALSE(IsSortedSet(std::vector<Index>{0, 4}, 4));
  EXPECT_FALSE(IsSortedSet(std::vector<Index>{1, 1}, 5));
  EXPECT_EQ(PositionsIn(std::vector<Index>{2, 3, 7, 9}, std::vector<Index>{3, 9}),
            (std::vector<Index>{1, 3}));
  EXPECT_EQ(MultiplyWeights(std::vector<float>{1, 2}, std::vector<float>{3, 4}), (std::vector<float>{3, 8}));
  EXPECT_EQ(MultiplyWeights({}, std::vector<float>{3, 4}), (std::vector<float>{3, 4}));
}

TEST(Falloff, EveryCurveFallsFromOneToNothing) {
  for (FalloffCurve curve : {FalloffCurve::kLinear, FalloffCurve::kSmooth, FalloffCurve::kSpline}) {
    const FalloffProfile profile{curve, {}};
    double last = 1;
    EXPECT_EQ(profile.Evaluate(0), 1);
    for (double t = 0; t < 1; t += 0.01) {
      EXPECT_LE(profile.Evaluate(t), last + 1e-15);
      last = profile.Evaluate(t);
    }
    EXPECT_EQ(profile.Evaluate(1), 0);
    EXPECT_EQ(profile.Evaluate(2), 0);
  }
  EXPECT_DOUBLE_EQ((FalloffProfile{FalloffCurve::kLinear, {}}.Evaluate(0.25)), 0.75);
  EXPECT_DOUBLE_EQ((FalloffProfile{FalloffCurve::kSmooth, {}}.Evaluate(0.5)), 0.5);
  EXPECT_EQ((FalloffProfile{FalloffCurve::kNone, {}}.Evaluate(1)), 1);
  const FalloffProfile ramp{FalloffCurve::kRamp, {{0.2, 1}, {0.4, 0.5}, {0.4, 0.25}, {0.9, 0}}};
  EXPECT_TRUE(ramp.Validate().ok());
  EXPECT_DOUBLE_EQ(ramp.Evaluate(0.1), 1);
  EXPECT_DOUBLE_EQ(ramp.Evaluate(0.3), 0.75);
  EXPECT_DOUBLE_EQ(ramp.Evaluate(0.65), 0.125);
  EXPECT_FALSE((FalloffProfile{FalloffCurve::kRamp, {}}.Validate().ok()));
  EXPECT_FALSE((FalloffProfile{FalloffCurve::kRamp, {{1, 0}, {0, 0}}}.Validate().ok()));
  EXPECT_FALSE((FalloffProfile{FalloffCurve::kRamp, {{NAN, 0}}}.Validate().ok()));
}

TEST(Falloff, RadialWeightsFollowTheDistance) {
  const PointBuffer points = PointBuffer::FromInterleaved(std::vector<float>{0, 0, 0, 1, 0, 0, 0, 0, 3});
  const Index which[] = {0, 1, 2};
  const std::vector<float> w = RadialFalloff(points.view(), which, {}, 2, {FalloffCurve::kLinear, {}});
  EXPECT_EQ(w, (std::vector<float>{1, 0.5f, 0}));
  EXPECT_EQ(RadialFalloff(points.view(), which, {}, 0, {}), (std::vector<float>{1, 0, 0}));
}

}  // namespace
}  // namespace kpsa::engine
