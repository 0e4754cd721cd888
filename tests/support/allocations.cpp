#include "tests/support/allocations.h"

#include <dlfcn.h>
#include <stdlib.h>
#include <sys/mman.h>

#include <atomic>
#include <cerrno>

namespace {
std::atomic<bool> counting{false};
std::atomic<int> allocations{0};
[[maybe_unused]] void Count() {
  if (counting.load(std::memory_order_relaxed)) allocations.fetch_add(1, std::memory_order_relaxed);
}
}  // namespace

#if KPSA_COUNTS_ALLOCATIONS
extern "C" {
void* __libc_malloc(size_t);
void* __libc_calloc(size_t, size_t);
void* __libc_realloc(void*, size_t);
void* __libc_memalign(size_t, size_t);

void* malloc(size_t size) noexcept { return Count(), __libc_malloc(size); }
void* calloc(size_t count, size_t size) noexcept { return Count(), __libc_calloc(count, size); }
void* realloc(void* old, size_t size) noexcept { return Count(), __libc_realloc(old, size); }
void* memalign(size_t alignment, size_t size) noexcept { return Count(), __libc_memalign(alignment, size); }
void* aligned_alloc(size_t alignment, size_t size) noexcept {
  return Count(), __libc_memalign(alignment, size);
}
int posix_memalign(void** result, size_t alignment, size_t size) noexcept {
  Count();
  *result = __libc_memalign(alignment, size);
  return *result == nullptr ? ENOMEM : 0;
}
void* mmap(void* address, size_t length, int protection, int flags, int file, off_t offset) noexcept {
  Count();
  using Mmap = void* (*)(void*, size_t, int, int, int, off_t);
  static const auto real = reinterpret_cast<Mmap>(dlsym(RTLD_NEXT, "mmap"));
  return real(address, length, protection, flags, file, offset);
}
}
#endif

namespace kpsa::engine {

void StartCountingAllocations() { allocations = 0, counting = true; }
int StopCountingAllocations() {
  counting = false;
  return allocations;
}

}  // namespace kpsa::engine
