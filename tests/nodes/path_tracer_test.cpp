#include "nodes/kernels/path_tracer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "base/scalar_math.h"

namespace kpsa::engine {
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
  PathTracer Tracer(const std::vector<DiffuseLight>& lights) const {
    Result<PathTracer> tracer =
        PathTracer::Build(PointBuffer::FromInterleaved(xyz).view(), corners, albedo, lights);
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
    for (int count : bins) EXPECT_EQ(count, 16) << dimension;
  }
  // Pairs of dimensions: one sample in each box of any shape that 64 samples fill once
  for (std::uint32_t pair : {0u, 5u, 70u}) {
    for (int wide : {1, 4, 8, 32}) {
      std::vector<int> boxes(64);
      for (std::uint32_t s = 0; s < 64; ++s) {
        const auto x = static_cast<int>(SampleNumber(7, s, 2 * pair) * wide),
                   y = static_cast<int>(SampleNumber(7, s, 2 * pair + 1) * 64 / wide);
        ++boxes[static_cast<std::size_t>(y * wide + x)];
      }
      EXPECT_EQ(boxes, std::vector<int>(64, 1)) << pair << ", " << wide;
    }
  }
  EXPECT_NE(SampleNumber(1, 0, 0), SampleNumber(2, 0, 0));
}

// A disk of radius r that faces the place, straight above: E = I / (d^2 + r^2).
TEST(PathTracer, ABallLightsLikeADiskAndNeverMoreThanItIsBright) {
  const auto above = [](double height, double radius) {
    const DiffuseLight ball{DiffuseLight::Kind::kBall,
                            Translation({0, height, 0}) * Scaling({radius, radius, radius}),
                            {2, 2, 2}};
    const PathTracer tracer = Floor().Tracer({ball});
    return tracer.Direct(tracer.Look({0, 5, 0}, {0, -1, 0}), 1, 1024).x;
  };
  EXPECT_NEAR(above(1.5, 0.5), 2 / (2.25 + 0.25), 1e-3);
  EXPECT_NEAR(above(2, 0), 0.5, 1e-6);
  EXPECT_LT(above(1e-3, 0.5), 2 * 2 / 0.25);
}

TEST(PathTracer, NoiseFallsAsTheSamplesRise) {
  Triangles t = Floor();
  t.AddQuad({-1, 0, -1}, {2, 0, 0}, {0, 2, 0}, 0.8f);
  t.AddQuad({-1, 0, -1}, {0, 0, 3}, {0, 2, 0}, 0.2f);
  const PathTracer tracer = t.Tracer({PointLight({0.3, 1.2, 0.6}, 3)});
  const ShadingPlace place = tracer.Look({0, 2, 0.2}, {0, -1, 0});
  const auto noise = [&](int samples) {  // deviation over seeds
    double sum = 0, squares = 0;
    for (std::uint32_t seed = 0; seed < 40; ++seed) {
      const double light = tracer.Indirect(place, {seed * 7919, samples, 2}).x;
      sum += light, squares += light * light;
    }
    return std::sqrt(squares / 40 - sum * sum / 1600);
  };
  EXPECT_LT(noise(64), 0.5 * noise(8));  // independent samples: 0.35
  const double mean = tracer.Indirect(place, {1, 4096, 2}).x;
  EXPECT_GT(mean, tracer.Indirect(place, {1, 4096, 2, 0.02}).x);
  EXPECT_LT(tracer.Indirect(place, {1, 4096, 1, 0.02}).x, 0.02 + 1e-12);
}

