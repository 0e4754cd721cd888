// tension: strain of known motions, and the push along the normals.
#include <gtest/gtest.h>

#include <cmath>

#include "nodes/kernels/tension.h"
#include "nodes/kernels/weights.h"
#include "tests/nodes/kernel_support.h"

namespace kpsa::engine {
namespace {

class Tension : public testing::Test {
 protected:
  Tension() : mesh_(MakeSheet(23, 19)), all_(AllPoints(mesh_.count())), rest_(ToDouble(mesh_.rest.view())) {
    Random random(31);
    for (std::size_t i = 0; i < mesh_.count(); ++i)
      mask_.push_back(i % 4 == 0 ? 0.0f : static_cast<float>(random.Unit()));
  }
  static PointBuffer Moved(const std::vector<Double3>& points, const Matrix4& m) {
    PointBuffer moved(points.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Double3 p = TransformPoint(m, points[i]);
      moved.view().x[i] = static_cast<float>(p.x);
      moved.view().y[i] = static_cast<float>(p.y);
      moved.view().z[i] = static_cast<float>(p.z);
    }
    return moved;
  }
  std::vector<float> Strain(ConstPointsView in, double growth = 1) const {
    std::vector<float> strain(mesh_.count());
    StrainKernel(mesh_.topology, mesh_.rest.view(), all_, all_).Run(growth, in, strain.data());
    return strain;
  }
  std::vector<Double3> Push(const TensionPushKernel::Inputs& inputs, ConstPointsView in,
                            std::span<const float> weights = {}) const {
    const TensionPushKernel kernel(mesh_.topology, mesh_.rest.view(), all_, all_, weights);
    PointBuffer out(mesh_.count());
    AlignedFloats scratch(kernel.ScratchFloats());
    kernel.Run(inputs, in, out.view(), scratch.span());
    return ToDouble(out.view());
  }
  TestMesh mesh_;
  std::vector<Index> all_;
  std::vector<Double3> rest_;
  std::vector<float> mask_;
};

TEST_F(Tension, TheRestShapeHasNoStrain) {
  for (float strain : Strain(mesh_.rest.view())) ASSERT_EQ(strain, 0.0f);
  EXPECT_EQ(Push({1, 0.1, 0.2, 1}, mesh_.rest.view()), rest_);
}

TEST_F(Tension, GrowthIsStrainUnlessItIsTheCharacters) {
  const PointBuffer larger = Moved(rest_, ComposeTrs({1, 2, 3}, Random(1).Rotation(), {1.5, 1.5, 1.5}));
  for (float strain : Strain(larger.view())) ASSERT_NEAR(strain, 0.5, 1e-4);
  for (float strain : Strain(larger.view(), 1.5)) ASSERT_NEAR(strain, 0, 1e-4);
}

TEST_F(Tension, AgreesWithItsTwin) {
  const PointBuffer posed = Moved(rest_, Scaling({0.4, 1.3, 1}));
  const std::vector<Double3> points = ToDouble(posed.view());
  const std::vector<float> strain = Strain(posed.view());
  std::vector<Double3> normals(mesh_.count()), expected;
  const auto triangles = mesh_.topology.triangles();
  for (std::size_t t = 0; t < triangles.size(); t += 3) {
    const Double3 a = points[triangles[t]];
    const Double3 cross = Cross(points[triangles[t + 1]] - a, points[triangles[t + 2]] - a);
    for (std::size_t c = 0; c < 3; ++c) normals[triangles[t + c]] = normals[triangles[t + c]] + cross;
  }
  std::size_t stretched = 0;
  for (Index p = 0; p < mesh_.count(); ++p) {
    double now = 0, rest = 0;
    for (Index q : mesh_.topology.neighbors().row(p))
      now += Length(points[q] - points[p]), rest += Length(rest_[q] - rest_[p]);
    EXPECT_NEAR(strain[p], now / rest - 1, 1e-6);
    stretched += now > rest;
    const double amount = now > rest ? -0.02 * (now / rest - 1) : 0.05 * (1 - now / rest);
    expected.push_back(points[p] + normals[p] * (0.8 * mask_[p] * amount / Length(normals[p])));
  }
  EXPECT_GT(stretched, 5u);
  EXPECT_LT(stretched, mesh_.count() - 5);
  const std::vector<Double3> pushed = Push({1, 0.05, -0.02, 0.8}, posed.view(), mask_);
  EXPECT_LT(MaxDistance(pushed, expected), 1e-6);
  for (std::size_t p = 0; p < mesh_.count(); p += 4) EXPECT_EQ(pushed[p], points[p]);
  EXPECT_EQ(Push({1, 0.05, -0.02, 0}, posed.view()), points);
  EXPECT_EQ(Push({1, 0, 0, 1}, posed.view()), points);
}

TEST_F(Tension, CommutesWithRigidMotion) {
  const PointBuffer posed = Moved(rest_, Scaling({0.4, 1.3, 1}));
  const Matrix4 motion = ComposeTrs({1, -2, 0.5}, Random(1).Rotation(), {1, 1, 1});
  std::vector<Double3> expected = Push({1, 0.05, 0.1, 1}, posed.view());
  for (Double3& p : expected) p = TransformPoint(motion, p);
  EXPECT_LT(MaxDistance(Push({1, 0.05, 0.1, 1}, Moved(ToDouble(posed.view()), motion).view()), expected),
            3e-6);
}

TEST_F(Tension, DegenerateRingsStay) {
  // Two points in one place, a loose one, and a pose that collapses everything
  const std::vector<Index> triangles = {0, 1, 2};
  const Result<Topology> topology = Topology::Build(4, triangles);
  ASSERT_TRUE(topology.ok());
  const std::vector<Double3> rest = {{1, 0, 0}, {1, 0, 0}, {1, 0, 0}, {5, 5, 5}};
  const PointBuffer points = Moved(rest, {}), collapsed(4);
  const std::vector<Index> all = AllPoints(4);
  const TensionPushKernel kernel(*topology, points.view(), all, all);
  PointBuffer out(4);
  AlignedFloats scratch(kernel.ScratchFloats());
  kernel.Run({1, 1, 1, 1}, points.view(), out.view(), scratch.span());
  EXPECT_EQ(ToDouble(out.view()), rest);
  kernel.Run({0, 1, 1, 1}, collapsed.view(), out.view(), scratch.span());
  EXPECT_EQ(ToDouble(out.view()), std::vector<Double3>(4));
  const std::vector<Double3> flat(mesh_.count());
  EXPECT_EQ(Push({1, 1, 1, 1}, Moved(flat, {}).view()), flat);  // no normals there
}

TEST_F(Tension, ASubsetCostsItsRing) {
  const std::vector<Index> one = {200};
  EXPECT_EQ(TensionDemand(mesh_.topology, one), mesh_.topology.Dilate(one, 1));
  const float zero = 0;
  EXPECT_EQ(TensionDemand(mesh_.topology, one, {&zero, 1}), one);
}

}  // namespace
}  // namespace kpsa::engine
