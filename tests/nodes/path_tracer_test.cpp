#include "nodes/kernels/path_tracer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "base/scalar_math.h"

namespace kpsa {
namespace {

struct Triangles {
  std::vector<float> xyz, albedo;
  std::vector<Index> corners;

  void Add(Double3 a, Double3 b, Double3 c, float reflectance) {
    for (const Double3& p : {a, b, c}) {
      corners.push_back(static_cast<Index>(corners.size()));
      for (int i = 0; i < 3; ++i) xyz.push_back(static_cast<float>(p[i]));
      albedo.push_back(reflectance);
    }
  }
  void AddQuad(Double3 corner, Double3 u, Double3 v, float reflectance) {
    Add(corner, corner + u, corner + u + v, reflectance);
    Add(corner, corner + u + v, corner + v, reflectance);
  }
  PathTracer Tracer(std::vector<DiffuseLight> lights) const {
    Result<PathTracer> tracer =
        PathTracer::Build(PointBuffer::FromInterleaved(xyz).view(), corners, albedo, std::move(lights));
    EXPECT_TRUE(tracer.ok()) << tracer.status().ToString();
    return std::move(*tracer);
  }
};

DiffuseLight PointLight(Double3 at, double intensity) {
  return {DiffuseLight::Kind::kPoint, Translation(at), {intensity, intensity, intensity}};
}
// Light towards `axis`: its -z.
Matrix4 Towards(Double3 axis) {
  const Double3 z = axis * (-1 / Length(axis)),
                helper = std::fabs(z.y) < 0.9 ? Double3{0, 1, 0} : Double3{1, 0, 0};
  const Double3 x = Cross(helper, z) * (1 / Length(Cross(helper, z))), y = Cross(z, x);
  Matrix4 m;
  for (int r = 0; r < 3; ++r) m(r, 0) = x[r], m(r, 1) = y[r], m(r, 2) = z[r];
  return m;
}

Triangles Floor() {
  Triangles t;
  t.AddQuad({-5, 0, 5}, {10, 0, 0}, {0, 0, -10}, 0.5f);
  return t;
}

TEST(PathTracer, DirectLightFollowsTheCosineAndTheDistance) {
  const Double3 eye = {0, 3, 0};
  {
    const PathTracer tracer = Floor().Tracer({PointLight({3, 4, 0}, 50)});
    const ShadingPlace place = tracer.Look(eye, {0, -1, 0});
    ASSERT_TRUE(place.hit);
    EXPECT_NEAR(place.normal.y, 1, 1e-12);
    EXPECT_NEAR(tracer.Direct(place, 0, 1).x, 50.0 / 25 * 0.8, 1e-6);
    EXPECT_FALSE(tracer.Look(eye, {0, 1, 0}).hit);
    EXPECT_EQ(tracer.Direct(tracer.Look(eye, {0, 1, 0}), 0, 1).x, 0);
  }
  {
    const DiffuseLight sun{DiffuseLight::Kind::kSun, Towards({1, -1, 0}), {3, 2, 1}};
    const PathTracer open = Floor().Tracer({sun});
    EXPECT_NEAR(open.Direct(open.Look(eye, {0, -1, 0}), 0, 1).y, 2 * std::sqrt(0.5), 1e-9);
    // Seen from below, the lit side is the other one
    EXPECT_EQ(open.Direct(open.Look({0, -3, 0}, {0, 1, 0}), 0, 1).y, 0);
    Triangles shaded = Floor();
    shaded.AddQuad({-1.6, 1, -1}, {1, 0, 0}, {0, 0, 2}, 0.5f);  // where the sun comes from
    const PathTracer blocked = shaded.Tracer({sun});
    EXPECT_EQ(blocked.Direct(blocked.Look(eye, {0, -1, 0}), 0, 1).y, 0);
  }
}

// A square of radiance L straight above: E = pi L F, F of a quarter from (Howell, C-1): element to parallel
// rectangle.
double FormFactorAbove(double side, double height) {
  const double x = side / 2 / height, s = std::sqrt(1 + x * x);
  return 4 * 2 * (x / s * std::atan(x / s)) / (2 * kPi);
}

TEST(PathTracer, AreaLightsHaveTheirFormFactor) {
  Matrix4 frame = Translation({0, 2, 0}) * Towards({0, -1, 0}) * Scaling({1.5, 1.5, 1});
  const PathTracer tracer = Floor().Tracer({{DiffuseLight::Kind::kArea, frame, {7, 7, 7}}});
  const ShadingPlace place = tracer.Look({0, 1, 0}, {0, -1, 0});
  EXPECT_NEAR(tracer.Direct(place, 3, 4096).x, kPi * 7 * FormFactorAbove(1.5, 2), 0.02);
  // It shines to one side only
  frame = Translation({0, 2, 0}) * Towards({0, 1, 0}) * Scaling({1.5, 1.5, 1});
  const PathTracer away = Floor().Tracer({{DiffuseLight::Kind::kArea, frame, {7, 7, 7}}});
  EXPECT_EQ(away.Direct(away.Look({0, 1, 0}, {0, -1, 0}), 3, 64).x, 0);
}

// A ceiling that the sun lights from below gives the floor E = albedo E_sun F.
TEST(PathTracer, OneBounceHasTheFormFactorOfWhatItComesFrom) {
  Triangles t;
  t.Add({-0.01, 0, -0.01}, {-0.01, 0, 0.01}, {0.01, 0, 0}, 0.5f);
  t.AddQuad({-1, 1.5, -1}, {2, 0, 0}, {0, 0, 2}, 0.6f);
  const PathTracer tracer = t.Tracer({{DiffuseLight::Kind::kSun, Towards({0, 1, 0}), {4, 4, 4}}});
  const ShadingPlace place = tracer.Look({0, 0.5, 0}, {0, -1, 0});
  ASSERT_TRUE(place.hit);
  EXPECT_EQ(tracer.Direct(place, 0, 1).x, 0);
  const double shadow = 0.02 * 0.02 / 2 / 4;  // of the small triangle, on the ceiling
  EXPECT_NEAR(tracer.Indirect(place, {1, 8192, 1}).x, 0.6 * 4 * FormFactorAbove(2, 1.5) * (1 - shadow), 0.01);
  EXPECT_NEAR(tracer.Indirect(place, {1, 8192, 2}).x, tracer.Indirect(place, {1, 8192, 1}).x, 0.01);
}

// Inside a sphere with a light in its middle every bounce adds the same everywhere: E (a + a^2 + ...).
TEST(PathTracer, BouncesInASphereAddUpGeometrically) {
  Triangles sphere;
  constexpr int kRows = 24, kAround = 48;
  const auto at = [&](int row, int k) {
    const double theta = kPi * row / kRows, phi = 2 * kPi * k / kAround;
    return Double3{Sin(theta) * Cos(phi), Cos(theta), Sin(theta) * Sin(phi)};
  };
  for (int row = 0; row < kRows; ++row) {
    for (int k = 0; k < kAround; ++k) {
      if (row > 0) sphere.Add(at(row, k), at(row, k + 1), at(row + 1, k), 0.7f);
      if (row + 1 < kRows) sphere.Add(at(row, k + 1), at(row + 1, k + 1), at(row + 1, k), 0.7f);
    }
  }
  const PathTracer tracer = sphere.Tracer({PointLight({}, 1)});
  const ShadingPlace place = tracer.Look({}, {0.3, 0.2, 0.7});
  ASSERT_TRUE(place.hit);
  EXPECT_NEAR(tracer.Direct(place, 0, 1).x, 1, 0.02);
  double expected = 0, power = 1;
  for (int bounces = 1; bounces <= 4; ++bounces) {
    expected += power *= 0.7;
    EXPECT_NEAR(tracer.Indirect(place, {5, 1024, bounces}).x, expected, 0.02 * expected) << bounces;
  }
}

TEST(PathTracer, SamplesAreEven) {
  for (std::uint32_t dimension : {0u, 1u, 2u, 3u, 7u}) {
    std::vector<int> bins(16);
    for (std::uint32_t s = 0; s < 256; ++s) {
      const double x = SampleNumber(99, s, dimension);
      ASSERT_GE(x, 0);
      ASSERT_LT(x, 1);
      ++bins[static_cast<std::size_t>(x * 16)];
    }
    for (int count : bins) EXPECT_NEAR(count, 16, dimension < 2 ? 3 : 16) << dimension;
  }
  EXPECT_NE(SampleNumber(1, 0, 0), SampleNumber(2, 0, 0));
}

TEST(PathTracer, RefusesWhatIsNoScene) {
  Triangles t = Floor();
  t.albedo.pop_back();
  EXPECT_FALSE(PathTracer::Build(PointBuffer::FromInterleaved(t.xyz).view(), t.corners, t.albedo, {}).ok());
  t.xyz[0] = NAN;
  EXPECT_FALSE(PathTracer::Build(PointBuffer::FromInterleaved(t.xyz).view(), t.corners, t.albedo, {}).ok());
}

}  // namespace
}  // namespace kpsa
