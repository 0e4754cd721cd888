#include "rig/build/steps/place_falloffs.h"

#include <set>

#include "rig/graph_editor.h"

namespace kpsa::engine {
namespace {

// Whether points and driver are measured in one space. In mesh space both are where they rest, unless a
// parent carries them.
bool FitsDriver(NodeId falloff, const MadeNode& deformer, Graph* graph) {
  GraphEditor edit(graph);
  if (!edit.Has(falloff, "driverMatrix")) return true;
  const PlugRef parent = edit.Plug(falloff, "parentMatrix");
  const bool carried = graph->FindConnection(parent) != nullptr || graph->FindValue(parent) != nullptr;
  const bool world = graph->FindValue(edit.Plug(falloff, "driverMatrix")) == nullptr;
  return carried || world == deformer.world ||
         graph->FindConnection(edit.Plug(falloff, "driverPoints")) == nullptr;
}

}  // namespace

void PlaceFalloffs(const BuildInput& in, const std::vector<FalloffUse>& uses, const MadeNodes& nodes,
                   Graph* graph) {
  std::set<Index> refused;
  for (const FalloffUse& use : uses) {
    const MadeNode* deformer = nodes.Find(use.deformer);
    const MadeNode* falloff = nodes.Find(use.falloff);
    if (deformer == nullptr || falloff == nullptr) continue;
    const DeformedGeometry& of = deformer->geometries[static_cast<std::size_t>(use.geometry)];
    const RigAttribute* driver = falloff->Find("driver");
    if (driver != nullptr && !FitsDriver(use.falloff, *deformer, graph) &&
        refused.insert(use.falloff.index).second) {
      const YamlNode& name = driver->value;
      in.errors->Add(
          name,
          "\"{}\" weighs {} in {}, and the driver \"{}\" is in {}: name a stage of the driver in the "
          "same space, or the parent that carries what is in mesh space",
          falloff->from->name, of.name, SpaceName(deformer->world), name.scalar, SpaceName(!deformer->world));
    }
    if (deformer->world) continue;
    GraphEditor edit(graph);
    edit.Set(use.falloff, "geometryMatrix", use.element, of.world_from_stage);
    in.Fail(falloff->from->where, edit.Take());
  }
}

}  // namespace kpsa::engine
