#include "host/settable_plug.h"

#include <cmath>

namespace kpsa::engine {

const Connection* DriverOf(const Graph& graph, const PlugRef& plug) {
  const auto overlap = [](int a, int b) { return a == b || a < 0 || b < 0; };
  for (const Connection& driver : graph.Inputs(plug.node, plug.attribute)) {
    if (overlap(driver.destination.element, plug.element) &&
        overlap(driver.destination.component, plug.component))
      return &driver;
  }
  return nullptr;
}

Status CheckSettable(const Graph& graph, const PlugRef& plug) {
  const AttributeDef& attribute = graph.def(plug.node).attributes[static_cast<std::size_t>(plug.attribute)];
  if (attribute.output) return Status::Usage("{} is an output and cannot be set", graph.PlugName(plug));
  if (attribute.structural)
    return Status::Usage("{} is structural: it is read when a rig is loaded; change it in the rig's file",
                         graph.PlugName(plug));
  if (const Type type = graph.PlugType(plug); type > Type::kDouble)
    return Status::Usage("{} is a {}: expected one number of it, as in {}.x", graph.PlugName(plug),
                         TypeName(type), graph.PlugName(plug));
  if (const Connection* driver = DriverOf(graph, plug))
    return Status::Usage("{} is driven by {} and cannot be set", graph.PlugName(plug),
                         graph.PlugName(driver->source));
  return Status();
}

Result<Value> ValueOf(const Graph& graph, const PlugRef& plug, double number) {
  Value value(number);
  if (graph.PlugType(plug) != Type::kDouble && number == std::floor(number) && std::abs(number) <= 0x1p53)
    value = Value(static_cast<std::int64_t>(number));
  KPSA_RETURN_IF_ERROR(graph.CheckValue(plug, &value));
  return value;
}

}  // namespace kpsa::engine
