// Times that a busy machine does not stretch.
#include "host/bench/frame_times.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <thread>
#include <vector>

#include "graph/profile.h"

namespace kpsa::engine {
namespace {

TEST(FrameTimes, WhatIsTakenOffComesFromTheInterruptedFrames) {
  std::vector<double> times = {10, 300, 5010, 12, 2010}, floors = {10, 290, 10, 10, 10};
  TakeOff(7000, floors, times);
  EXPECT_EQ(times, (std::vector<double>{10, 300, 10, 12, 10}));
  TakeOff(5, floors, times);
  EXPECT_EQ(times, (std::vector<double>{10, 295, 10, 12, 10}));
  TakeOff(1e9, floors, times);
  EXPECT_EQ(times, floors) << "none below its floor";
}

TEST(FrameTimes, WaitingIsNoWork) {
  constexpr std::uint64_t kWait = 30'000'000;
  for (const bool cpu : {true, false}) {
    FrameTimes times(3, cpu);
    for (int run = 0; run < 3; ++run) {
      times.BeginTurn(0);
      for (int f = 0; f < 3; ++f) {
        const std::uint64_t begin = ProfileClock();
        if (f == run) std::this_thread::sleep_for(std::chrono::nanoseconds(kWait));
        times.Add(ProfileClock() - begin);
      }
      times.EndTurn();
    }
    double most = 0;
    for (const std::vector<double>& runs : times.Finish()) {
      ASSERT_EQ(runs.size(), 3u);
      most = std::max(most, *std::max_element(runs.begin(), runs.end()));
    }
    EXPECT_EQ(most < 0.5 * kWait, cpu) << most;
    if (cpu) {
      EXPECT_GT(times.wall_ns(), 10 * times.cpu_ns());
    }
  }
}

// What a frame waited is not taken off another that works longer, as one that misses among some that hit.
TEST(FrameTimes, OfASingleRunOnlyFramesOfAKindAreAlike) {
  constexpr std::uint64_t kWait = 5'000'000, kWork = 20'000'000;
  FrameTimes times(4, true);
  times.BeginTurn(0);
  for (int f = 0; f < 4; ++f) {
    const std::uint64_t begin = ProfileClock(), worked = ThreadCpuClock();
    if (f == 0) std::this_thread::sleep_for(std::chrono::nanoseconds(kWait));
    while (f == 2 && ThreadCpuClock() < worked + kWork) {
    }
    times.Add(ProfileClock() - begin);
  }
  times.EndTurn();
  const std::vector<int> kinds = {0, 0, 1, 0};
  const std::vector<std::vector<double>> ns = times.Finish(kinds);
  EXPECT_LT(ns[0][0], 0.5 * kWait);
  EXPECT_GT(ns[2][0], 0.99 * kWork);
}

}  // namespace
}  // namespace kpsa::engine
