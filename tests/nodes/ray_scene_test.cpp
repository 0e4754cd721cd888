#include "nodes/kernels/ray_scene.h"

#include <gtest/gtest.h>
#include <xmmintrin.h>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "base/parallel.h"

namespace kpsa::engine {
namespace {

struct Soup {
  std::vector<float> xyz;
  std::vector<Index> triangles;
  PointBuffer points() const { return PointBuffer::FromInterleaved(xyz); }
};

Soup RandomSoup(int triangles, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> place(-1, 1), extent(-0.3f, 0.3f);
  Soup soup;
  for (int t = 0; t < triangles; ++t) {
    const float center[3] = {place(random), place(random), place(random)};
    for (int corner = 0; corner < 3; ++corner) {
      for (float c : center) soup.xyz.push_back(c + extent(random));
      soup.triangles.push_back(static_cast<Index>(3 * t + corner));
    }
  }
  return soup;
}

std::vector<Ray> RandomRays(int count, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<float> normal;
  std::vector<Ray> rays(static_cast<std::size_t>(count));
  for (Ray& ray : rays) {
    for (float& x : ray.origin) x = normal(random);
    for (float& x : ray.direction) x = normal(random);
  }
  return rays;
}

// The naive twin: every triangle by Moeller and Trumbore's test, in double.
double NearestByHand(const Soup& soup, const Ray& ray, Index* triangle) {
  const Double3 o = {ray.origin[0], ray.origin[1], ray.origin[2]};
  const Double3 d = {ray.direction[0], ray.direction[1], ray.direction[2]};
  double nearest = std::numeric_limits<double>::infinity();
  *triangle = kNoIndex;
  for (std::size_t t = 0; t < soup.triangles.size(); t += 3) {
    const auto corner = [&](std::size_t k) {
      const std::size_t i = 3 * std::size_t{soup.triangles[t + k]};
      return Double3{soup.xyz[i], soup.xyz[i + 1], soup.xyz[i + 2]};
    };
    const Double3 a = corner(0), e1 = corner(1) - a, e2 = corner(2) - a, p = Cross(d, e2);
    const double det = Dot(e1, p);
    if (det == 0) continue;
    const Double3 s = o - a, q = Cross(s, e1);
    const double u = Dot(s, p) / det, v = Dot(d, q) / det, hit = Dot(e2, q) / det;
    if (u < 0 || v < 0 || u + v > 1 || hit < ray.near || hit > ray.far || hit >= nearest) continue;
    nearest = hit;
    *triangle = static_cast<Index>(t / 3);
  }
  return nearest;
}

TEST(RayScene, HitsAKnownTriangleAtAKnownPlace) {
  const PointBuffer points = PointBuffer::FromInterleaved(std::vector<float>{0, 0, 2, 4, 0, 2, 0, 4, 2});
  const std::vector<Index> triangle = {0, 1, 2};
  const auto scene = RayScene::Build(points.view(), triangle);
  ASSERT_TRUE(scene.ok());
  std::vector<Ray> rays(3);
  rays[0].origin[0] = 1, rays[0].origin[1] = 2;  // u = 1/4 along the first edge, v = 1/2
  rays[1].origin[0] = 3, rays[1].origin[1] = 3;  // beside it
  rays[2] = rays[0], rays[2].far = 1.9f;         // ends before it
  std::vector<RayHit> hits(3);
  scene->ClosestHits(rays, hits);
  EXPECT_EQ(hits[0].triangle, 0u);
  EXPECT_FLOAT_EQ(hits[0].t, 2);
  EXPECT_FLOAT_EQ(hits[0].u, 0.25f);
  EXPECT_FLOAT_EQ(hits[0].v, 0.5f);
  EXPECT_EQ(hits[1].triangle, kNoIndex);
  EXPECT_EQ(hits[2].triangle, kNoIndex);
  std::vector<std::uint8_t> occluded(3);
  scene->Occluded(rays, occluded);
  EXPECT_EQ(occluded, (std::vector<std::uint8_t>{1, 0, 0}));
}

TEST(RayScene, AgreesWithTryingEveryTriangle) {
  const Soup soup = RandomSoup(300, 1);
  const PointBuffer points = soup.points();
  const auto scene = RayScene::Build(points.view(), soup.triangles);
  ASSERT_TRUE(scene.ok());
  const std::vector<Ray> rays = RandomRays(2000, 2);
  std::vector<RayHit> hits(rays.size());
  std::vector<std::uint8_t> occluded(rays.size());
  scene->ClosestHits(rays, hits);
  scene->Occluded(rays, occluded);
  int found = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    Index triangle;
    const double t = NearestByHand(soup, rays[i], &triangle);
    EXPECT_EQ(hits[i].triangle, triangle) << "ray " << i;
    EXPECT_EQ(occluded[i] != 0, triangle != kNoIndex) << "ray " << i;
    if (triangle == kNoIndex || hits[i].triangle == kNoIndex) continue;
    ++found;
    EXPECT_NEAR(hits[i].t, t, 1e-4 * (1 + t)) << "ray " << i;
  }
  EXPECT_GT(found, 500);
  EXPECT_LT(found, 1900);
}

TEST(RayScene, GivesTheSameBitsForOneRayAndMany) {
  const Soup soup = RandomSoup(500, 3);
  const PointBuffer points = soup.points();
  const auto scene = RayScene::Build(points.view(), soup.triangles);
  const auto again = RayScene::Build(points.view(), soup.triangles);
  ASSERT_TRUE(scene.ok() && again.ok());
  const std::vector<Ray> rays = RandomRays(512, 4);
  std::vector<RayHit> together(rays.size()), alone(rays.size());
  scene->ClosestHits(rays, together);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    again->ClosestHits(std::span(&rays[i], 1), std::span(&alone[i], 1));
    EXPECT_EQ(together[i].triangle, alone[i].triangle);
    EXPECT_EQ(together[i].t, alone[i].t);
    EXPECT_EQ(together[i].u, alone[i].u);
    EXPECT_EQ(together[i].v, alone[i].v);
  }
}

