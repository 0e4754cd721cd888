// Counts allocations of all threads. Every way into the C library's allocator is interposed, for the whole test
// program that uses this: operator new ends there, too, and so do TBB's workers.
#pragma once

#include <cstdlib>

#if defined(KPSA_WITH_ASAN) || defined(KPSA_WITH_TSAN) || !defined(__GLIBC__)
#define KPSA_COUNTS_ALLOCATIONS 0  // sanitizers bring allocators of their own
#else
#define KPSA_COUNTS_ALLOCATIONS 1
#endif

namespace kpsa::engine {

void StartCountingAllocations();
int StopCountingAllocations();  // since the start

}  // namespace kpsa::engine
