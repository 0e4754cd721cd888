#include "base/triangle_tree.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <utility>
#include <vector>

#include "tests/support/instruction_count.h"

namespace kpsa::engine {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct Soup {
  PointBuffer points;
  std::vector<Index> triangles;
  TriangleTree tree;

  Soup(std::vector<float> xyz, std::vector<Index> corners)
      : points(PointBuffer::FromInterleaved(xyz)), triangles(std::move(corners)), tree(view(), triangles) {}
  ConstPointsView view() const { return points.view(); }
  void Move() { tree.Move(view()); }
  SurfacePoint Closest(Double3 p, double max_distance = kInfinity) const {
    return tree.Closest(p, max_distance);
  }
};

class Places {
 public:
  explicit Places(unsigned seed) : engine_(seed) {}
  double Signed() { return 2 * (static_cast<double>(engine_()) / 4294967296.0) - 1; }
  Double3 Vector() { return {Signed(), Signed(), Signed()}; }

 private:
  std::mt19937 engine_;
};

// Triangles of all sizes; some without area, some that share corners, some twice.
Soup RandomSoup(std::size_t count, unsigned seed) {
  Places random(seed);
  std::vector<float> xyz;
  std::vector<Index> triangles;
  for (std::size_t t = 0; t < count; ++t) {
    const Double3 center = random.Vector();
    const double size = t % 9 == 0 ? 1 : 0.1;
    for (int k = 0; k < 3; ++k) {
      const Double3 p = t % 13 == 0 ? center : center + random.Vector() * size;
      for (int a = 0; a < 3; ++a) xyz.push_back(static_cast<float>(p[a]));
      const auto i = static_cast<Index>(3 * t) + static_cast<Index>(k);
      triangles.push_back(t % 5 == 4 ? i - 3 : i);  // every fifth triangle is there a second time
    }
  }
  return {std::move(xyz), std::move(triangles)};
}

SurfacePoint ByHand(const Soup& soup, Double3 p) {
  SurfacePoint best;
  for (Index t = 0; t < soup.triangles.size() / 3; ++t) {
    SurfacePoint one = ClosestOnTriangle(soup.view(), &soup.triangles[3 * std::size_t{t}], p);
    one.triangle = t;
    if (one.squared < best.squared) best = one;
  }
  return best;
}

TEST(ClosestOnTriangle, KnowsFaceEdgeAndCorner) {
  const PointBuffer points = PointBuffer::FromInterleaved(std::vector<float>{0, 0, 0, 4, 0, 0, 0, 4, 0});
  const Index corners[3] = {0, 1, 2};
  const SurfacePoint face = ClosestOnTriangle(points.view(), corners, {1, 2, 3});
  EXPECT_EQ(face.point, (Double3{1, 2, 0}));
  EXPECT_DOUBLE_EQ(face.squared, 9);
  EXPECT_DOUBLE_EQ(face.weights[0], 0.25);
  EXPECT_DOUBLE_EQ(face.weights[1], 0.25);
  EXPECT_DOUBLE_EQ(face.weights[2], 0.5);
  const SurfacePoint edge = ClosestOnTriangle(points.view(), corners, {3, -2, 0});
  EXPECT_EQ(edge.point, (Double3{3, 0, 0}));
  EXPECT_DOUBLE_EQ(edge.weights[1], 0.75);
  EXPECT_EQ(edge.weights[2], 0);
  const SurfacePoint corner = ClosestOnTriangle(points.view(), corners, {-3, 9, 1});
  EXPECT_EQ(corner.point, (Double3{0, 4, 0}));
  EXPECT_EQ(corner.weights[2], 1);
}

TEST(ClosestOnTriangle, NoPlaceOfTheTriangleIsNearer) {
  Places random(3);
  for (int round = 0; round < 50; ++round) {
    const Soup soup = RandomSoup(2, static_cast<unsigned>(100 + round));
    const Double3 p = random.Vector();
    const Index* corners = &soup.triangles[3];
    const SurfacePoint found = ClosestOnTriangle(soup.view(), corners, p);
    Double3 mean;
    double sum = 0;
    for (int k = 0; k < 3; ++k) {
      const Index i = corners[k];
      mean = mean + Double3{soup.view().x[i], soup.view().y[i], soup.view().z[i]} * found.weights[k];
      sum += found.weights[k];
      EXPECT_GE(found.weights[k], 0);
    }
    EXPECT_NEAR(sum, 1, 1e-12);
    EXPECT_LT(Length(mean - found.point), 1e-12);
    EXPECT_NEAR(found.squared, Dot(p - found.point, p - found.point), 1e-14);
    for (int i = 0; i <= 20; ++i) {
      for (int j = 0; i + j <= 20; ++j) {
        const double w[3] = {i / 20.0, j / 20.0, (20 - i - j) / 20.0};
        Double3 q;
        for (int k = 0; k < 3; ++k) {
          const Index c = corners[k];
          q = q + Double3{soup.view().x[c], soup.view().y[c], soup.view().z[c]} * w[k];
        }
        EXPECT_GE(Dot(p - q, p - q), found.squared - 1e-12);
      }
    }
  }
}

TEST(TriangleTree, FindsWhatAllTrianglesGive) {
  for (const std::size_t count : {1ul, 4ul, 5ul, 333ul}) {
    const Soup soup = RandomSoup(count, 7);
    Places random(8);
    for (int i = 0; i < 500; ++i) {
      const Double3 p = random.Vector() * (i % 10 == 0 ? 30 : 1.2);
      const SurfacePoint expected = ByHand(soup, p), found = soup.Closest(p);
      ASSERT_EQ(found.triangle, expected.triangle) << i;
      EXPECT_EQ(found.squared, expected.squared);
      EXPECT_EQ(found.point, expected.point);
      // Wherever it begins
      for (const Index near : {expected.triangle, static_cast<Index>(i), static_cast<Index>(i % count)}) {
        const SurfacePoint same = soup.tree.Closest(p, kInfinity, near);
        EXPECT_EQ(same.triangle, expected.triangle) << near;
        EXPECT_EQ(same.point, expected.point) << near;
      }
      // A limit hides what is beyond it, and nothing else
      const double distance = std::sqrt(expected.squared);
      EXPECT_EQ(soup.Closest(p, distance * 1.001 + 1e-9).triangle, expected.triangle);
      if (distance > 1e-6) {
        EXPECT_EQ(soup.Closest(p, distance * 0.999).triangle, kNoIndex);
        EXPECT_EQ(soup.tree.Closest(p, distance * 0.999, expected.triangle).triangle, kNoIndex);
      }
    }
  }
}

TEST(TriangleTree, TiesGoToTheLowerTriangle) {
  // A fan around the origin: every place below it is nearest to the corner that all share
  std::vector<float> xyz = {0, 0, 0};
  std::vector<Index> triangles;
  constexpr Index kBlades = 40;
  for (Index i = 0; i < kBlades; ++i) {
    const double angle = 6.28318 * i / kBlades;
    for (double c : {std::cos(angle), std::sin(angle), 0.7}) xyz.push_back(static_cast<float>(c));
    triangles.insert(triangles.end(), {1 + i, 0, 1 + (i + 1) % kBlades});
  }
  const Soup soup(xyz, triangles);
  EXPECT_EQ(soup.Closest({0, 0, -1}).triangle, 0u);
  EXPECT_EQ(soup.Closest({0.01, -0.02, -3}).triangle, 0u);
  EXPECT_EQ(soup.tree.Closest({0, 0, -1}, kInfinity, 17).triangle, 0u) << "also where it begins elsewhere";
  // On the edge between the blades 20 and 21, from outside of the cone
  const SurfacePoint edge =
      soup.Closest({soup.view().x[22] * 0.5 * 1.7, soup.view().y[22] * 0.5 * 1.7, 0.35 - 0.5});
  EXPECT_EQ(edge.triangle, 20u);
}

// On edges, on corners, and beside them by less and less: which triangles are equally near rounding must not say.
TEST(TriangleTree, TiesOnTheSurfaceGoToTheLowerTriangle) {
  constexpr Index kSide = 12;
  Places random(7);
  std::vector<float> xyz;
  for (Index i = 0; i < kSide * kSide; ++i) {
    for (const double c :
         {i % kSide + 0.3 * random.Signed(), i / kSide + 0.3 * random.Signed(), 0.4 * random.Signed()})
      xyz.push_back(static_cast<float>(0.01 * c));
  }
  std::vector<Index> triangles;
  for (Index i = 0; i + 1 < kSide; ++i) {
    for (Index j = 0; j + 1 < kSide; ++j) {
      const Index a = i * kSide + j, b = a + 1, c = a + kSide, d = c + 1;
      triangles.insert(triangles.end(), {a, b, c, c, b, d});
    }
  }
  const Soup soup(xyz, triangles);
  for (Index t = 0; t < triangles.size() / 3; ++t) {
    const auto corner = [&](Index k) {
      const Index i = triangles[3 * t + k % 3];
      return Double3{soup.view().x[i], soup.view().y[i], soup.view().z[i]};
    };
    for (Index k = 0; k < 3; ++k) {
      const double share = k == 0 ? 0 : 0.5 + 0.4 * random.Signed();
      const Double3 at = corner(k) * (1 - share) + corner(k + 1) * share;
      for (const double away : {0.0, 1e-22, 1e-19, 1e-17, 1e-15, 1e-13, 1e-10}) {
        const Double3 place = at + random.Vector() * away;
        const SurfacePoint all = ByHand(soup, place);
        for (Index near = t < 30 ? 0 : t - 30; near < std::min<std::size_t>(t + 30, triangles.size() / 3);
             ++near) {
          const SurfacePoint found = soup.tree.Closest(place, kInfinity, near);
          ASSERT_EQ(found.triangle, all.triangle) << t << " " << k << " " << away << ", from " << near;
          ASSERT_EQ(found.squared, all.squared);
        }
      }
    }
  }
}

TEST(TriangleTree, RefittedBoxesFindMovedTriangles) {
  Soup soup = RandomSoup(200, 9);
  Places random(10);
  const PointsView view = soup.points.view();
  for (std::size_t i = 0; i < view.count; ++i) {
    view.x[i] = static_cast<float>(3 * random.Signed());
    view.y[i] += 5;
  }
  soup.Move();
  for (int i = 0; i < 200; ++i) {
    const Double3 p = random.Vector() * 4 + Double3{0, 5, 0};
    EXPECT_EQ(soup.Closest(p).triangle, ByHand(soup, p).triangle);
  }
}

TEST(TriangleTree, SeveralComeInOrder) {
  const Soup soup = RandomSoup(150, 11);
  Places random(12);
  std::vector<SurfacePoint> found;
  for (int i = 0; i < 100; ++i) {
    const Double3 p = random.Vector();
    std::vector<std::pair<double, Index>> all;
    for (Index t = 0; t < 150; ++t)
      all.emplace_back(ClosestOnTriangle(soup.view(), &soup.triangles[3 * std::size_t{t}], p).squared, t);
    std::sort(all.begin(), all.end());
    soup.tree.ClosestSeveral(p, 7, kInfinity, &found);
    ASSERT_EQ(found.size(), 7u);
    for (std::size_t k = 0; k < 7; ++k) EXPECT_EQ(found[k].triangle, all[k].second);
    soup.tree.ClosestSeveral(p, 200, std::sqrt(all[4].first) + 1e-9, &found);
    EXPECT_EQ(found.size(),
              static_cast<std::size_t>(std::count_if(all.begin(), all.end(), [&](const auto& a) {
                return a.first <= std::pow(std::sqrt(all[4].first) + 1e-9, 2);
              })));
  }
}

TEST(TriangleTree, LinesHitWhatAllTrianglesSay) {
  const Soup soup = RandomSoup(300, 13);
  Places random(14);
  int hits = 0;
  for (int i = 0; i < 1000; ++i) {
    const Double3 o = random.Vector() * 2, d = random.Vector();
    // By hand: the plane of each triangle, and on which side of its edges the line passes
    LineHit expected;
    for (Index t = 0; t < 300; ++t) {
      Double3 c[3];
      for (std::size_t k = 0; k < 3; ++k) {
        const Index p = soup.triangles[3 * std::size_t{t} + k];
        c[k] = {soup.view().x[p], soup.view().y[p], soup.view().z[p]};
      }
      const Double3 n = Cross(c[1] - c[0], c[2] - c[0]);
      if (Dot(n, d) == 0) continue;
      const double at = Dot(n, c[0] - o) / Dot(n, d);
      const Double3 p = o + d * at;
      bool inside = at >= 0 && at < expected.t;
      for (int k = 0; k < 3; ++k) inside = inside && Dot(n, Cross(c[(k + 1) % 3] - c[k], p - c[k])) >= 0;
      if (inside) expected.triangle = t, expected.t = at;
    }
    const LineHit found = soup.tree.FirstHit(o, d);
    if (expected.triangle == kNoIndex) {
      EXPECT_EQ(found.triangle, kNoIndex);
      continue;
    }
    ++hits;
    EXPECT_EQ(found.triangle, expected.triangle);
    EXPECT_NEAR(found.t, expected.t, 1e-9 * (1 + expected.t));
  }
  EXPECT_GT(hits, 100);
}

TEST(TriangleTree, LinesThroughEdgesHit) {
  // Two triangles of a square; lines through their diagonal and along the axes
  const Soup soup({0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0}, {0, 1, 2, 0, 2, 3});
  for (int i = 1; i < 100; ++i) {
    const double at = i / 100.0;
    const LineHit hit = soup.tree.FirstHit({at, at, 2}, {0, 0, -1});
    ASSERT_NE(hit.triangle, kNoIndex) << i;
    EXPECT_DOUBLE_EQ(hit.t, 2);
  }
  EXPECT_EQ(soup.tree.FirstHit({2, 0.5, 2}, {0, 0, -1}).triangle, kNoIndex);
  EXPECT_EQ(soup.tree.FirstHit({0.5, 0.5, 2}, {0, 0, 1}).triangle, kNoIndex);
  EXPECT_EQ(soup.tree.FirstHit({0.5, 0.5, 2}, {0, 0, 0}).triangle, kNoIndex);
}

TEST(TriangleTree, WhatIsNotFiniteTakesNoPart) {
  Soup soup = RandomSoup(50, 15);
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  for (std::size_t i = 0; i < 3 * 25; ++i) soup.points.view().y[i] = kNan;
  soup.Move();
  const SurfacePoint found = soup.Closest({0.1, 0.2, 0.3});
  ASSERT_NE(found.triangle, kNoIndex);
  EXPECT_GE(found.triangle, 25u);
  EXPECT_TRUE(std::isfinite(found.squared));
  EXPECT_EQ(soup.Closest({kNan, 0, 0}).triangle, kNoIndex);
  EXPECT_EQ(soup.Closest({kInfinity, 0, 0}).triangle, kNoIndex);
  EXPECT_EQ(soup.tree.FirstHit({kNan, 0, 0}, {0, 0, 1}).triangle, kNoIndex);
  // A tree over such points is one, too
  const Soup again({kNan, 0, 0, 1, kNan, 0, 0, 0, 0, 1, 1, 1, 2, 1, 1, 1, 2, 1}, {0, 1, 2, 3, 4, 5});
  EXPECT_EQ(again.Closest({0, 0, 0}).triangle, 1u);
  EXPECT_EQ(again.tree.Lowest({0, 0, 0}, kInfinity).triangle, 1u);
  const Soup empty({0, 0, 0}, {});
  EXPECT_EQ(empty.Closest({0, 0, 0}).triangle, kNoIndex);
}

TEST(TriangleTree, LowestIsTheFirstWithinTheDistance) {
  const Soup soup = RandomSoup(333, 18);
  Places random(19);
  int several = 0;
  for (int i = 0; i < 500; ++i) {
    const Double3 p = random.Vector();
    const double distance = 0.3 * (1 + random.Signed());
    Index first = kNoIndex, within = 0;
    for (Index t = 333; t-- > 0;) {
      if (ClosestOnTriangle(soup.view(), &soup.triangles[3 * std::size_t{t}], p).squared >
          distance * distance)
        continue;
      first = t;
      ++within;
    }
    several += within > 1 ? 1 : 0;
    EXPECT_EQ(soup.tree.Lowest(p, distance).triangle, first) << i;
  }
  EXPECT_GT(several, 100);
}

TEST(TriangleTree, FindsTheSameAmongCornersThatAreNotFinite) {
  Soup soup = RandomSoup(300, 16);
  Places random(17);
  constexpr float kBroken[] = {std::numeric_limits<float>::infinity(),
                               -std::numeric_limits<float>::infinity(),
                               std::numeric_limits<float>::quiet_NaN(), 1e30f};
  const PointsView view = soup.points.view();
  for (std::size_t i = 0; i < view.count; i += 7) {
    float* const rows[3] = {view.x, view.y, view.z};
    rows[i % 3][i] = kBroken[i / 7 % 4];
  }
  soup.Move();
  for (int i = 0; i < 300; ++i) {
    const Double3 p = random.Vector() * 1.5;
    const SurfacePoint expected = ByHand(soup, p), found = soup.Closest(p);
    ASSERT_EQ(found.triangle, expected.triangle) << i;
    EXPECT_EQ(found.point, expected.point);
    EXPECT_TRUE(std::isfinite(Length(found.point)));
  }
}

// Of an edge that is left between two corners, whatever the third one is.
TEST(ClosestOnTriangle, TakesTheEdgeThatIsLeft) {
  const Index corners[3] = {0, 1, 2};
  for (const float bad : {std::numeric_limits<float>::infinity(), std::numeric_limits<float>::quiet_NaN()}) {
    const PointBuffer points = PointBuffer::FromInterleaved(std::vector<float>{0, 0, 0, 4, 1, 2, bad, 3, 1});
    const SurfacePoint found = ClosestOnTriangle(points.view(), corners, {1, 5, 3});
    EXPECT_LT(Length(found.point - Double3{4, 1, 2} * (15.0 / 21)), 1e-12) << bad;
  }
}

// A query looks at a few of many triangles, whatever one of them or the query is.
TEST(TriangleTree, LooksAtFewTriangles) {
  constexpr float kInf = std::numeric_limits<float>::infinity(),
                  kNan = std::numeric_limits<float>::quiet_NaN();
  constexpr Index kSide = 17;
  std::vector<float> xyz;
  std::vector<Index> triangles;
  for (Index i = 0; i < kSide * kSide; ++i) {
    const Index column = i % kSide, row = i / kSide;
    xyz.insert(xyz.end(), {static_cast<float>(column) / 8 - 1, static_cast<float>(row) / 8 - 1,
                           0.01f * static_cast<float>((7 * column + 5 * row) % 9)});
    if (column + 1 < kSide && row + 1 < kSide)
      triangles.insert(triangles.end(), {i, i + 1, i + kSide, i + 1, i + kSide + 1, i + kSide});
  }
  Soup soup(xyz, triangles);
  std::vector<SurfacePoint> found;
  found.reserve(8);
  enum Query { kClosest, kSeveral, kHit };
  constexpr std::uint64_t kOfWideBoxes = 4000;  // with AVX-512, a box that is wide shows eight more at once
  const auto count = [&](Query query, Double3 p, Double3 direction, double limit = kInfinity) {
    return CountInstructions([&] {
      if (query == kClosest) soup.tree.Closest(p, limit);
      if (query == kSeveral) soup.tree.ClosestSeveral(p, 4, limit, &found);
      if (query == kHit) soup.tree.FirstHit(p, direction);
    });
  };
  const Double3 place{0.11, 0.23, 0.1}, way{0.3, 0.4, -1};
  for (const Query query : {kClosest, kSeveral, kHit}) {
    const auto usual = count(query, place, way);
    if (!usual.has_value()) GTEST_SKIP() << "instructions cannot be counted here";
    for (const float far : {kInf, 1e30f}) {
      const float before = soup.points.view().x[200];
      soup.points.view().x[200] = far;
      soup.Move();
      EXPECT_LT(*count(query, place, way), 2 * *usual + kOfWideBoxes) << query << ", " << far;
      soup.points.view().x[200] = before;
      soup.Move();
    }
    // A few squares here and there are lost, all corners of each
    const PointBuffer whole = soup.points;
    for (Index i = 5; i + kSide + 1 < kSide * kSide; i += 41) {
      for (const Index corner : {i, i + 1, i + kSide, i + kSide + 1}) soup.points.view().y[corner] = kNan;
    }
    soup.Move();
    EXPECT_LT(*count(query, place, way), 2 * *usual + kOfWideBoxes) << query << ", lost squares";
    soup.points = whole;
    soup.Move();
    for (const double bad : {kInfinity, static_cast<double>(kNan)}) {
      EXPECT_LT(*count(query, {0, bad, 0}, way), 3000u) << query << ", " << bad;
      if (query == kHit) {
        EXPECT_LT(*count(query, place, {0, bad, 1}), 3000u) << bad;
      }
    }
    if (query != kHit) {
      EXPECT_LT(*count(query, place, way, kNan), 3000u) << query;
    }
  }
}

}  // namespace
}  // namespace kpsa::engine
