// shrinkWrap as a node, and its kernel against a search of all triangles.
#include "nodes/kernels/shrink_wrap.h"

#include <cmath>
#include <limits>

#include "base/triangle_tree.h"
#include "nodes/kernels/weights.h"
#include "tests/nodes/driver_rig.h"

namespace kpsa::engine {
namespace {

// A sphere of radius 1 about the origin, normals outward.
std::shared_ptr<const Mesh> Ball(Index around = 48, Index rings = 25) {
  std::vector<float> xyz;
  std::vector<Index> triangles;
  for (Index r = 0; r < rings; ++r) {
    const double polar = 3.14159265358979 * (r + 0.5) / rings;
    for (Index i = 0; i < around; ++i) {
      const double angle = 6.28318530717959 * i / around;
      for (double c : {std::sin(polar) * std::cos(angle), std::cos(polar), std::sin(polar) * std::sin(angle)})
        xyz.push_back(static_cast<float>(c));
      if (r + 1 == rings) continue;
      const Index a = r * around + i, b = r * around + (i + 1) % around, c = a + around, d = b + around;
      triangles.insert(triangles.end(), {a, b, d, a, d, c});
    }
  }
  for (double y : {1.0, -1.0}) {
    for (double c : {0.0, y, 0.0}) xyz.push_back(static_cast<float>(c));
  }
  const Index north = rings * around, last = (rings - 1) * around;
  for (Index i = 0; i < around; ++i) {
    triangles.insert(triangles.end(), {north, (i + 1) % around, i});
    triangles.insert(triangles.end(), {north + 1, last + i, last + (i + 1) % around});
  }
  return MeshOf(std::move(xyz), std::move(triangles));
}

std::shared_ptr<const Mesh> Scatter(std::size_t count, double size, std::uint32_t seed = 3) {
  Random random(seed);
  std::vector<float> xyz;
  for (std::size_t i = 0; i < count; ++i) {
    const Double3 p = random.Vector() * size;
    for (int a = 0; a < 3; ++a) xyz.push_back(static_cast<float>(p[a]));
  }
  return MeshOf(std::move(xyz), {0, 1, 2});
}

constexpr double kBallError = 0.006;  // of its facets

TEST(ShrinkWrap, PointsGoOntoATargetThatMoves) {
  DriverRig rig("shrinkWrap", Ball(), Scatter(200, 3));
  for (const Double3& center : {Double3{0, 0, 0}, Double3{2, -1, 0.5}, Double3{0, 0, 7}}) {
    const std::vector<Double3> points = rig.At(Translation(center)), rest = rig.Rest();
    for (std::size_t i = 0; i < points.size(); ++i) {
      EXPECT_NEAR(Length(points[i] - center), 1, kBallError);
      const Double3 away = (rest[i] - center) * (1 / Length(rest[i] - center));
      if (Length(rest[i] - center) > 1) {
        EXPECT_LT(Length(points[i] - (center + away)), 0.2);
      }
    }
  }
}

TEST(ShrinkWrap, SidesAndOffsets) {
  for (const double offset : {0.0, 0.25, -0.25}) {
    const auto lengths = [&](const char* side) {
      DriverRig rig("shrinkWrap", Ball(), Scatter(300, 1.2), {{"side", side}, {"offset", offset}});
      std::vector<std::pair<double, double>> from_to;
      const std::vector<Double3> rest = rig.Rest(), points = rig.At(Matrix4());
      for (std::size_t i = 0; i < rest.size(); ++i) from_to.emplace_back(Length(rest[i]), Length(points[i]));
      return from_to;
    };
    for (const auto& [from, to] : lengths("surface")) EXPECT_NEAR(to, 1 + offset, 2 * kBallError) << from;
    int stayed = 0, moved = 0;
    for (const auto& [from, to] : lengths("outside")) {
      EXPECT_NEAR(to, std::max(from, 1 + offset), 2 * kBallError);
      ++(to == from ? stayed : moved);
    }
    for (const auto& [from, to] : lengths("inside")) {
      EXPECT_NEAR(to, std::min(from, 1 + offset), 2 * kBallError);
      ++(to == from ? stayed : moved);
    }
    EXPECT_EQ(stayed, moved);  // what one side moves, the other one leaves alone
    EXPECT_GT(stayed, 100);
  }
}

TEST(ShrinkWrap, CornersKnowTheirSide) {
  // Nearest to the sharp tip of a thin wedge, faces alone would say inside to some of these places
  const auto wedge = MeshOf({0, 0, 0, -1, 0.05f, -1, -1, 0.05f, 1, -1, -0.05f, -1, -1, -0.05f, 1},
                            {0, 1, 2, 0, 4, 3, 0, 3, 1, 0, 2, 4, 1, 4, 2, 1, 3, 4});
  std::vector<float> xyz;
  for (int i = 0; i < 60; ++i) {
    const double angle = -1.2 + 2.4 * i / 59;
    for (double c : {0.3 * std::cos(angle), 0.3 * std::sin(angle), 0.01 * (i % 5)})
      xyz.push_back(static_cast<float>(c));
  }
  DriverRig rig("shrinkWrap", wedge, MeshOf(xyz, {0, 1, 2}), {{"side", "outside"}});
  EXPECT_EQ(MaxDistance(rig.At(Matrix4()), rig.Rest()), 0);
}

TEST(ShrinkWrap, AlongAnAxis) {
  const auto floor = GridMesh(5, 5, [](double, double) { return 2; });
  const auto points = MeshOf({0, 0, 0, 0.3f, 0.4f, 1, 0.5f, 0, 5, 3, 0, 0}, {0, 1, 2});
  const auto heights = [&](std::vector<std::pair<std::string, Value>> values) {
    values.emplace_back("projection", "parallelToAxis");
    values.emplace_back("axis", Double3{0, 0, 2});
    DriverRig rig("shrinkWrap", floor, points, values);
    std::vector<double> z;
    const std::vector<Double3> there = rig.At(Matrix4()), rest = rig.Rest();
    for (std::size_t i = 0; i < there.size(); ++i) {
      z.push_back(there[i].z);
      if (i < 3) {
        EXPECT_NEAR(std::hypot(there[i].x - rest[i].x, there[i].y - rest[i].y), 0, 1e-7);
      }
    }
    return z;
  };
  using V = std::vector<double>;
  EXPECT_EQ(heights({}), (V{2, 2, 5, 0}));  // the third is above the floor, the last one beside it
  EXPECT_EQ(heights({{"reverse", true}}), (V{0, 1, 2, 0}));
  EXPECT_EQ(heights({{"bidirectional", true}}), (V{2, 2, 2, 0}));
  EXPECT_EQ(heights({{"bidirectional", true}, {"closestIfNoIntersection", true}}), (V{2, 2, 2, 2}));
  EXPECT_EQ(heights({{"bidirectional", true}, {"offset", 0.5}}), (V{2.5, 2.5, 2.5, 0}));
  // The floor looks up: what is below it is inside
  EXPECT_EQ(heights({{"bidirectional", true}, {"side", "outside"}}), (V{2, 2, 5, 0}));
  EXPECT_EQ(heights({{"bidirectional", true}, {"side", "inside"}}), (V{0, 1, 2, 0}));
}

TEST(ShrinkWrap, AlongNormals) {
  // A smaller ball grows onto a larger one along its normals
  const auto small = [] {
    const auto ball = Ball(24, 13);
    std::vector<float> xyz = std::as_const(ball->data()).rest.Interleaved();
    for (float& f : xyz) f *= 0.5f;
    return MeshOf(xyz, ball->data().triangles);
  }();
  DriverRig rig("shrinkWrap", Ball(), small, {{"projection", "vertexNormals"}});
  const std::vector<Double3> rest = rig.Rest(), points = rig.At(Matrix4());
  for (std::size_t i = 0; i < rest.size(); ++i) {
    EXPECT_NEAR(Length(points[i]), 1, kBallError);
    EXPECT_LT(Length(points[i] - rest[i] * 2), 0.1);
  }
  // Where the target has gone away, lines miss and points stay
  int stayed = 0;
  const std::vector<Double3> away = rig.At(Translation({0, 0, 50}));
  for (std::size_t i = 0; i < rest.size(); ++i) stayed += away[i] == rest[i] ? 1 : 0;
  EXPECT_GT(stayed, static_cast<int>(rest.size()) - 10);
}

TEST(ShrinkWrap, EnvelopeAndWeights) {
  DriverRig half("shrinkWrap", Ball(), Scatter(50, 3), {{"envelope", 0.5}});
  DriverRig full("shrinkWrap", Ball(), Scatter(50, 3));
  DriverRig off("shrinkWrap", Ball(), Scatter(50, 3), {{"envelope", 0.0}});
  const std::vector<Double3> rest = full.Rest(), there = full.At(Matrix4()), middle = half.At(Matrix4());
  for (std::size_t i = 0; i < rest.size(); ++i)
    EXPECT_LT(Length(middle[i] - (rest[i] + there[i]) * 0.5), 1e-6);
  EXPECT_EQ(MaxDistance(off.At(Matrix4()), rest), 0);
}

TEST(ShrinkWrap, MovesWithTheTarget) {
  // Points and target turned together give turned results
  const Matrix4 motion = ComposeTrs({0.5, 2, -1}, Random(12).Rotation(), {1, 1, 1});
  const auto cloud = Scatter(100, 2);
  std::vector<float> turned = std::as_const(cloud->data()).rest.Interleaved();
  for (std::size_t i = 0; i < turned.size(); i += 3) {
    const Double3 p = TransformPoint(motion, {turned[i], turned[i + 1], turned[i + 2]});
    for (int a = 0; a < 3; ++a) turned[i + static_cast<std::size_t>(a)] = static_cast<float>(p[a]);
  }
  DriverRig plain("shrinkWrap", Ball(), cloud, {{"offset", 0.1}});
  DriverRig moved("shrinkWrap", Ball(), MeshOf(turned, {0, 1, 2}), {{"offset", 0.1}});
  std::vector<Double3> expected = plain.At(Matrix4());
  for (Double3& p : expected) p = TransformPoint(motion, p);
  EXPECT_LT(MaxDistance(moved.At(motion), expected), 2e-5);  // faces' edges are told apart by rounding
}

TEST(ShrinkWrap, SubsetsHaveTheBitsOfTheWhole) {
  for (const char* projection : {"closest", "vertexNormals", "parallelToAxis"}) {
    DriverRig rig("shrinkWrap", Ball(), Ball(20, 11), {{"projection", projection}, {"offset", 0.01}});
    EXPECT_EQ(rig.ExpectSubsetsKeepTheBits(9), rig.driver->point_count()) << projection;
  }
}

TEST(ShrinkWrap, TheNearestPlaceIsThatOfAllTriangles) {
  const auto ball = Ball(20, 11), cloud = Scatter(150, 2);
  const Result<Topology> target = Topology::Build(ball->point_count(), ball->data().triangles);
  const ConstPointsView rest = std::as_const(ball->data()).rest.view();
  const ConstPointsView in = std::as_const(cloud->data()).rest.view();
  const std::vector<Index> all = AllPoints(in.count);
  const ShrinkWrapKernel kernel({}, *target, MovingSurface(rest, target->triangles()), Matrix4(), Topology(),
                                all, all);
  // The target is bent far from the shape that the tree was built for
  PointBuffer bent(rest.count), out(in.count);
  for (std::size_t i = 0; i < rest.count; ++i) {
    bent.view().x[i] = rest.x[i] + 2 * rest.y[i] * rest.y[i];
    bent.view().y[i] = 3 * rest.y[i];
    bent.view().z[i] = rest.z[i] - rest.x[i];
  }
  AlignedFloats scratch(kernel.ScratchFloats());
  kernel.Run({1, 0, bent.view()}, in, out.view(), scratch.span());
  for (std::size_t i = 0; i < in.count; ++i) {
    SurfacePoint best;
    for (std::size_t t = 0; t < target->triangle_count(); ++t) {
      const SurfacePoint one =
          ClosestOnTriangle(bent.view(), &target->triangles()[3 * t], {in.x[i], in.y[i], in.z[i]});
      if (one.squared < best.squared) best = one;
    }
    EXPECT_NEAR(out.view().x[i], best.point.x, 1e-6);
    EXPECT_NEAR(out.view().y[i], best.point.y, 1e-6);
    EXPECT_NEAR(out.view().z[i], best.point.z, 1e-6);
  }
}

TEST(ShrinkWrap, TargetsThatAreNoNumbersLeavePointsAlone) {
  const auto ball = Ball(8, 5), cloud = Scatter(20, 2);
  const Result<Topology> target = Topology::Build(ball->point_count(), ball->data().triangles);
  const ConstPointsView rest = std::as_const(ball->data()).rest.view();
  const ConstPointsView in = std::as_const(cloud->data()).rest.view();
  const std::vector<Index> all = AllPoints(in.count);
  const ShrinkWrapKernel kernel({}, *target, MovingSurface(rest, target->triangles()), Matrix4(), Topology(),
                                all, all);
  PointBuffer none(rest.count), out(in.count);
  std::fill_n(none.view().x, rest.count, std::numeric_limits<float>::quiet_NaN());
  AlignedFloats scratch(kernel.ScratchFloats());
  kernel.Run({1, 0, none.view()}, in, out.view(), scratch.span());
  EXPECT_EQ(MaxDistance(ToDouble(out.view()), ToDouble(in)), 0);
}

}  // namespace
}  // namespace kpsa::engine
