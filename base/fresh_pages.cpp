#include "base/fresh_pages.h"

#include <cstdint>

#if defined(__linux__)
#include <sys/mman.h>
#endif

namespace kpsa::engine {
namespace {

constexpr std::size_t kPage = 4096, kWorthAsking = std::size_t{128} << 10;

}  // namespace

std::size_t AlignmentFor(std::size_t bytes) { return bytes >= kLargePage ? kLargePage : 64; }

void FetchPages(void* begin, std::size_t bytes) {
#if defined(__linux__)
  if (bytes < kWorthAsking) return;
  // Whole pages within the memory only: what lies beside it is others'
  const auto at = reinterpret_cast<std::uintptr_t>(begin);
  const auto within = [&](std::size_t page, int advice) {
    const std::uintptr_t first = (at + page - 1) / page * page, end = (at + bytes) / page * page;
    if (first < end) (void)::madvise(reinterpret_cast<void*>(first), end - first, advice);
  };
#ifdef MADV_HUGEPAGE
  within(kLargePage, MADV_HUGEPAGE);
#endif
#ifdef MADV_POPULATE_WRITE
  within(kPage, MADV_POPULATE_WRITE);
#endif
#else
  (void)begin, (void)bytes;
#endif
}

}  // namespace kpsa::engine
