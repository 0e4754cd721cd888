// Trees of triangles give the bits that each triangle alone gives, whatever the sizes and wherever they have
// been. (Few triangles are looked at one by one: such trees are the twin.)
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <thread>
#include <utility>
#include <vector>

#if defined(__SSE2__)
#include <xmmintrin.h>
#endif

#include "base/parallel.h"
#include "base/triangle_tree.h"

namespace kpsa::engine {
namespace {

constexpr double kEndless = std::numeric_limits<double>::infinity();

class Twin {
 public:
  explicit Twin(unsigned seed) : engine_(seed) {}
  double Number() { return 2 * (static_cast<double>(engine_()) / 4294967296.0) - 1; }
  Double3 Place(double size) {
    const double x = Number(), y = Number();
    return Double3{x, y, Number()} * size;
  }
  std::size_t Below(std::size_t count) { return engine_() % count; }

  // Triangles of a few sizes around `offset`, some without area.
  PointBuffer Soup(std::size_t triangles, double size, double offset = 0) {
    PointBuffer points(3 * triangles);
    for (std::size_t t = 0; t < triangles; ++t) {
      const Double3 center = Place(size) + Double3{offset, offset, offset};
      const double own = t % 13 == 0 ? 0 : t % 9 == 0 ? 0.5 * size : 0.05 * size;
      for (std::size_t k = 0; k < 3; ++k) {
        const Double3 p = center + Place(own);
        points.view().x[3 * t + k] = static_cast<float>(p.x);
        points.view().y[3 * t + k] = static_cast<float>(p.y);
        points.view().z[3 * t + k] = static_cast<float>(p.z);
      }
    }
    return points;
  }

 private:
  std::mt19937 engine_;
};

std::vector<Index> Corners(const PointBuffer& points) {
  std::vector<Index> corners(points.count());
  for (std::size_t i = 0; i < corners.size(); ++i) corners[i] = static_cast<Index>(i);
  return corners;
}

bool SameBits(const SurfacePoint& a, const SurfacePoint& b) {
  return a.triangle == b.triangle && std::memcmp(&a.squared, &b.squared, sizeof(double)) == 0 &&
         (a.triangle == kNoIndex || (a.point == b.point && std::equal(a.weights, a.weights + 3, b.weights)));
}
bool SameBits(const LineHit& a, const LineHit& b) {
  return a.triangle == b.triangle && std::memcmp(&a.t, &b.t, sizeof(double)) == 0 &&
         std::equal(a.weights, a.weights + 3, b.weights);
}

// What the triangles say one by one.
class OneByOne {
 public:
  explicit OneByOne(ConstPointsView points) {
    for (std::size_t i = 0; i + 2 < points.count; i += 3) {
      std::vector<float> xyz;
      for (std::size_t k = i; k < i + 3; ++k) xyz.insert(xyz.end(), {points.x[k], points.y[k], points.z[k]});
      const PointBuffer own = PointBuffer::FromInterleaved(xyz);
      trees_.emplace_back(own.view(), Corners(own));
    }
  }
  SurfacePoint Closest(Double3 place) const {
    SurfacePoint best;
    for (std::size_t t = 0; t < trees_.size(); ++t) {
      SurfacePoint one = trees_[t].Closest(place);
      if (one.triangle == kNoIndex || !(one.squared < best.squared)) continue;
      best = one;
      best.triangle = static_cast<Index>(t);
    }
    return best;
  }
  LineHit FirstHit(Double3 origin, Double3 direction) const {
    LineHit best;
    for (std::size_t t = 0; t < trees_.size(); ++t) {
      LineHit one = trees_[t].FirstHit(origin, direction);
      if (!(one.t < best.t)) continue;
      best = one;
      best.triangle = static_cast<Index>(t);
    }
    return best;
  }

