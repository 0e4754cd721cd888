#include "kpsa/training/some_points.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace kpsa::engine {
namespace {

// A tile whose points stand in a row, but for three that lie elsewhere.
TEST(SomePoints, AreFarthestApart) {
  std::vector<Double3> places;
  for (int i = 0; i < 128; ++i) places.push_back({0.01 * i, 0, 0});
  for (const Index stray : {17u, 18u, 90u}) places[stray] = {0, stray == 90 ? -5.0 : 5.0, 0};
  const std::vector<Index> some = FarthestApart(places, 8);
  ASSERT_EQ(some.size(), 8u);
  EXPECT_TRUE(std::ranges::is_sorted(some));
  EXPECT_EQ(std::ranges::adjacent_find(some), some.end());
  EXPECT_TRUE(std::ranges::count(some, 17u) == 1 || std::ranges::count(some, 18u) == 1);
  EXPECT_EQ(std::ranges::count(some, 90u), 1);
  EXPECT_EQ(std::ranges::count(some, 127u), 1);
  double farthest = 0;  // of those in the row, from a chosen one
  for (const Double3& place : places) {
    double nearest = 1e9;
    for (const Index i : some) nearest = std::min(nearest, Length(place - places[i]));
    farthest = std::max(farthest, nearest);
  }
  EXPECT_LT(farthest, 0.2);
  EXPECT_EQ(FarthestApart(places, 128).size(), 128u);
  EXPECT_EQ(FarthestApart({places.data(), 3}, 8), (std::vector<Index>{0, 1, 2}));
  const std::vector<Double3> one_place(10, Double3{1, 2, 3});
  EXPECT_EQ(FarthestApart(one_place, 4).size(), 4u);
}

}  // namespace
}  // namespace kpsa::engine
