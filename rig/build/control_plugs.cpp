#include "rig/build/control_plugs.h"

#include <algorithm>

namespace kpsa::engine {
namespace {

PlugRef WholeOf(PlugRef plug) {
  plug.component = -1;
  return plug;
}

}  // namespace

double RestValueOf(const Graph& graph, const PlugRef& plug) {
  if (const Value* value = graph.FindValue(plug)) return value->AsDouble();
  const Value* set = graph.FindValue(WholeOf(plug));
  const AttributeDef& attribute = graph.def(plug.node).attributes[static_cast<std::size_t>(plug.attribute)];
  const Value& base = set != nullptr ? *set : attribute.default_value;
  const Double3* triple = base.get_if<Double3>();
  return triple != nullptr && plug.component >= 0 ? (*triple)[plug.component] : base.AsDouble();
}

const Connection* DriverBesidesClips(const CharacterGraph& scene, const Graph& graph, const PlugRef& plug) {
  const Connection* driver = graph.FindConnection(plug);
  if (driver == nullptr) driver = graph.FindConnection(WholeOf(plug));
  if (driver == nullptr) return nullptr;
  const bool clip = std::ranges::find(scene.clip_nodes, driver->source.node) != scene.clip_nodes.end();
  return clip ? nullptr : driver;
}

}  // namespace kpsa::engine