 private:
  std::vector<TriangleTree> trees_;
};

// Places near the triangles and far from them, lines from there towards them and anywhere else.
void ExpectSameBits(const TriangleTree& tree, double size, double offset, Twin* random, int* hits) {
  const ConstPointsView points = tree.points();
  const OneByOne twin(points);
  for (int i = 0; i < 60; ++i) {
    const std::size_t own = random->Below(points.count);
    const Double3 on{points.x[own], points.y[own], points.z[own]};
    Double3 place = on;
    if (i % 3 == 1) place = on + random->Place(0.1 * size);
    if (i % 3 == 2) place = random->Place(size * std::pow(10, i % 4)) + Double3{offset, offset, offset};
    ASSERT_TRUE(SameBits(tree.Closest(place), twin.Closest(place))) << size << " " << offset << " " << i;
    const std::size_t aim = random->Below(points.count);
    const Double3 target{points.x[aim], points.y[aim], points.z[aim]};
    Double3 along = i % 2 == 0 ? target - place : random->Place(1);
    if (i % 5 == 0) along = {i % 10 == 0 ? 1.0 : 0.0, 0, i % 10 == 0 ? 0.0 : -1.0};
    along = along * std::pow(10, i % 7 - 3);
    const LineHit hit = tree.FirstHit(place, along);
    ASSERT_TRUE(SameBits(hit, twin.FirstHit(place, along))) << size << " " << offset << " " << i;
    *hits += hit.triangle != kNoIndex ? 1 : 0;
  }
}

TEST(TriangleTreeTwin, BitsOfEachTriangleAlone) {
  Twin random(31);
  int hits = 0;
  for (const double size : {1e-43, 1e-38, 1e-34, 1e-9, 1e-3, 1.0, 1e4, 1e12}) {
    for (const double away : {0.0, 1.0, 30.0, 1e4}) {
      const PointBuffer points = random.Soup(9 + random.Below(200), size, away * size);
      const TriangleTree tree(points.view(), Corners(points));
      ExpectSameBits(tree, size, away * size, &random, &hits);
    }
  }
  EXPECT_GT(hits, 200);
}

TEST(TriangleTreeTwin, BitsWhereverThePointsHaveBeen) {
  Twin random(32);
  int hits = 0;
  const PointBuffer rest = random.Soup(300, 1);
  TriangleTree tree(rest.view(), Corners(rest));
  for (const double size : {1.0, 50.0, 1e-4, 1.0}) {
    const PointBuffer moved = random.Soup(300, size, size);
    tree.Move(moved.view());
    ExpectSameBits(tree, size, size, &random, &hits);
    // A pose that explodes in between leaves nothing behind
    PointBuffer broken = moved;
    for (std::size_t i = 0; i < broken.count(); i += 2)
      broken.view().x[i] = i % 4 == 0 ? std::numeric_limits<float>::quiet_NaN() : 3e38f;
    tree.Move(broken.view());
    EXPECT_TRUE(SameBits(tree.Closest({0.1, 0.2, 0.3}), OneByOne(broken.view()).Closest({0.1, 0.2, 0.3})));
  }
  EXPECT_GT(hits, 40);
}

// Those that are there when the tree is built are no worse than those that come later.
TEST(TriangleTreeTwin, BitsAfterPointsThatWereNotFiniteAtRest) {
  Twin random(33);
  int hits = 0;
  const PointBuffer good = random.Soup(100, 1);
  PointBuffer bad = good;
  for (std::size_t i = 0; i < bad.count() / 2; ++i)
    bad.view().y[i] =
        i % 2 == 0 ? std::numeric_limits<float>::quiet_NaN() : -std::numeric_limits<float>::infinity();
  TriangleTree tree(bad.view(), Corners(bad));
  ExpectSameBits(tree, 1, 0, &random, &hits);
  tree.Move(good.view());
  ExpectSameBits(tree, 1, 0, &random, &hits);
}

TEST(TriangleTreeTwin, CoordinatesOfAnySizeAreFound) {
  Twin random(34);
  int hits = 0;
  for (const double size : {1e17, 1e19, 1e25, 1e30}) {
    const PointBuffer points = random.Soup(40, size);
    const TriangleTree tree(points.view(), Corners(points));
    const OneByOne twin(points.view());
    for (int i = 0; i < 30; ++i) {
      // From near the coordinates' origin, from where a line never comes near it, and past corners
      const Double3 place = random.Place(i % 3 == 0 ? 1 : i % 3 == 1 ? size : 10 * size);
      const std::size_t aim = random.Below(points.count());
      const Double3 along =
          i % 2 == 0 ? random.Place(size)
                     : Double3{points.view().x[aim], points.view().y[aim], points.view().z[aim]} - place;
      ASSERT_TRUE(SameBits(tree.Closest(place), twin.Closest(place))) << size;
      const LineHit hit = tree.FirstHit(place, along);
      ASSERT_TRUE(SameBits(hit, twin.FirstHit(place, along))) << size;
      hits += hit.triangle != kNoIndex ? 1 : 0;
    }
  }
  EXPECT_GT(hits, 30);
}

TEST(TriangleTreeTwin, SeveralAndLowestAreThoseOfEachTriangle) {
  Twin random(39);
  for (int round = 0; round < 20; ++round) {
    // On a lattice many places are equally far
    PointBuffer points = random.Soup(60, 1);
    for (float* row : {points.view().x, points.view().y, points.view().z}) {
      for (std::size_t i = 0; i < points.count(); ++i) row[i] = std::round(3 * row[i]) / 2;
    }
    const std::vector<Index> corners = Corners(points);
    const TriangleTree tree(points.view(), corners);
    for (int i = 0; i < 20; ++i) {
      const Double3 place{std::round(2 * random.Number()), std::round(2 * random.Number()), 0.5};
      const double limit = i % 2 == 0 ? kEndless : 1;
      std::vector<SurfacePoint> all, found;
      for (Index t = 0; t < 60; ++t) {
        all.push_back(ClosestOnTriangle(points.view(), &corners[3 * std::size_t{t}], place));
        all.back().triangle = t;
        if (!(all.back().squared <= limit * limit)) all.pop_back();
      }
      const SurfacePoint lowest = tree.Lowest(place, limit);
      ASSERT_TRUE(SameBits(lowest, all.empty() ? SurfacePoint() : all.front()));
      std::stable_sort(all.begin(), all.end(),
                       [](const SurfacePoint& a, const SurfacePoint& b) { return a.squared < b.squared; });
      tree.ClosestSeveral(place, 9, limit, &found);
      ASSERT_EQ(found.size(), std::min<std::size_t>(9, all.size()));
      for (std::size_t k = 0; k < found.size(); ++k) ASSERT_TRUE(SameBits(found[k], all[k])) << k;
    }
  }
}

// Large meshes are built and refitted by several threads.
TEST(TriangleTreeTwin, SeveralThreadsFindTheSame) {
  Twin random(35);
  const PointBuffer rest = random.Soup(20000, 1), moved = random.Soup(20000, 2);
  TriangleTree tree(rest.view(), Corners(rest));
  tree.Move(moved.view());
  const TriangleTree fresh(moved.view(), Corners(moved));
  std::vector<Double3> places(2000);
  for (Double3& place : places) place = random.Place(2);
  std::vector<SurfacePoint> together(places.size());
  std::vector<LineHit> hits(places.size());
  ParallelFor(places.size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      together[i] = tree.Closest(places[i]);
      hits[i] = tree.FirstHit(places[i], places[i] * -1);
    }
  });
  const OneByOne twin(moved.view());
  for (std::size_t i = 0; i < 20; ++i) ASSERT_TRUE(SameBits(together[i], twin.Closest(places[i])));
  for (std::size_t i = 0; i < places.size(); ++i) {
    ASSERT_TRUE(SameBits(together[i], fresh.Closest(places[i])));
    ASSERT_TRUE(SameBits(hits[i], fresh.FirstHit(places[i], places[i] * -1)));
  }
}

