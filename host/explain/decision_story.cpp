#include "host/explain/decision_story.h"

#include <algorithm>
#include <cmath>

#include "host/rig_frames.h"
#include "kpsa/kpsa_node.h"
#include "kpsa/signals.h"

namespace kpsa::engine {
namespace {

// The inputs of a KPSA node that guard it.
struct Guards {
  std::vector<PlugRef> matrices, scalars;  // what they are connected to
};

Guards GuardsOf(const Graph& graph, const AppliedSubspace& one) {
  const auto sources = [&](const char* attribute) {
    std::vector<PlugRef> plugs;
    const int number = graph.def(one.node).FindAttribute(attribute);
    while (const Connection* c = graph.FindConnection({one.node, number, static_cast<int>(plugs.size()), -1}))
      plugs.push_back(c->source);
    return plugs;
  };
  return {sources("matrices"), sources("scalars")};
}

// How far a value is beyond a range, in extents of the range; infinite for NaN.
double Beyond(double value, double lo, double hi) {
  if (value >= lo && value <= hi) return 0;
  const double distance = value < lo ? lo - value : value - hi;
  return std::isnan(value) ? std::numeric_limits<double>::infinity()
                           : distance / std::max(hi - lo, 1e-9 * std::max(1.0, std::abs(lo)));
}

// Of every guard that is outside its trained range its worst entry. Outputs from `first` on are the guards'.
std::vector<DecisionStory::Outside> FindOutside(const AppliedSubspace& one, const Guards& guards, Index first,
                                                const Evaluator& evaluator) {
  const KpsaConfig::Data& data = one.config->data();
  std::vector<std::pair<double, DecisionStory::Outside>> found;  // how far, what
  const auto judge = [&](const Signal& signal, const double* values, const double* lo, const double* hi) {
    std::size_t worst = 0;
    double most = 0;
    for (std::size_t e = 0; e < signal.entries(); ++e) {
      const double beyond = Beyond(values[e], lo[e], hi[e]);
      if (beyond > most) most = beyond, worst = e;
    }
    if (most > 0)
      found.emplace_back(
          most, DecisionStory::Outside{EntryName(signal, worst), values[worst], lo[worst], hi[worst]});
  };
  for (std::size_t j = 0; j < guards.matrices.size(); ++j) {
    double values[12];
    MatrixEntries(evaluator.Get<Matrix4>(first++), values);
    judge({data.guard_names[j], guards.matrices[j], true}, values, data.matrix_lo.data() + 12 * j,
          data.matrix_hi.data() + 12 * j);
  }
  for (std::size_t k = 0; k < guards.scalars.size(); ++k, ++first) {
    const double value = evaluator.plan().outputs()[first].type == Type::kDouble
                             ? evaluator.Get<double>(first)
                             : static_cast<double>(evaluator.Get<std::int64_t>(first));
    judge({data.guard_names[guards.matrices.size() + k], guards.scalars[k], false}, &value,
          &data.scalar_lo[k], &data.scalar_hi[k]);
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  std::vector<DecisionStory::Outside> outside;
  for (auto& [beyond, what] : found) outside.push_back(std::move(what));
  return outside;
}

}  // namespace

Result<DecisionStory> TellOfDecisions(Rig* rig, const AccelerationChoice& choice, int frame,
                                      const Watch& watch) {
  Compiler compiler;
  const Result<std::vector<AppliedSubspace>> applied = ApplyAcceleration(rig, &compiler, choice);
  if (!applied.ok()) return applied.status();
  Request request = ShownPoints(*rig);
  Verdicts verdicts(*applied);
  verdicts.Ask(*rig, &request);
  std::vector<Guards> guards;
  std::vector<Index> first;  // output of the guards
  for (const AppliedSubspace& one : *applied) {
    guards.push_back(GuardsOf(*rig->graph, one));
    first.push_back(static_cast<Index>(request.outputs.size()));
    for (const auto* plugs : {&guards.back().matrices, &guards.back().scalars}) {
      for (const PlugRef& plug : *plugs) request.outputs.push_back({plug, {}});
    }
  }
  const auto plan = CompileFor(*rig, &compiler, request);
  if (!plan.ok()) return plan.status();
  Evaluator evaluator(*plan);
  KPSA_RETURN_IF_ERROR(EvaluateTo(*rig, frame, &evaluator, watch));
  verdicts.Add(frame, evaluator);
  DecisionStory story;
  story.frame = frame;
  story.clip = rig->scene.clip.value_or("");
  for (std::size_t n = 0; n < applied->size(); ++n) {
    const AppliedSubspace& one = (*applied)[n];
    story.entries.push_back({verdicts.last()[n], one.path, one.subspace->units, one.tolerance,
                             CalibrationInForce(one), FindOutside(one, guards[n], first[n], evaluator)});
  }
  return story;
}

}  // namespace kpsa::engine
