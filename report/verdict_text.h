// Decisions of KPSA nodes in words and as JSON.
#pragma once

#include <cstddef>
#include <string>

#include "host/verdicts.h"

namespace kpsa::engine {

const char* VerdictName(FrameVerdict verdict);  // "hit", "blend", "miss"

// A JSON object of any type that is made as nlohmann's are; a score that is infinite is dumped as null.
template <typename Json>
Json DecisionJson(const FrameDecision& decision) {
  return {{"verdict", VerdictName(decision.verdict())},
          {"full_weight", decision.full_weight},
          {"score", decision.score},
          {"reason", decision.reason},
          {"subspace", decision.entry}};
}

// "200 hits, 12 blends, 28 misses"
std::string CountsText(std::size_t hits, std::size_t blends, std::size_t misses);
std::string VerdictsText(const Verdicts& verdicts);  // one line: hits, blends, misses, worst score

}  // namespace kpsa::engine
