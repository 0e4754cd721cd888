// Bytes decide a graph of toy nodes, its edits, what is set and what is pulled: the engine against the naive twin.
#include "tests/fuzz/fuzzer.h"
#include "tests/support/toy_nodes.h"
#include "tests/support/twin_rounds.h"

namespace kpsa::engine {

KPSA_FUZZER(graph) {
  TwinCounts counts;
  TwinSizes sizes;
  sizes.nodes = 40, sizes.rounds = 4;
  const std::string fault = Disagreement(ToyRegistry(), Choices(bytes), sizes, &counts);
  if (counts.plans > 0) Reached("plan");
  if (counts.lazy_runs > 0) Reached("lazy");
  if (counts.failures > 0) Reached("failure");
  if (counts.frames > 0) Reached("frames");
  Require(fault.empty(), fault);
}

}  // namespace kpsa::engine
