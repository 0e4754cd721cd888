// A hint that memory will be read soon. Never faults, whatever the address.
#pragma once

#include <cstddef>
#include <cstdint>

namespace kpsa::engine {

inline void Prefetch(const void* begin, std::size_t bytes) {
  const auto at = reinterpret_cast<std::uintptr_t>(begin);
  for (std::uintptr_t line = at / 64 * 64; line < at + bytes; line += 64)
    __builtin_prefetch(reinterpret_cast<const void*>(line));
}

}  // namespace kpsa::engine