TEST(TriangleTreeTwin, MovedAndAssignedTreesAreTheirOldSelves) {
  Twin random(36);
  const PointBuffer points = random.Soup(50, 1);
  TriangleTree first(points.view(), Corners(points));
  const SurfacePoint expected = first.Closest({0.3, 0.1, 0.2});
  TriangleTree second = std::move(first);
  first = TriangleTree();
  EXPECT_TRUE(SameBits(second.Closest({0.3, 0.1, 0.2}), expected));
  const PointBuffer elsewhere = random.Soup(50, 1, 9);
  second.Move(elsewhere.view());
  EXPECT_GT(second.Closest({0.3, 0.1, 0.2}).squared, 50);
  first.Move({});
  EXPECT_EQ(first.Closest({0, 0, 0}).triangle, kNoIndex);
  EXPECT_TRUE(first.triangles().empty());
}

#if defined(__SSE2__)
// Nor does a thread keep it that uses a tree before anything else (Embree flushes small numbers to zero).
TEST(TriangleTreeTwin, ThreadsRoundAsTheyDid) {
  std::thread([] {
    Twin random(38);
    const PointBuffer points = random.Soup(50, 1), moved = random.Soup(50, 2);
    TriangleTree tree(points.view(), Corners(points));
    tree.Move(moved.view());
    std::vector<float> products(64);
    const float small = 1e-20f * static_cast<float>(1 + random.Below(1));
    ParallelFor(products.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) products[i] = small * small;
    });
    for (const float product : products) EXPECT_GT(product, 0);
  }).join();
}

TEST(TriangleTreeTwin, LeavesTheFloatingPointModeAlone) {
  Twin random(37);
  const unsigned before = _mm_getcsr() & ~0x3fu;  // without the sticky flags
  const PointBuffer points = random.Soup(50, 1), moved = random.Soup(50, 1);
  TriangleTree tree(points.view(), Corners(points));
  tree.Move(moved.view());
  tree.Closest({0, 0, 0}, kEndless);
  tree.FirstHit({0, 0, 0}, {0, 0, 1});
  EXPECT_EQ(_mm_getcsr() & ~0x3fu, before);
}
#endif

}  // namespace
}  // namespace kpsa::engine
