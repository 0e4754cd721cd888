// How a kernel splits its points over threads without knowing a thread pool.
#pragma once

#include <cstddef>

#include "base/parallel.h"

namespace kpsa::engine {

// A loop that somebody else runs: run(self, count, grain, body) calls body over disjoint ranges that cover
// [0, count), every range but the last a multiple of `grain` long, and returns when all are done.
// Kernels take `const Parallel*`; null runs inline. Results never depend on the split.
struct Parallel {
  void (*run)(void* self, std::size_t count, std::size_t grain, RangeBody body) = nullptr;
  void* self = nullptr;
};

inline void ForRanges(const Parallel* parallel, std::size_t count, std::size_t grain, RangeBody body) {
  if (count == 0) return;
  if (parallel == nullptr || parallel->run == nullptr || count <= grain) {
    body(0, count);
  } else {
    parallel->run(parallel->self, count, grain, body);
  }
}

}  // namespace kpsa::engine
