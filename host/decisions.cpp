#include "host/decisions.h"

#include "kpsa/kpsa_node.h"

namespace kpsa::engine {

Index AskForDecisions(const std::vector<AppliedSubspace>& applied, const Graph& graph, Request* request) {
  constexpr const char* kOutputs[kDecisionOutputs] = {"fullWeight", "score", "missReason", "offender"};
  const auto first = static_cast<Index>(request->outputs.size());
  for (const AppliedSubspace& one : applied) {
    const NodeDef& def = graph.def(one.node);
    for (const char* name : kOutputs)
      request->outputs.push_back({{one.node, def.FindAttribute(name), -1, -1}, {}});
  }
  return first;
}

DecisionNumbers ReadDecision(const Evaluator& evaluator, Index first) {
  return {evaluator.Get<double>(first), evaluator.Get<double>(first + 1),
          evaluator.Get<std::int64_t>(first + 2), evaluator.Get<std::int64_t>(first + 3)};
}

FrameDecision DecisionOf(const AppliedSubspace& one, const DecisionNumbers& numbers) {
  FrameDecision decision;
  decision.entry = one.name;
  decision.full_weight = numbers.full_weight;
  decision.score = numbers.score;
  decision.reason = MissText(*one.config, static_cast<MissReason>(numbers.reason),
                             numbers.offender < 0 ? kNoIndex : static_cast<Index>(numbers.offender));
  return decision;
}

FrameDecision DecisionOf(const AppliedSubspace& one, const Evaluator& evaluator, Index first) {
  return DecisionOf(one, ReadDecision(evaluator, first));
}

bool IsWorse(const FrameDecision& a, const FrameDecision& b) {
  return a.full_weight > b.full_weight || (a.full_weight == b.full_weight && a.score > b.score);
}

}  // namespace kpsa::engine
