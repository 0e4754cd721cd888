#include "base/parallel.h"

#include <tbb/blocked_range.h>
#include <tbb/global_control.h>
#include <tbb/info.h>
#include <tbb/parallel_for.h>

namespace kpsa {

void ParallelFor(std::size_t count, std::size_t grain, RangeBody body) {
  if (count == 0) return;
  if (grain == 0) grain = 1;
  if (count <= grain) {
    body(0, count);
    return;
  }
  const std::size_t chunks = (count + grain - 1) / grain;
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, chunks), [&](const tbb::blocked_range<std::size_t>& range) {
    const std::size_t end = range.end() * grain;
    body(range.begin() * grain, end < count ? end : count);
  });
}

ThreadLimit::ThreadLimit(int threads)
    : impl_(new tbb::global_control(tbb::global_control::max_allowed_parallelism,
                                    static_cast<std::size_t>(threads > 0 ? threads : HardwareThreads()))) {}

ThreadLimit::~ThreadLimit() { delete static_cast<tbb::global_control*>(impl_); }

int HardwareThreads() { return tbb::info::default_concurrency(); }

int AllowedThreads() {
  return static_cast<int>(tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism));
}

}  // namespace kpsa
