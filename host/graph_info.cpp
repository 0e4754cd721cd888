#include "kpsa/graph_info.h"

#include <algorithm>

#include "graph/authored.h"
#include "graph/instances.h"
#include "host/face_impl.h"
#include "host/problems.h"

namespace kpsa {
namespace {

PlugInfo InfoOf(const engine::Graph& graph, engine::NodeId node, int number) {
  constexpr const char* kUnits[] = {"", "length", "angle", "time"};
  const engine::AttributeDef& attribute = graph.def(node).attributes[static_cast<std::size_t>(number)];
  PlugInfo plug;
  plug.name = attribute.name;
  plug.type = engine::TypeName(attribute.type);
  plug.unit = kUnits[static_cast<int>(attribute.unit)];
  plug.doc = attribute.doc;
  plug.output = attribute.output;
  plug.structural = attribute.structural;
  plug.array = attribute.array;
  if (attribute.array) plug.elements = static_cast<std::size_t>(graph.ArraySize(node, number));
  plug.choices = attribute.enum_names;
  return plug;
}

PlugValue ValueOf(const engine::AttributeDef& attribute, const engine::Value& value, int component,
                  double si) {
  PlugValue held;
  if (attribute.type == engine::Type::kEnum) {
    const auto choice = static_cast<std::size_t>(value.AsInt());
    if (choice < attribute.enum_names.size()) return {{}, attribute.enum_names[choice]};
  }
  double one = 0;
  const std::span<const double> numbers = engine::NumbersOf(value, &one);
  held.numbers.assign(numbers.begin(), numbers.end());
  if (const auto* whole = value.get_if<std::vector<std::int64_t>>())
    held.numbers.assign(whole->begin(), whole->end());
  if (const auto* list = value.get_if<std::vector<double>>()) held.numbers = *list;
  for (double& number : held.numbers) number /= si;
  if (component >= 0) held.numbers = {held.numbers[static_cast<std::size_t>(component)]};
  const bool list =
      value.get_if<std::vector<double>>() != nullptr || value.get_if<std::vector<std::int64_t>>() != nullptr;
  if (held.numbers.empty() && !list) held.text = value.empty() ? "" : value.ToString();
  return held;
}

}  // namespace

std::vector<NodeInfo> Rig::Nodes() const {
  const engine::Graph& graph = *impl_->rest.graph;
  std::vector<NodeInfo> nodes;
  for (const engine::NodeId id : graph.Nodes()) {
    NodeInfo node{graph.name(id), graph.def(id).name, "", 0, 0, {}};
    if (const auto place = impl_->rest.node_places.find(node.name); place != impl_->rest.node_places.end())
      node.file = place->second.file, node.line = place->second.line, node.column = place->second.column;
    for (std::size_t a = 0; a < graph.def(id).attributes.size(); ++a)
      node.plugs.push_back(InfoOf(graph, id, static_cast<int>(a)));
    nodes.push_back(std::move(node));
  }
  return nodes;
}

std::vector<ConnectionInfo> Rig::Connections() const {
  const engine::Graph& graph = *impl_->rest.graph;
  std::vector<ConnectionInfo> connections;
  for (const engine::NodeId id : graph.Nodes()) {
    for (const engine::Connection& connection : graph.Inputs(id))
      connections.push_back({graph.PlugName(connection.source), graph.PlugName(connection.destination)});
  }
  return connections;
}

kpsa::Result<PlugValue> Rig::Value(std::string_view name) const {
  const engine::Graph& graph = *impl_->rest.graph;
  const auto failed = [&](engine::Status status) {
    return engine::ProblemsOf(std::move(status).At({impl_->rest.path}));
  };
  const engine::Result<engine::PlugRef> plug = graph.FindPlug(name);
  if (!plug.ok()) return failed(plug.status());
  const engine::AttributeDef& attribute =
      graph.def(plug->node).attributes[static_cast<std::size_t>(plug->attribute)];
  const std::string& node = graph.name(plug->node);
  if (attribute.output)
    return failed(engine::Status::Usage("{} is an output: Scene::Values evaluates it", name).OfNode(node));
  if (engine::IsPointType(attribute.type) && !attribute.array && plug->element >= 0)
    return failed(
        engine::Status::Usage("{} is a part of points: expected a plug of its own", name).OfNode(node));
  const engine::Request nothing;
  engine::InstanceTable table(graph, nothing);
  try {
    const engine::Value& value = *table.HeldValue(plug->node, plug->attribute, plug->element);
    return ValueOf(attribute, value, plug->component, impl_->rest.units.FactorOf(attribute.unit));
  } catch (const engine::NodeFailure& failure) {  // its default, which follows from others
    return failed(failure.status);
  }
}

}  // namespace kpsa
