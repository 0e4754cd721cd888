#include "base/parallel.h"

#include <gtest/gtest.h>

#include <mutex>
#include <set>
#include <thread>

namespace kpsa::engine {
namespace {

std::set<std::thread::id> ThreadsOfALoop() {
  std::mutex mutex;
  std::set<std::thread::id> threads;
  std::size_t done = 0;
  ParallelFor(200, 1, [&](std::size_t begin, std::size_t end) {
    std::this_thread::yield();
    const std::lock_guard lock(mutex);
    threads.insert(std::this_thread::get_id());
    done += end - begin;
  });
  EXPECT_EQ(done, 200u);
  return threads;
}

TEST(WithThreads, OneIsTheCallersAlone) {
  std::set<std::thread::id> used;
  for (int i = 0; i < 20; ++i) WithThreads(1, [&] { used.merge(ThreadsOfALoop()); });
  EXPECT_EQ(used, std::set{std::this_thread::get_id()});
}

TEST(WithThreads, TheBodyRunsOnTheCallersThread) {
  for (const int threads : {0, 1, 2}) {
    std::thread::id ran;
    WithThreads(threads, [&] {
      ran = std::this_thread::get_id();
      ThreadsOfALoop();
    });
    EXPECT_EQ(ran, std::this_thread::get_id()) << threads;
  }
}

}  // namespace
}  // namespace kpsa::engine
