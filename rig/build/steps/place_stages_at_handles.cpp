#include "rig/build/steps/place_stages_at_handles.h"

#include "rig/build/stack_parts.h"
#include "rig/graph_editor.h"

namespace kpsa::engine {
namespace {

// In the world at rest: the vertices of a wire's curve, the centre of a softMod, the transform that moves a
// cluster. None where the deformer has nothing like it, or where a computation places it.
std::optional<Places> HandlePlaces(const MadeNode& made, RestPlaces* places_at_rest, Graph* graph) {
  if (made.geometries.empty()) return std::nullopt;
  const NodeDef& def = graph->def(made.id);
  GraphEditor edit(graph);
  if (def.name == "wire") {
    Places places;
    const auto add = [&](const PlugRef& plug) {
      const Value* curve = graph->FindValue(plug);
      const Curve* asset = curve == nullptr ? nullptr : curve->asset<Curve>();
      if (asset != nullptr) places.insert(places.end(), asset->cvs().begin(), asset->cvs().end());
    };
    const PlugRef several = edit.Plug(made.id, "baseWire", 0);
    for (int i = 0; i < graph->ArraySize(made.id, several.attribute); ++i)
      add({several.node, several.attribute, i, -1});
    if (places.empty()) add(edit.Plug(made.id, "curve"));
    return places.empty() ? std::nullopt : std::optional(std::move(places));
  }
  if (edit.Has(made.id, "falloffCenter")) {
    if (const Value* center = graph->FindValue(edit.Plug(made.id, "falloffCenter")))
      return Places{center->get<Double3>()};
  }
  if (def.name != "cluster" && def.name != "softMod") return std::nullopt;
  const Connection* handle = graph->FindConnection(edit.Plug(made.id, "matrix"));
  if (handle == nullptr || graph->def(handle->source.node).FindAttribute("offsetParentMatrix") < 0)
    return std::nullopt;
  Matrix4 world;
  if (!places_at_rest->WorldOf(handle->source.node, made.from->type_node, &world)) return std::nullopt;
  return Places{{world(0, 3), world(1, 3), world(2, 3)}};
}

}  // namespace

void PlaceStagesAtHandles(const BuildInput& in, RestPlaces* places, RestPose* rest, MadeNodes* nodes,
                          Graph* graph) {
  for (MadeNode& made : *nodes) {
    if (made.world || in.errors->full()) continue;
    const std::optional<Places> handles = HandlePlaces(made, places, graph);
    for (std::size_t g = 0; g < made.geometries.size() && handles.has_value(); ++g) {
      if (const std::optional<std::size_t> mesh = made.geometries[g].mesh)
        SetWorldFromStage(in, g, rest->WorldFromMeshAt(*mesh, *handles, made.geometries[g].morphed), &made,
                          graph);
    }
  }
}

}  // namespace kpsa::engine
