// How many instructions a function executes, counted one by one with the processor's trap flag: exact, the
// same at every run, and in need of no performance counters or permissions. A microsecond or so an
// instruction.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>

namespace kpsa::engine {

// Instructions of `body` and of what it calls, on this thread (system calls count as one). None where the
// machine offers no trap flag, or under a sanitizer.
std::optional<std::uint64_t> CountInstructions(const std::function<void()>& body);

}  // namespace kpsa::engine
