#include "tests/support/instruction_count.h"

#if defined(__x86_64__) && defined(__linux__) && !defined(KPSA_WITH_TSAN) && !defined(KPSA_WITH_ASAN)
#include <signal.h>

namespace kpsa::engine {
namespace {

constexpr unsigned long kTrapFlag = 0x100;
volatile std::uint64_t traps = 0;

void CountTrap(int, siginfo_t*, void*) { traps = traps + 1; }

// The processor traps after every instruction from the end of the first to the end of the second. Both clear
// the red zone below the stack pointer before they use the stack.
inline __attribute__((always_inline)) void StartTraps() {
  asm volatile(
      "lea -128(%%rsp), %%rsp\n pushfq\n orq %0, (%%rsp)\n popfq\n lea 128(%%rsp), %%rsp" ::"i"(kTrapFlag)
      : "memory", "cc");
}
inline __attribute__((always_inline)) void StopTraps() {
  asm volatile(
      "lea -128(%%rsp), %%rsp\n pushfq\n andq %0, (%%rsp)\n popfq\n lea 128(%%rsp), %%rsp" ::"i"(~kTrapFlag)
      : "memory", "cc");
}

}  // namespace

std::optional<std::uint64_t> CountInstructions(const std::function<void()>& body) {
  struct sigaction action = {}, before = {};
  action.sa_sigaction = CountTrap;
  action.sa_flags = SA_SIGINFO;
  if (sigaction(SIGTRAP, &action, &before) != 0) return std::nullopt;
  traps = 0;
  StartTraps();
  StopTraps();
  const std::uint64_t empty = traps;  // what the frame itself costs; 0 where traps do not come
  traps = 0;
  StartTraps();
  body();
  StopTraps();
  const std::uint64_t counted = traps;
  sigaction(SIGTRAP, &before, nullptr);
  if (empty == 0 || counted <= empty) return std::nullopt;
  return counted - empty;
}

}  // namespace kpsa::engine

#else

namespace kpsa::engine {
std::optional<std::uint64_t> CountInstructions(const std::function<void()>&) { return std::nullopt; }
}  // namespace kpsa::engine

#endif
