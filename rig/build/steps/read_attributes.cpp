#include "rig/build/steps/read_attributes.h"

#include "rig/file/words.h"

namespace kpsa::engine {
namespace {

void ReadAttributesOf(MadeNode* made, PlugReader* reader, Graph* graph) {
  const NodeDef& def = graph->def(made->id);
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
    if (!in.errors->full()) ReadAttributesOf(&made, reader, graph);
  }
}

}  // namespace kpsa::engine