TEST(PathTracer, MovesWithoutAMemory) {
  Triangles t = Floor();
  t.AddQuad({-1, 0, -1}, {2, 0, 0}, {0, 2, 0}, 0.8f);
  t.AddQuad({-0.5, 0.4, 0}, {1, 0, 0}, {0, 0.3, 0}, 0.5f);
  const auto pose = [&](double turn) {
    PointBuffer points = PointBuffer::FromInterleaved(t.xyz);
    for (std::size_t i = 12; i < points.count(); ++i) {
      points.view().x[i] += static_cast<float>(0.3 * turn);
      points.view().y[i] += static_cast<float>(0.1 * turn * turn);
    }
    return points;
  };
  const auto light = [](double turn) { return PointLight({0.2 + turn, 1.5, 1}, 2); };
  const auto see = [](const PathTracer& tracer) {
    std::vector<double> seen;
    for (int i = 0; i < 200; ++i) {
      const ShadingPlace place = tracer.Look({0, 1, 3}, {0.005 * (i % 20) - 0.05, -0.01 * (i / 20.0), -1});
      for (double x : {place.position.x, tracer.Indirect(place, {5, 4, 2}).y, tracer.Direct(place, 1, 1).z})
        seen.push_back(x);
    }
    return seen;
  };
  PathTracer forward = t.Tracer({light(0)}), backward = t.Tracer({light(0)});
  std::vector<std::vector<double>> ahead, back(3);
  for (double turn : {0.3, 2.0, -1.0}) {
    const std::vector<DiffuseLight> lights{light(turn)};
    ASSERT_TRUE(forward.Update(pose(turn).view(), lights).ok());
    ahead.push_back(see(forward));
    // It is what it would be if it had been built so
    Result<PathTracer> fresh = PathTracer::Build(pose(turn).view(), t.corners, t.albedo, lights);
    const std::vector<double> built = see(*fresh);
    for (std::size_t i = 0; i < built.size(); ++i) EXPECT_NEAR(ahead.back()[i], built[i], 1e-5);
  }
  for (int i = 2; i >= 0; --i) {
    const double turn = i == 0 ? 0.3 : i == 1 ? 2.0 : -1.0;
    const std::vector<DiffuseLight> lights{light(turn)};
    ASSERT_TRUE(backward.Update(pose(turn).view(), lights).ok());
    back[static_cast<std::size_t>(i)] = see(backward);
  }
  EXPECT_EQ(ahead, back);
  EXPECT_NE(ahead[0], ahead[1]);
  PointBuffer broken = pose(0);
  broken.view().z[3] = NAN;
  EXPECT_FALSE(forward.Update(broken.view(), std::vector<DiffuseLight>{light(0)}).ok());
}

TEST(PathTracer, SeesThroughWhatIsUnseenAndStandsOnPoints) {
  Triangles t = Floor();
  t.AddQuad({-1, 1, 1}, {2, 0, 0}, {0, 0, -2},
            0.5f);  // a table above the floor, counter-clockwise from above
  const std::vector<std::uint8_t> unseen = {0, 0, 1, 1};
  Result<PathTracer> tracer =
      PathTracer::Build(PointBuffer::FromInterleaved(t.xyz).view(), t.corners, t.albedo,
                        std::vector<DiffuseLight>{PointLight({0, 3, 0}, 9)}, unseen);
  ASSERT_TRUE(tracer.ok());
  const ShadingPlace table = tracer->Look({0.1, 2, 0.2}, {0, -1, 0}),
                     floor = tracer->See({0.1, 2, 0.2}, {0, -1, 0});
  EXPECT_NEAR(table.position.y, 1, 1e-6);
  EXPECT_NEAR(floor.position.y, 0, 1e-6);
  EXPECT_LT(floor.triangle, 2u);
  EXPECT_EQ(tracer->Direct(floor, 0, 1).x, 0);  // in its shadow all the same
  const ShadingPlace corner = tracer->OnPoint(6);
  EXPECT_LT(Length(corner.position - Double3{-1, 1, 1}), 1e-6);
  EXPECT_NEAR(corner.normal.y, 1, 1e-9);
  EXPECT_NEAR(tracer->Direct(corner, 0, 1).x, 9.0 / 6 * 2 / std::sqrt(6.0), 1e-5);
}

