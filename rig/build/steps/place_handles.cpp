#include "rig/build/steps/place_handles.h"

#include "rig/graph_editor.h"

namespace kpsa::engine {

void PlaceHandles(const BuildInput& in, RestPlaces* places, MadeNodes* nodes, Graph* graph) {
  for (MadeNode& made : *nodes) {
    if (graph->def(made.id).FindAttribute("offsetParentMatrix") < 0) continue;
    if (!places->Place(&made)) continue;
    GraphEditor edit(graph);
    if (!edit.Has(made.id, "restMatrix")) continue;
    const Value* offset = graph->FindValue(edit.Plug(made.id, "offsetParentMatrix"));
    if (offset != nullptr && graph->FindValue(edit.Plug(made.id, "restMatrix")) == nullptr)
      edit.Set(made.id, "restMatrix", *offset);
    in.Fail(made.from->where, edit.Take());
  }
}

}  // namespace kpsa::engine
