#include "rig/build/steps/finish_stacks.h"

namespace kpsa::engine {

void FinishStacks(WeightSetter* setter, const Graph& graph, MadeNodes* nodes,
                  std::vector<std::string>* notes) {
  for (MadeNode& made : *nodes) {
    setter->Set(&made);
    const bool deforms = graph.def(made.id).FindAttribute("outPoints") >= 0 &&
                         graph.def(made.id).FindAttribute("inPoints") >= 0;
    if (deforms && made.geometries.empty()) {
      notes->push_back(fmt::format("{}: \"{}\" is in no stack and deforms nothing",
                                   made.from->where.ToString(), made.from->name));
    }
  }
}

}  // namespace kpsa::engine