// Many triangles about a point that lean out all around; a few of them belong to steep walls.
TEST(PathTracer, ManyTrianglesAboutAPointShareItsNormal) {
  const auto hub_normal = [](Index blades, Double3 direction) {
    std::vector<float> xyz = {0, 0, 0};
    std::vector<Index> corners;
    for (Index i = 0; i < blades; ++i) {
      const double angle = 2 * kPi * i / blades, height = i < blades / 2 ? 0.0 : 3.0;
      for (const double x : {Cos(angle), height, -Sin(angle)}) xyz.push_back(static_cast<float>(x));
      corners.insert(corners.end(), {0, 1 + i, 1 + (i + 1) % blades});
    }
    const Result<PathTracer> tracer =
        PathTracer::Build(PointBuffer::FromInterleaved(xyz).view(), corners,
                          std::vector<float>(corners.size(), 0.5f), std::vector<DiffuseLight>());
    EXPECT_TRUE(tracer.ok());
    const ShadingPlace place = tracer->Look(direction * 1e-2 + Double3{0, 1, 0}, {0, -1, 0});
    EXPECT_TRUE(place.hit);
    return place.normal;
  };
  // A crease keeps the flat half flat; where there are very many it is the mean of all, whichever is seen
  EXPECT_NEAR(hub_normal(40, {0, 0, -1}).y, 1, 1e-6);
  const Double3 flat = hub_normal(50000, {0, 0, -1});
  EXPECT_GT(flat.y, 0.2);
  EXPECT_LT(flat.y, 0.9);
}

// Two quads that meet at right angles, with corners of their own: hard, unless they share a normal.
TEST(PathTracer, NormalsAreSharedAsItIsSaid) {
  Triangles fold;
  fold.AddQuad({-1, 0, 0}, {0, 0, 1}, {1, 0, 0}, 0.5f);  // a floor, from x = -1 to 0
  fold.AddQuad({0, 0, 0}, {0, 0, 1}, {0, 1, 0}, 0.5f);   // a wall, at x = 0
  const auto points = PointBuffer::FromInterleaved(fold.xyz);
  const auto normal = [&](const std::vector<Index>& shares) {
    const Result<PathTracer> tracer =
        PathTracer::Build(points.view(), fold.corners, fold.albedo, {}, {}, shares);
    EXPECT_TRUE(tracer.ok()) << tracer.status().ToString();
    return tracer->Look({-1e-4, 0.5, 0.5}, {0, -1, 0}).normal;  // on the floor, at the edge
  };
  std::vector<Index> own(12), shared(12);
  for (Index c = 0; c < 12; ++c) {
    own[c] = c;
    shared[c] = fold.xyz[3 * c] == 0 && fold.xyz[3 * c + 1] == 0 ? 0 : 1 + c / 6;  // one along the edge
  }
  EXPECT_NEAR(normal({}).y, 1, 1e-9);
  EXPECT_NEAR(normal(own).y, 1, 1e-9);
  EXPECT_NEAR(normal(shared).y, std::sqrt(0.5), 1e-3);
  own[3] = 12;
  EXPECT_FALSE(PathTracer::Build(points.view(), fold.corners, fold.albedo, {}, {}, own).ok());
  EXPECT_FALSE(
      PathTracer::Build(points.view(), fold.corners, fold.albedo, {}, {}, std::vector<Index>(3)).ok());
}

TEST(PathTracer, RefusesWhatIsNoScene) {
  Triangles t = Floor();
  t.albedo.pop_back();
  EXPECT_FALSE(PathTracer::Build(PointBuffer::FromInterleaved(t.xyz).view(), t.corners, t.albedo, {}).ok());
  t.xyz[0] = NAN;
  EXPECT_FALSE(PathTracer::Build(PointBuffer::FromInterleaved(t.xyz).view(), t.corners, t.albedo, {}).ok());
}

}  // namespace
}  // namespace kpsa::engine
