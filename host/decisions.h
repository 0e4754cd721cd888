// What KPSA nodes decided on a frame.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "graph/evaluator.h"
#include "host/acceleration.h"

namespace kpsa::engine {

enum class FrameVerdict : std::uint8_t { kHit, kBlend, kMiss };

// Of one node on one frame.
struct FrameDecision {
  std::string entry;       // the accelerate entry
  double full_weight = 0;  // share of the full evaluation in its points: 0 a hit, 1 a miss
  double score = 0;        // infinite where nothing was measured
  std::string reason;      // "hit", or why not, with the plug or the point
  FrameVerdict verdict() const {
    return full_weight <= 0  ? FrameVerdict::kHit
           : full_weight < 1 ? FrameVerdict::kBlend
                             : FrameVerdict::kMiss;
  }
  bool hit() const { return verdict() == FrameVerdict::kHit; }
};

inline constexpr Index kDecisionOutputs = 4;  // of a node

// Adds to a request what DecisionOf reads, node after node; the number of the first output.
Index AskForDecisions(const std::vector<AppliedSubspace>& applied, const Graph& graph, Request* request);
// What it says in numbers, of outputs that are up to date; first: of this node. Allocates nothing.
struct DecisionNumbers {
  double full_weight = 0, score = 0;
  std::int64_t reason = 0, offender = -1;
};
DecisionNumbers ReadDecision(const Evaluator& evaluator, Index first);
FrameDecision DecisionOf(const AppliedSubspace& one, const DecisionNumbers& numbers);
// Of outputs that are up to date; first: of this node.
FrameDecision DecisionOf(const AppliedSubspace& one, const Evaluator& evaluator, Index first);
// The one with the largest share of the full evaluation, of equal ones with the largest score.
bool IsWorse(const FrameDecision& a, const FrameDecision& b);

}  // namespace kpsa::engine
