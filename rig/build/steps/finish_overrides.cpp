#include "rig/build/steps/finish_overrides.h"

namespace kpsa::engine {

void FinishOverrides(const BuildInput& in, const OverriddenPlugs& overridden, const PlugKeys& stacked,
                     std::vector<PlugRef>* pinned, Graph* graph) {
  for (const auto& [plug, by_value] : overridden.plugs) {
    if (!by_value || stacked.count(KeyOf(plug)) != 0) continue;
    if (graph->FindConnection(plug) != nullptr) in.Fail(SourceLocation(), graph->Disconnect(plug));
    if (IsClipPlug(in.rig.scene, *graph, plug)) pinned->push_back(plug);
  }
}

}  // namespace kpsa::engine
