#include "rig/build/steps/read_targets.h"

#include <algorithm>

namespace kpsa::engine {
namespace {

void ReadTargetsOf(const BuildInput& in, const MadeNode& made, TargetShapes* shapes, Graph* graph) {
  const auto& attributes = made.from->attributes;
  const auto targets = std::find_if(attributes.begin(), attributes.end(),
                                    [](const RigAttribute& a) { return a.name == "targets"; });
  if (targets == attributes.end()) {
    in.Fail(made.from->where, Status::Invalid("blendShape \"{}\": the key \"targets\" is missing; it names "
                                              "targets of the meshes that are deformed, or files of shapes",
                                              made.from->name));
    return;
  }
  if (!shapes->Read(made.id, *targets)) return;
  std::vector<std::string> names;
  for (const NamedTarget& target : *shapes->Find(made.id)) names.push_back(target.name);
  graph->SetElementNames(made.id, graph->def(made.id).FindAttribute("weight"), std::move(names));
}

}  // namespace

void ReadTargets(const BuildInput& in, const MadeNodes& nodes, TargetShapes* shapes, Graph* graph) {
  for (const MadeNode& made : nodes) {
    if (graph->def(made.id).name == "blendShape" && !in.errors->full())
      ReadTargetsOf(in, made, shapes, graph);
  }
}

}  // namespace kpsa::engine
