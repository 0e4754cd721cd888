#include "base/cancel.h"

#include <gtest/gtest.h>

#include <numeric>
#include <vector>

#include "base/parallel.h"
#include "tests/support/countdown.h"

namespace kpsa::engine {
namespace {

TEST(Cancel, ThrowsWithinItsScopeAlone) {
  EXPECT_EQ(CurrentCancel(), nullptr);
  EXPECT_NO_THROW(ThrowIfCancelled());
  const Countdown never, now(0);
  {
    const CancelScope outer(&now);
    EXPECT_THROW(ThrowIfCancelled(), Cancelled);
    {
      const CancelScope inner(&never);
      EXPECT_NO_THROW(ThrowIfCancelled());
      const CancelScope nothing(nullptr);
      EXPECT_NO_THROW(ThrowIfCancelled());
    }
    EXPECT_THROW(ThrowIfCancelled(), Cancelled);
  }
  EXPECT_NO_THROW(ThrowIfCancelled());
}

TEST(Cancel, AFlagCountsWithWhatIsAroundIt) {
  std::atomic<bool> flag{false};
  EXPECT_FALSE(FlagCancel(nullptr).asked());
  const FlagCancel alone(&flag);
  const Countdown around(0);
  const CancelScope scope(&around);
  EXPECT_TRUE(FlagCancel(nullptr).asked());
  EXPECT_FALSE(alone.asked());
  flag = true;
  EXPECT_TRUE(alone.asked());
}

// Whatever the number of questions that are answered with "go on", and of threads.
TEST(Cancel, ParallelForEndsBetweenRanges) {
  for (const int threads : {1, 0}) {
    const ThreadLimit limit(threads);
    for (const int questions : {0, 1, 2, 5}) {
      std::atomic<int> ran{0};
      const Countdown countdown(questions);
      const CancelScope scope(&countdown);
      EXPECT_THROW(ParallelFor(1000, 1,
                               [&](std::size_t begin, std::size_t end) {
                                 for (std::size_t i = begin; i < end; ++i) ++ran, ThrowIfCancelled();
                               }),
                   Cancelled);
      EXPECT_LE(ran, questions + 1 + HardwareThreads()) << "a range that had begun on each thread";
    }
    // Threads that come to help ask the scope of the work, and are themselves again afterwards
    const Countdown never;
    std::atomic<int> others{0};
    {
      const CancelScope scope(&never);
      ParallelFor(1000, 1, [&](std::size_t, std::size_t) { others += CurrentCancel() != &never; });
    }
    ParallelFor(1000, 1, [&](std::size_t, std::size_t) { others += CurrentCancel() != nullptr; });
    EXPECT_EQ(others, 0);
    EXPECT_GT(never.questions(), 0);
  }
}

TEST(Cancel, NestedWorkEndsToo) {
  const Countdown countdown(50);
  const CancelScope scope(&countdown);
  EXPECT_THROW(
      ParallelFor(8, 1,
                  [&](std::size_t, std::size_t) { ParallelFor(1000, 1, [](std::size_t, std::size_t) {}); }),
      Cancelled);
  EXPECT_THROW(ParallelFor(1, 1, [](std::size_t, std::size_t) {}), Cancelled) << "inline";
}

}  // namespace
}  // namespace kpsa::engine
