// What is kept of the influences of points: the same as if they were found anew, for any points in any order of asking.
#include "nodes/known_influences.h"

#include <gtest/gtest.h>

#include <thread>

namespace kpsa::engine {
namespace {

// As many influences as the number of a point says, none for every third.
WrapInfluences Found(std::span<const Index> points) {
  WrapInfluences found;
  for (const Index point : points) {
    for (Index k = 0; point % 3 != 0 && k <= point % 5; ++k) {
      found.points.push_back(100 * point + k);
      found.weights.push_back(1.0 / (1 + k));
    }
    found.offsets.push_back(static_cast<Index>(found.points.size()));
  }
  return found;
}

Digest KeyOf(int number) {
  Hasher hasher;
  hasher.Add(number);
  return hasher.Finish();
}

void ExpectSame(const WrapInfluences& a, const WrapInfluences& b) {
  EXPECT_EQ(a.offsets, b.offsets);
  EXPECT_EQ(a.points, b.points);
  EXPECT_EQ(a.weights, b.weights);
}

TEST(KnownInfluences, AreThoseThatWouldBeFound) {
  KnownInfluences known;
  std::size_t asked = 0;
  const auto find = [&](std::span<const Index> points) {
    asked += points.size();
    return Found(points);
  };
  for (const std::vector<Index>& points :
       {std::vector<Index>{4, 5, 9}, {5}, {0, 4, 7, 9, 11}, {}, {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11}})
    ExpectSame(known.Of(KeyOf(1), 12, points, find), Found(points));
  EXPECT_EQ(asked, 12u) << "each once";
  // Of another geometry nothing is known, and of the oldest of many no more
  const std::vector<Index> some = {1, 2};
  for (int key = 2; key < 6; ++key) known.Of(KeyOf(key), 12, some, find);
  EXPECT_EQ(asked, 20u);
  ExpectSame(known.Of(KeyOf(1), 12, some, find), Found(some));
  EXPECT_EQ(asked, 22u);
}

TEST(KnownInfluences, ServeManyThreads) {
  KnownInfluences known;
  std::vector<std::thread> threads;
  std::atomic<int> wrong = 0;
  for (Index t = 0; t < 4; ++t) {
    threads.emplace_back([&, t] {
      for (Index round = 0; round < 200; ++round) {
        std::vector<Index> points;
        for (Index p = (t + round) % 7; p < 500; p += 1 + (t * round) % 11) points.push_back(p);
        const WrapInfluences all = known.Of(KeyOf(static_cast<int>(round % 6)), 500, points, Found),
                             expected = Found(points);
        wrong += all.points != expected.points || all.offsets != expected.offsets;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(wrong, 0);
}

}  // namespace
}  // namespace kpsa::engine
