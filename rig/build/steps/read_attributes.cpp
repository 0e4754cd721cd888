#include "rig/build/steps/read_attributes.h"

#include <algorithm>

#include "rig/file/words.h"

namespace kpsa::engine {
namespace {

// `targets: [smile, open]`: how the weights are written.
void NameTargets(const BuildInput& in, const MadeNode& made, Graph* graph) {
  const auto& attributes = made.from->attributes;
  const auto targets = std::find_if(attributes.begin(), attributes.end(),
                                    [](const RigAttribute& a) { return a.name == "targets"; });
  if (targets == attributes.end()) {
    in.Fail(made.from->where, Status::Invalid("blendShape \"{}\": the key \"targets\" is missing; it names "
                                              "targets of the meshes that are deformed",
                                              made.from->name));
    return;
  }
  std::vector<std::string> names;
  if (!ReadStrings(targets->value, "targets", &names, in.errors)) return;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (std::find(names.begin(), names.begin() + static_cast<std::ptrdiff_t>(i), names[i]) !=
        names.begin() + static_cast<std::ptrdiff_t>(i)) {
      in.errors->Add(targets->value, "targets: \"{}\" is named twice", names[i]);
      return;
    }
  }
  graph->SetElementNames(made.id, graph->def(made.id).FindAttribute("weight"), std::move(names));
}

void ReadAttributesOf(const BuildInput& in, MadeNode* made, PlugReader* reader, Graph* graph) {
  const NodeDef& def = graph->def(made->id);
  if (def.name == "blendShape") NameTargets(in, *made, graph);
  // Structural ones first, in whatever order they are written: points[s,t,u] needs the divisions
  for (const bool structural : {true, false}) {
    for (const RigAttribute& attribute : made->from->attributes) {
      const int number = def.FindAttribute(attribute.name);
      if ((number >= 0 && def.attributes[static_cast<std::size_t>(number)].structural) != structural)
        continue;
      if (IsRigWord(def, attribute.name)) {
        made->special[attribute.name] = &attribute;
      } else {
        reader->ReadAttribute(*made, attribute);
      }
    }
  }
}

}  // namespace

void ReadAttributes(const BuildInput& in, MadeNodes* nodes, PlugReader* reader, Graph* graph) {
  for (MadeNode& made : *nodes) {
    if (!in.errors->full()) ReadAttributesOf(in, &made, reader, graph);
  }
}

}  // namespace kpsa::engine
