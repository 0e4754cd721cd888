#include "graph/graph.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "base/check.h"

namespace kpsa {

const Graph::Node& Graph::node(NodeId id) const {
  KPSA_CHECK(IsAlive(id));
  return nodes_[id.index];
}
Graph::Node& Graph::node(NodeId id) { return const_cast<Node&>(std::as_const(*this).node(id)); }

bool Graph::IsAlive(NodeId id) const {
  return id.index < nodes_.size() && nodes_[id.index].def != nullptr && nodes_[id.index].version == id.version;
}
const NodeDef& Graph::def(NodeId id) const { return *node(id).def; }
const std::string& Graph::name(NodeId id) const { return node(id).name; }
const std::vector<Connection>& Graph::Inputs(NodeId id) const { return node(id).inputs; }
const std::vector<Connection>& Graph::Outputs(NodeId id) const { return node(id).outputs; }

NodeId Graph::IdAt(Index index) const {
  if (index >= nodes_.size() || nodes_[index].def == nullptr) return NodeId();
  return {index, nodes_[index].version};
}

std::vector<NodeId> Graph::Nodes() const {
  std::vector<NodeId> ids;
  for (Index i = 0; i < nodes_.size(); ++i) {
    if (nodes_[i].def != nullptr) ids.push_back({i, nodes_[i].version});
  }
  return ids;
}

Result<NodeId> Graph::AddNode(std::string_view type, std::string_view name) {
  const NodeDef* def = registry_->Find(type);
  if (def == nullptr) {
    return Status::Invalid("unknown node type \"{}\"{}", type, DidYouMean(type, registry_->Names()));
  }
  std::string key(name);
  if (by_name_.count(key) != 0 || ambiguous_.count(key) != 0) {
    return Status::Invalid("a node named \"{}\" exists already", name);
  }
  const auto index = static_cast<Index>(nodes_.size());
  Node node;
  node.def = def;
  node.name = key;
  node.version = 1;
  nodes_.push_back(std::move(node));
  by_name_.emplace(std::move(key), index);
  return NodeId{index, 1};
}

Status Graph::RemoveNode(NodeId id) {
  if (!IsAlive(id)) return Status::Invalid("the node was removed before");
  Node& removed = nodes_[id.index];
  const auto touches = [&](const Connection& c) { return c.source.node == id || c.destination.node == id; };
  for (const Connection& c : removed.inputs) {
    auto& list = nodes_[c.source.node.index].outputs;
    if (!(c.source.node == id)) list.erase(std::remove_if(list.begin(), list.end(), touches), list.end());
  }
  for (const Connection& c : removed.outputs) {
    auto& list = nodes_[c.destination.node.index].inputs;
    if (!(c.destination.node == id)) list.erase(std::remove_if(list.begin(), list.end(), touches), list.end());
  }
  for (auto it = by_name_.begin(); it != by_name_.end();) it = it->second == id.index ? by_name_.erase(it) : std::next(it);
  const std::uint32_t version = removed.version + 1;
  removed = Node();
  removed.version = version;
  return Status();
}

Type Graph::PlugType(const PlugRef& plug) const {
  const AttributeDef& a = def(plug.node).attributes[static_cast<std::size_t>(plug.attribute)];
  if (plug.component >= 0) return Type::kDouble;
  if (IsPointType(a.type) && !a.array && plug.element >= 0) {
    return a.type == Type::kWeights ? Type::kDouble : Type::kDouble3;
  }
  return a.type;
}

std::string Graph::PlugName(const PlugRef& plug) const {
  if (!IsAlive(plug.node)) return "(removed node)";
  const Node& n = node(plug.node);
  std::string text = n.name + "." + n.def->attributes[static_cast<std::size_t>(plug.attribute)].name;
  if (plug.element >= 0) {
    const std::vector<std::string>* names = ElementNames(plug.node, plug.attribute);
    if (names != nullptr && plug.element < static_cast<int>(names->size()) && !(*names)[static_cast<std::size_t>(plug.element)].empty()) {
      text += "[" + (*names)[static_cast<std::size_t>(plug.element)] + "]";
    } else {
      text += fmt::format("[{}]", plug.element);
    }
  }
  if (plug.component >= 0) text += fmt::format(".{}", "xyzw"[plug.component]);
  return text;
}

Status Graph::CheckPlug(const PlugRef& plug) const {
  if (!IsAlive(plug.node)) return Status::Invalid("a plug of a node that was removed");
  const NodeDef& d = def(plug.node);
  KPSA_CHECK(plug.attribute >= 0 && plug.attribute < static_cast<int>(d.attributes.size()));
  const AttributeDef& a = d.attributes[static_cast<std::size_t>(plug.attribute)];
  if (a.array && plug.element < 0) {
    return Status::Invalid("{} is an array: name an element, {}[0]", PlugName(plug), PlugName(plug));
  }
  if (!a.array && plug.element >= 0 && !IsPointType(a.type)) {
    return Status::Invalid("{}.{} is no array", name(plug.node), a.name);
  }
  if (plug.component >= 0) {
    PlugRef whole = plug;
    whole.component = -1;
    const Type type = PlugType(whole);
    const int components = type == Type::kDouble3 ? 3 : type == Type::kQuaternion ? 4 : 0;
    if (plug.component >= components) return Status::Invalid("{} has no component .{}", PlugName(whole), "xyzw"[plug.component]);
  }
  return Status();
}

Status Graph::Set(const PlugRef& plug, Value value) {
  KPSA_RETURN_IF_ERROR(CheckPlug(plug));
  const AttributeDef& a = def(plug.node).attributes[static_cast<std::size_t>(plug.attribute)];
  if (a.output) return Status::Invalid("{} is an output and cannot be set", PlugName(plug));
  const Type type = PlugType(plug);
  if (type == Type::kEnum) {
    if (const std::string* text = value.get_if<std::string>()) {
      const auto it = std::find(a.enum_names.begin(), a.enum_names.end(), *text);
      if (it == a.enum_names.end()) {
        return Status::Invalid("{} has no choice \"{}\"; expected one of {}{}", PlugName(plug), *text,
                               fmt::join(a.enum_names, ", "), DidYouMean(*text, a.enum_names));
      }
      value = Value(static_cast<std::int64_t>(it - a.enum_names.begin()));
    } else if (value.AsInt() < 0 || value.AsInt() >= static_cast<std::int64_t>(a.enum_names.size())) {
      return Status::Invalid("{} has no choice {}; expected one of {}", PlugName(plug), value.ToString(), fmt::join(a.enum_names, ", "));
    }
  }
  if (!value.FitsType(type)) {
    return Status::Invalid("{} takes a {}, not {}", PlugName(plug), TypeName(type), value.ToString());
  }
  if (value.get_if<double>() != nullptr || value.get_if<std::int64_t>() != nullptr) {
    const double number = value.AsDouble();
    if (!std::isfinite(number)) return Status::Invalid("{} takes a finite number, not {}", PlugName(plug), number);
    if (number < a.min || number > a.max) {
      return Status::Invalid("{} = {} is outside of {} to {}", PlugName(plug), number, a.min, a.max);
    }
  }
  for (SetValue& set : node(plug.node).values) {
    if (set.attribute == plug.attribute && set.element == plug.element && set.component == plug.component) {
      set.value = std::move(value);
      return Status();
    }
  }
  node(plug.node).values.push_back({plug.attribute, plug.element, plug.component, std::move(value)});
  return Status();
}

Status Graph::Unset(const PlugRef& plug) {
  KPSA_RETURN_IF_ERROR(CheckPlug(plug));
  auto& values = node(plug.node).values;
  values.erase(std::remove_if(values.begin(), values.end(),
                              [&](const SetValue& set) {
                                return set.attribute == plug.attribute && set.element == plug.element && set.component == plug.component;
                              }),
               values.end());
  return Status();
}

const Value* Graph::FindValue(const PlugRef& plug) const {
  for (const SetValue& set : node(plug.node).values) {
    if (set.attribute == plug.attribute && set.element == plug.element && set.component == plug.component) return &set.value;
  }
  return nullptr;
}

const Connection* Graph::FindConnection(const PlugRef& destination) const {
  for (const Connection& c : node(destination.node).inputs) {
    if (c.destination == destination) return &c;
  }
  return nullptr;
}

int Graph::ArraySize(NodeId id, int attribute) const {
  int size = 0;
  const Node& n = node(id);
  for (const SetValue& set : n.values) {
    if (set.attribute == attribute) size = std::max(size, set.element + 1);
  }
  for (const Connection& c : n.inputs) {
    if (c.destination.attribute == attribute) size = std::max(size, c.destination.element + 1);
  }
  if (const auto* names = ElementNames(id, attribute)) size = std::max(size, static_cast<int>(names->size()));
  return size;
}

void Graph::SetElementNames(NodeId id, int attribute, std::vector<std::string> names) {
  for (auto& [number, existing] : node(id).element_names) {
    if (number == attribute) {
      existing = std::move(names);
      return;
    }
  }
  node(id).element_names.emplace_back(attribute, std::move(names));
}

const std::vector<std::string>* Graph::ElementNames(NodeId id, int attribute) const {
  for (const auto& [number, names] : node(id).element_names) {
    if (number == attribute) return &names;
  }
  return nullptr;
}

void Graph::AddAlias(NodeId id, std::string alias) {
  if (auto it = ambiguous_.find(alias); it != ambiguous_.end()) {
    it->second.push_back(id.index);
    return;
  }
  auto [it, added] = by_name_.emplace(alias, id.index);
  if (added || it->second == id.index) return;
  ambiguous_[alias] = {it->second, id.index};
  by_name_.erase(it);
}

void Graph::AddDelegate(NodeId id, NodeId delegate) { node(id).delegates.push_back(delegate); }

Status Graph::Connect(const PlugRef& source, const PlugRef& destination, bool replace) {
  KPSA_RETURN_IF_ERROR(CheckPlug(source));
  KPSA_RETURN_IF_ERROR(CheckPlug(destination));
  const AttributeDef& from = def(source.node).attributes[static_cast<std::size_t>(source.attribute)];
  const AttributeDef& to = def(destination.node).attributes[static_cast<std::size_t>(destination.attribute)];
  if (to.output) return Status::Invalid("{} is an output and takes no connection", PlugName(destination));
  if (IsPointType(from.type) && !from.array && source.element >= 0) {
    return Status::Invalid("{}: a single point cannot be a source", PlugName(source));
  }
  const Type a = PlugType(source), b = PlugType(destination);
  const bool integral = a == Type::kBool || a == Type::kInt || a == Type::kEnum;
  const bool fits = a == b || (integral && (b == Type::kDouble || b == Type::kBool || b == Type::kInt || b == Type::kEnum)) ||
                    (a == Type::kDouble && (b == Type::kBool || b == Type::kInt || b == Type::kEnum));
  if (!fits) {
    return Status::Invalid("{} is a {} and cannot drive {}, a {}", PlugName(source), TypeName(a), PlugName(destination), TypeName(b));
  }
  for (const Connection& c : node(destination.node).inputs) {
    const PlugRef& d = c.destination;
    const bool overlaps = d.attribute == destination.attribute && d.element == destination.element &&
                          (d.component == destination.component || d.component < 0 || destination.component < 0);
    if (!overlaps) continue;
    if (!replace || d.component != destination.component) {
      return Status::Invalid("{} is driven by {} already", PlugName(d), PlugName(c.source));
    }
    KPSA_RETURN_IF_ERROR(Disconnect(d));
    break;
  }
  KPSA_RETURN_IF_ERROR(CheckCycle(source, destination));
  node(source.node).outputs.push_back({source, destination});
  node(destination.node).inputs.push_back({source, destination});
  return Status();
}

Status Graph::Disconnect(const PlugRef& destination) {
  KPSA_RETURN_IF_ERROR(CheckPlug(destination));
  auto& inputs = node(destination.node).inputs;
  const auto it = std::find_if(inputs.begin(), inputs.end(), [&](const Connection& c) { return c.destination == destination; });
  if (it == inputs.end()) return Status::Invalid("{} has no connection", PlugName(destination));
  auto& outputs = node(it->source.node).outputs;
  outputs.erase(std::find_if(outputs.begin(), outputs.end(), [&](const Connection& c) { return c.destination == destination; }));
  inputs.erase(it);
  return Status();
}

Status Graph::CheckCycle(const PlugRef& source, const PlugRef& destination) const {
  if (source.node != destination.node && (node(destination.node).outputs.empty() || node(source.node).inputs.empty())) return Status();
  // Walk forward from the destination through the groups that read it, looking for the source. A state is an
  // attribute of a node, with its element where the group works element by element.
  struct State {
    Index node;
    int attribute, element;
    std::size_t parent;
  };
  std::vector<State> states{{destination.node.index, destination.attribute, destination.element, 0}};
  std::map<std::tuple<Index, int, int>, bool> seen;
  const auto visit = [&](Index n, int attribute, int element, std::size_t parent) {
    if (seen.emplace(std::make_tuple(n, attribute, element), true).second) states.push_back({n, attribute, element, parent});
  };
  for (std::size_t at = 0; at < states.size(); ++at) {
    const State state = states[at];
    const Node& n = nodes_[state.node];
    if (state.node == source.node.index && state.attribute == source.attribute &&
        (state.element == source.element || state.element < 0 || source.element < 0)) {
      std::vector<std::string> path;
      for (std::size_t i = at;; i = states[i].parent) {
        path.push_back(nodes_[states[i].node].name + "." + nodes_[states[i].node].def->attributes[static_cast<std::size_t>(states[i].attribute)].name);
        if (i == 0) break;
      }
      std::reverse(path.begin(), path.end());
      constexpr std::size_t kShown = 24;
      if (path.size() > kShown) path = {path.front(), "...", path.back()};
      return Status::Invalid("{} -> {} would make a cycle: {} -> {}", PlugName(source), PlugName(destination),
                             fmt::join(path, " -> "), path.front());
    }
    for (const Connection& c : n.outputs) {  // an output, or an input that is read on as a source
      if (c.source.attribute == state.attribute && (c.source.element == state.element || state.element < 0)) {
        visit(c.destination.node.index, c.destination.attribute, c.destination.element, at);
      }
    }
    const AttributeDef& a = n.def->attributes[static_cast<std::size_t>(state.attribute)];
    if (a.output) continue;
    for (const ComputeGroup& group : n.def->groups) {
      const bool reads = a.structural || std::find(group.inputs.begin(), group.inputs.end(), state.attribute) != group.inputs.end();
      if (!reads) continue;
      for (int output : group.outputs) visit(state.node, output, group.per_geometry && a.per_geometry ? state.element : -1, at);
    }
  }
  return Status();
}

}  // namespace kpsa
