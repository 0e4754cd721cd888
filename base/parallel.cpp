#include "base/parallel.h"

#include <tbb/blocked_range.h>
#include <tbb/global_control.h>
#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#include <tbb/task_group.h>

#include "base/cancel.h"

#if defined(KPSA_WITH_TSAN)
// The library of TBB is not instrumented: the sanitizer does not see how it hands tasks to threads and waits
// for them. What it orders is told below (before the loop, in each range, after the loop); its own objects
// (tasks with the range and the lambda in them) are left out by the functions that read them. Everything that
// a body does is checked.
#include <sanitizer/tsan_interface.h>

extern "C" const char* __tsan_default_suppressions() {
  return "race:fold_tree\n"           // the end of a task, inlined or not: never above a body
         "race:check_being_stolen\n"  // its beginning, likewise
         "race_top:tbb::detail\n"
         "race_top:oneapi/tbb\n"
         "race_top:base/parallel.cpp\n";
}
#endif

namespace kpsa::engine {
namespace {

// What a thread did before Publish, another one sees after Observe.
#if defined(KPSA_WITH_TSAN)
void Publish(char* place) { __tsan_release(place); }
void Observe(char* place) { __tsan_acquire(place); }
#else
void Publish(char*) {}
void Observe(char*) {}
#endif

// Also where a body throws.
struct PublishAtEnd {
  char* place;
  ~PublishAtEnd() { Publish(place); }
};
struct ObserveAtEnd {
  char* place;
  ~ObserveAtEnd() { Observe(place); }
};

}  // namespace

void ParallelFor(std::size_t count, std::size_t grain, RangeBody body) {
  if (count == 0) return;
  if (grain == 0) grain = 1;
  ThrowIfCancelled();
  if (count <= grain) {
    body(0, count);
    return;
  }
  const std::size_t chunks = (count + grain - 1) / grain;
  const CancelSource* const cancel = CurrentCancel();
  char begins = 0, ends = 0;
  Publish(&begins);
  const ObserveAtEnd ended{&ends};
  // Its bodies round as the caller does. A thread's tasks do by themselves, but as it rounded when it first
  // used TBB: where that was within a library that flushes small numbers to zero, they would do so for good
  tbb::task_group_context rounding(tbb::task_group_context::bound, tbb::task_group_context::default_traits |
                                                                       tbb::task_group_context::fp_settings);
  tbb::parallel_for(
      tbb::blocked_range<std::size_t>(0, chunks),
      [&](const tbb::blocked_range<std::size_t>& range) {
        Observe(&begins);
        const PublishAtEnd end_of_range{&ends};
        const CancelScope scope(cancel);  // which may be another one than this thread was just in
        ThrowIfCancelled();
        const std::size_t end = range.end() * grain;
        body(range.begin() * grain, end < count ? end : count);
      },
      rounding);
}

ThreadLimit::ThreadLimit(int threads)
    : impl_(new tbb::global_control(tbb::global_control::max_allowed_parallelism,
                                    static_cast<std::size_t>(threads > 0 ? threads : HardwareThreads()))) {}

ThreadLimit::~ThreadLimit() { delete static_cast<tbb::global_control*>(impl_); }

void WithThreads(int threads, const std::function<void()>& body) {
  if (threads <= 0) return body();
  tbb::task_arena arena(threads);
  arena.execute(body);
}

int HardwareThreads() { return tbb::info::default_concurrency(); }

int AllowedThreads() {
  return static_cast<int>(tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism));
}

}  // namespace kpsa::engine
