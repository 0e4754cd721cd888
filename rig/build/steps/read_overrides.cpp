#include "rig/build/steps/read_overrides.h"

#include <vector>

namespace kpsa::engine {
namespace {

const AttributeDef& AttributeOf(const Graph& graph, const PlugRef& plug) {
  return graph.def(plug.node).attributes[static_cast<std::size_t>(plug.attribute)];
}

void ReadOverride(const BuildInput& in, const RigOverride& override_, PlugReader* reader, Graph* graph) {
  const Result<PlugRef> plug = graph->FindPlug(override_.plug.text);
  if (plug.ok()) {
    reader->ReadPlug(*plug, override_.value, override_.plug.source, true);
    return;
  }
  // A list for a whole array: its elements, and no others
  const Result<PlugRef> first = graph->FindPlug(override_.plug.text + "[0]");
  if (!first.ok() || !AttributeOf(*graph, *first).array || !override_.value.is_sequence()) {
    in.FailPlug(override_.plug.where, override_.plug.text, plug.status());
    return;
  }
  PlugRef element = *first;
  const int before = graph->ArraySize(element.node, element.attribute),
            now = static_cast<int>(override_.value.items.size());
  for (; element.element < now; ++element.element) {
    if (in.errors->full() || !in.Fail(override_.plug.where, graph->CheckPlug(element))) return;
    reader->ReadPlug(element, override_.value.items[static_cast<std::size_t>(element.element)],
                     override_.plug.source, true);
  }
  for (; element.element < before; ++element.element) {
    in.Fail(override_.plug.where, graph->Unset(element));
    reader->Override(element, true);
  }
}

}  // namespace

void ReadOverrides(const BuildInput& in, PlugReader* reader, Graph* graph) {
  const auto is_structural = [&](const RigOverride& override_) {
    const Result<PlugRef> plug = graph->FindPlug(override_.plug.text);
    return plug.ok() && AttributeOf(*graph, *plug).structural;
  };
  std::vector<const RigOverride*> others;
  for (const RigOverride& override_ : in.file.overrides) {
    if (in.errors->full()) return;
    if (is_structural(override_)) {
      ReadOverride(in, override_, reader, graph);
    } else {
      others.push_back(&override_);
    }
  }
  for (const RigOverride* override_ : others) {
    if (in.errors->full()) return;
    ReadOverride(in, *override_, reader, graph);
  }
}

}  // namespace kpsa::engine
