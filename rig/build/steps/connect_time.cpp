#include "rig/build/steps/connect_time.h"

#include "rig/graph_editor.h"

namespace kpsa::engine {

void ConnectTime(const BuildInput& in, const MadeNodes& nodes, Graph* graph) {
  for (const MadeNode& made : nodes) {
    if (!graph->def(made.id).stateful || graph->def(made.id).FindAttribute("time") < 0) continue;
    GraphEditor edit(graph);
    const PlugRef time = edit.Plug(made.id, "time");
    if (graph->FindValue(time) != nullptr || graph->FindConnection(time) != nullptr) continue;
    edit.Connect(in.rig.scene.time, time);
    in.Fail(made.from->where, edit.Take());
  }
}

}  // namespace kpsa::engine
