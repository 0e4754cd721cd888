#include "base/spares.h"

#include <gtest/gtest.h>

#include <atomic>
#include <memory>
#include <utility>
#include <vector>

#include "base/parallel.h"

namespace kpsa::engine {
namespace {

// Counts how many there are, and notices two users at once.
struct Place {
  static inline std::atomic<int> alive = 0;
  Place() { ++alive; }
  ~Place() { --alive; }
  std::atomic<int> users = 0;
  int uses = 0;  // not atomic: one user at a time
};

TEST(Spares, EveryOneHasOneUserAndNoneIsLost) {
  std::atomic<int> made = 0, clashes = 0;
  {
    Spares<Place> spares;
    ParallelFor(20000, 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        std::unique_ptr<Place> place = spares.Take();
        if (place == nullptr) {
          place = std::make_unique<Place>();
          ++made;
        }
        if (++place->users != 1) ++clashes;
        ++place->uses;
        --place->users;
        spares.Give(std::move(place));
      }
    });
    EXPECT_EQ(clashes, 0);
    EXPECT_EQ(Place::alive, made);
    EXPECT_LT(made, 64);
    int uses = 0;
    for (std::unique_ptr<Place> place = spares.Take(); place != nullptr; place = spares.Take())
      uses += place->uses;
    EXPECT_EQ(uses, 20000);
    spares.Give(std::make_unique<Place>());
    EXPECT_EQ(Place::alive, 1);
  }
  EXPECT_EQ(Place::alive, 0);  // the rest goes with the spares
}

TEST(Spares, WhatHasNoRoomIsLetGo) {
  Spares<Place> spares;
  for (int i = 0; i < 1000; ++i) spares.Give(std::make_unique<Place>());
  const int kept = Place::alive;
  EXPECT_GE(kept, 64);
  EXPECT_LT(kept, 1000);
  std::vector<std::unique_ptr<Place>> taken;
  for (auto place = spares.Take(); place != nullptr; place = spares.Take()) taken.push_back(std::move(place));
  EXPECT_EQ(taken.size(), static_cast<std::size_t>(kept));
}

}  // namespace
}  // namespace kpsa::engine
