#include "base/fresh_pages.h"

#include <cstdint>

#if defined(__linux__)
#include <sys/mman.h>
#endif

namespace kpsa::engine {
namespace {

constexpr std::size_t kPage = 4096, kWorthAsking = std::size_t{128} << 10;

#if defined(__linux__)
// Of whole pages within the memory only: what lies beside it is others'.
void Advise(void* begin, std::size_t bytes, std::size_t page, int advice) {
  const auto at = reinterpret_cast<std::uintptr_t>(begin);
  const std::uintptr_t first = (at + page - 1) / page * page, end = (at + bytes) / page * page;
  if (first < end) (void)::madvise(reinterpret_cast<void*>(first), end - first, advice);
}
#endif

}  // namespace

std::size_t AlignmentFor(std::size_t bytes) { return bytes >= kLargePage ? kLargePage : 64; }

void PreferLargePages(void* begin, std::size_t bytes) {
#if defined(__linux__) && defined(MADV_HUGEPAGE)
  Advise(begin, bytes, kLargePage, MADV_HUGEPAGE);
#else
  (void)begin, (void)bytes;
#endif
}

void TouchPages(void* begin, std::size_t bytes) {
#if defined(__linux__) && defined(MADV_POPULATE_WRITE)
  if (bytes >= kWorthAsking) Advise(begin, bytes, kPage, MADV_POPULATE_WRITE);
#else
  (void)begin, (void)bytes;
#endif
}

void FetchPages(void* begin, std::size_t bytes) {
  PreferLargePages(begin, bytes);
  TouchPages(begin, bytes);
}

}  // namespace kpsa::engine