TEST(RayScene, FollowsItsPointsWhateverTheyDidBefore) {
  const Soup rest = RandomSoup(400, 6);
  const std::vector<Ray> rays = RandomRays(600, 7);
  const auto moved = [&](unsigned seed) {  // every triangle by itself, far
    Soup soup = rest;
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> shift(-0.8f, 0.8f);
    for (std::size_t t = 0; t < soup.xyz.size(); t += 9) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const float by = shift(random);
        for (std::size_t corner = 0; corner < 9; corner += 3) soup.xyz[t + corner + axis] += by;
      }
    }
    return soup;
  };
  const auto make = [&] { return RayScene::Build(rest.points().view(), rest.triangles); };
  auto forward = make(), backward = make();
  const auto hits = [&](RayScene& scene, unsigned seed) {
    EXPECT_TRUE(scene.Update(moved(seed).points().view()).ok());
    std::vector<RayHit> found(rays.size());
    scene.ClosestHits(rays, found);
    return found;
  };
  const auto a1 = hits(*forward, 1), a2 = hits(*forward, 2), b2 = hits(*backward, 2), b1 = hits(*backward, 1);
  int different = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    for (const auto& [a, b] : {std::pair(a1[i], b1[i]), {a2[i], b2[i]}}) {
      EXPECT_EQ(a.triangle, b.triangle);
      EXPECT_EQ(a.t, b.t);
      EXPECT_EQ(a.u, b.u);
      EXPECT_EQ(a.v, b.v);
    }
    Index triangle;
    NearestByHand(moved(2), rays[i], &triangle);
    EXPECT_EQ(a2[i].triangle, triangle) << "ray " << i;
    different += a1[i].triangle != a2[i].triangle;
  }
  EXPECT_GT(different, 100);
  PointBuffer broken = rest.points();
  broken.view().x[5] = std::numeric_limits<float>::infinity();
  EXPECT_NE(forward->Update(broken.view()).ToString().find("point 5 is not finite"), std::string::npos);
}

TEST(RayScene, RaysThroughSharedEdgesNeverSlipThrough) {
  Soup sheet;  // a grid in the plane z = 0
  constexpr int kSide = 17;
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x)
      sheet.xyz.insert(sheet.xyz.end(), {x * 0.1f, y * 0.1f, 0.01f * ((x * 7 + y * 3) % 5)});
  }
  for (Index y = 0; y + 1 < kSide; ++y) {
    for (Index x = 0; x + 1 < kSide; ++x) {
      const Index a = y * kSide + x;
      sheet.triangles.insert(sheet.triangles.end(), {a, a + 1, a + kSide + 1, a, a + kSide + 1, a + kSide});
    }
  }
  const PointBuffer points = sheet.points();
  const auto scene = RayScene::Build(points.view(), sheet.triangles);
  ASSERT_TRUE(scene.ok());
  std::vector<Ray> rays;
  for (int i = 1; i < 150; ++i) {
    for (int row = 1; row + 1 < kSide; ++row) {
      Ray ray;
      ray.origin[0] = 0.0107f * static_cast<float>(i), ray.origin[1] = 0.1f * static_cast<float>(row),
      ray.origin[2] = -3;
      if (ray.origin[0] > 1.59f) continue;
      rays.push_back(ray);
    }
  }
  std::vector<RayHit> hits(rays.size());
  scene->ClosestHits(rays, hits);
  for (const RayHit& hit : hits) EXPECT_NE(hit.triangle, kNoIndex);
}

TEST(RayScene, LeavesTheFloatingPointModeAlone) {
  const unsigned before = _mm_getcsr() & ~0x3fu;  // without the sticky flags
  const Soup soup = RandomSoup(50, 5);
  const PointBuffer points = soup.points();
  ASSERT_TRUE(RayScene::Build(points.view(), soup.triangles).ok());
  EXPECT_EQ(_mm_getcsr() & ~0x3fu, before);
}

TEST(RayScene, NothingIsHitInAnEmptyScene) {
  const auto scene = RayScene::Build({}, {});
  ASSERT_TRUE(scene.ok());
  const std::vector<Ray> rays(5);
  std::vector<RayHit> hits(5);
  scene->ClosestHits(rays, hits);
  for (const RayHit& hit : hits) EXPECT_EQ(hit.triangle, kNoIndex);
}

TEST(RayScene, SaysWhatIsWrongWithTheTriangles) {
  PointBuffer points(3);
  const std::vector<Index> two = {0, 1}, far = {0, 1, 3}, good = {0, 1, 2};
  EXPECT_NE(RayScene::Build(points.view(), two).status().ToString().find("multiple of 3"), std::string::npos);
  EXPECT_NE(RayScene::Build(points.view(), far).status().ToString().find("point 3"), std::string::npos);
  points.view().y[1] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_NE(RayScene::Build(points.view(), good).status().ToString().find("point 1 is not finite"),
            std::string::npos);
}

}  // namespace
}  // namespace kpsa::engine
