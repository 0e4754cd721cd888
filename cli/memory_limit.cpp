#include "cli/memory_limit.h"

#include <sys/resource.h>

#if defined(__GLIBC__)
#include <malloc.h>
#endif

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <system_error>
#include <utility>

namespace kpsa::engine {

Status LimitMemory(std::string_view text) {
  constexpr double kLeast = 64.0 * 1024 * 1024, kMost = 1e18;
  constexpr std::pair<std::string_view, double> kUnits[] = {{"KB", 1024.0},
                                                            {"MB", 1024.0 * 1024},
                                                            {"GB", 1024.0 * 1024 * 1024},
                                                            {"TB", 1024.0 * 1024 * 1024 * 1024},
                                                            {"", 1}};
  double number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  const std::string_view unit = text.substr(static_cast<std::size_t>(end - text.data()));
  double bytes = NAN;
  for (const auto& [name, size] : kUnits) {
    if (error == std::errc() && unit == name) bytes = number * size;
  }
  if (!(bytes >= kLeast && bytes <= kMost))
    return Status::Usage("--max-memory {}: expected a size from 64MB on, as 500MB or 2GB", text);
  rlimit limit = {};
  if (::getrlimit(RLIMIT_AS, &limit) == 0) {
    limit.rlim_cur = std::min<rlim_t>(static_cast<rlim_t>(bytes), limit.rlim_max);
    if (::setrlimit(RLIMIT_AS, &limit) == 0) return Status();
  }
  return Status::Usage("--max-memory {}: {}", text, std::generic_category().message(errno));
}

void KeepFreedMemory() {
#if defined(__GLIBC__)
  constexpr int kLargest = 256 << 20, kKept = 1 << 30;
  (void)::mallopt(M_MMAP_THRESHOLD, kLargest);
  (void)::mallopt(M_TRIM_THRESHOLD, kKept);
#endif
}

}  // namespace kpsa::engine
