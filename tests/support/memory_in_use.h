// How much memory this process has taken and not given back, in bytes: the C library's own count, of all
// threads. 0 where something else allocates (sanitizers), and so are all differences.
#pragma once

#include <malloc.h>

#include <cstddef>

namespace kpsa::engine {

inline std::size_t MemoryInUse() {
  const struct mallinfo2 now = mallinfo2();
  return now.uordblks + now.hblkhd;
}

}  // namespace kpsa::engine
