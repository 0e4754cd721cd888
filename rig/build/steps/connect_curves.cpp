#include "rig/build/steps/connect_curves.h"

#include "rig/graph_editor.h"

namespace kpsa::engine {
namespace {

// The rest of a curve node is set by now, or has its own error.
std::optional<NodeId> FindCurve(const BuildInput& in, const YamlNode& value, Graph* graph) {
  std::string name;
  if (!ReadString(value, "curve", &name, in.errors)) return std::nullopt;
  const Result<NodeId> curve = graph->FindNode(name);
  if (!curve.ok()) {
    in.errors->Add(value, curve.status());
    return std::nullopt;
  }
  if (graph->def(*curve).name != "curve") {
    in.errors->Add(value, "\"{}\" is a {}; expected a curve", name, graph->def(*curve).name);
    return std::nullopt;
  }
  GraphEditor edit(graph);
  const bool set = graph->FindValue(edit.Plug(*curve, "curve")) != nullptr;
  return set ? std::optional(*curve) : std::nullopt;
}

}  // namespace

void ConnectCurves(const BuildInput& in, const MadeNodes& nodes, Graph* graph) {
  for (const MadeNode& made : nodes) {
    const RigAttribute *one = made.Find("curve"), *several = made.Find("curves");
    GraphEditor edit(graph);
    const auto follow = [&](const YamlNode& value, const char* rest, const char* displacements, int element) {
      const std::optional<NodeId> curve = FindCurve(in, value, graph);
      if (!curve.has_value()) return;
      edit.Set(made.id, rest, element, *graph->FindValue(edit.Plug(*curve, "curve")));
      edit.Connect(edit.Plug(*curve, "displacements"), edit.Plug(made.id, displacements, element));
      if (edit.Has(made.id, "curveMatrix"))
        edit.Connect(edit.Plug(*curve, "worldMatrix"), edit.Plug(made.id, "curveMatrix"));
      in.Fail(value.where(), edit.Take());
    };
    if (one != nullptr) follow(one->value, "curve", "displacements", -1);
    if (several == nullptr) continue;
    const YamlNode& list = several->value;
    if (one != nullptr) {
      in.errors->Add(several->key, "\"{}\" has a curve, too: write all of them in curves", made.from->name);
    } else if (!list.is_sequence() || list.items.empty()) {
      in.errors->Add(list, "curves: expected a list of curves, as in [lipsUp, lipsLow]");
    } else {
      for (std::size_t i = 0; i < list.items.size(); ++i)
        follow(list.items[i], "baseWire", "deformedWire", static_cast<int>(i));
    }
  }
}

}  // namespace kpsa::engine
