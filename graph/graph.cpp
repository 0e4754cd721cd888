#include "graph/graph.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <tuple>
#include <unordered_set>

#include "base/check.h"

namespace kpsa::engine {
namespace {

// Order of plugs within a node.
auto KeyOf(const PlugRef& plug) { return std::make_tuple(plug.attribute, plug.element, plug.component); }

// Elements of a sorted list whose plugs lie between two keys, both included.
template <typename List, typename Projection>
auto Range(List& list, const PlugRef& first, const PlugRef& last, Projection plug_of) {
  const auto begin =
      std::lower_bound(list.begin(), list.end(), KeyOf(first),
                       [&](const auto& e, const auto& key) { return KeyOf(plug_of(e)) < key; });
  const auto end = std::upper_bound(begin, list.end(), KeyOf(last),
                                    [&](const auto& key, const auto& e) { return key < KeyOf(plug_of(e)); });
  return std::make_pair(begin, end);
}

constexpr int kLast = std::numeric_limits<int>::max();
const auto kDestination = [](const Connection& c) -> const PlugRef& { return c.destination; };
const auto kPlug = [](const auto& set) -> const PlugRef& { return set.plug; };

PlugRef At(int attribute, int element, int component) { return {NodeId(), attribute, element, component}; }

// The last plug, in the order above, that could be the plug itself, a point or a component of it.
PlugRef LastChild(PlugRef plug) {
  if (plug.component < 0) {
    plug.component = kLast;
    if (plug.element < 0) plug.element = kLast;
  }
  return plug;
}

}  // namespace

const Graph::Node& Graph::node(NodeId id) const {
  KPSA_CHECK(IsAlive(id));
  return nodes_[id.index];
}
Graph::Node& Graph::node(NodeId id) { return const_cast<Node&>(std::as_const(*this).node(id)); }

bool Graph::IsAlive(NodeId id) const {
  return id.index < nodes_.size() && nodes_[id.index].def != nullptr &&
         nodes_[id.index].version == id.version;
}
const NodeDef& Graph::def(NodeId id) const { return *node(id).def; }
const std::string& Graph::name(NodeId id) const { return node(id).name; }
const std::vector<Connection>& Graph::Inputs(NodeId id) const { return node(id).inputs; }
const std::vector<Connection>& Graph::Outputs(NodeId id) const { return node(id).outputs; }

std::span<const Connection> Graph::Inputs(NodeId id, int attribute) const {
  const auto [begin, end] =
      Range(node(id).inputs, At(attribute, -1, -1), At(attribute, kLast, kLast), kDestination);
  return {begin, end};
}

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

Graph::Graph(const NodeRegistry& registry) : registry_(&registry), registry_status_(registry.status()) {}

Result<NodeId> Graph::AddNode(std::string_view type, std::string_view name) {
  if (!registry_status_.ok()) return registry_status_;
  const NodeDef* def = registry_->Find(type);
  if (def == nullptr) {
    return Status::Invalid("unknown node type \"{}\"{}", type, DidYouMean(type, registry_->Names()));
  }
  std::string key(name);
  if (by_name_.count(key) != 0) return Status::Invalid("a node named \"{}\" exists already", name);
  if (const auto it = by_alias_.find(key); it != by_alias_.end()) {
    return Status::Invalid("\"{}\" is another name of node \"{}\" already", name,
                           nodes_[it->second.front()].name);
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
    if (!(c.destination.node == id))
      list.erase(std::remove_if(list.begin(), list.end(), touches), list.end());
  }
  by_name_.erase(removed.name);
  for (const std::string& alias : removed.aliases) {
    const auto it = by_alias_.find(alias);
    it->second.erase(std::remove(it->second.begin(), it->second.end(), id.index), it->second.end());
    if (it->second.empty()) by_alias_.erase(it);
  }
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
    if (names != nullptr && plug.element < static_cast<int>(names->size()) &&
        !(*names)[static_cast<std::size_t>(plug.element)].empty()) {
      text += "[" + (*names)[static_cast<std::size_t>(plug.element)] + "]";
    } else {
      text += fmt::format("[{}]", plug.element);
    }
  }
  if (plug.component >= 0) text += fmt::format(".{}", "xyzw"[plug.component]);
  return text;
}

int Graph::MaxElements(const AttributeDef& attribute) {
  return attribute.array ? kMaxArrayElements : 1 << 24;
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
  if (plug.element >= MaxElements(a)) {
    return Status::Invalid("{}.{}[{}]: an index must be below {}", name(plug.node), a.name, plug.element,
                           MaxElements(a));
  }
  if (plug.component >= 0) {
    KPSA_CHECK_LT(plug.component, 4);
    PlugRef whole = plug;
    whole.component = -1;
    const Type type = PlugType(whole);
    const int components = type == Type::kDouble3 ? 3 : type == Type::kQuaternion ? 4 : 0;
    if (plug.component >= components)
      return Status::Invalid("{} has no component .{}", PlugName(whole), "xyzw"[plug.component]);
  }
  return Status();
}

// Numbers must be finite, and within the attribute's range.
Status Graph::CheckNumbers(const PlugRef& plug, const Value& value) const {
  const AttributeDef& a = def(plug.node).attributes[static_cast<std::size_t>(plug.attribute)];
  double number = 0;
  std::span<const double> numbers = NumbersOf(value, &number);
  if (const auto* v = value.get_if<std::vector<double>>()) numbers = *v;
  for (double v : numbers) {
    if (!std::isfinite(v))
      return Status::Invalid("{} takes finite numbers, not {}", PlugName(plug), value.ToString());
    if (v < a.min || v > a.max)
      return Status::Invalid("{} = {} is outside of {} to {}", PlugName(plug), value.ToString(), a.min,
                             a.max);
  }
  if (const PointBuffer* points = value.points()) {
    const ConstPointsView view = points->view();
    for (const float* component : {view.x, view.y, view.z}) {
      for (std::size_t i = 0; component != nullptr && i < view.count; ++i) {
        if (!std::isfinite(component[i]))
          return Status::Invalid("{}: point {} is not finite", PlugName(plug), i);
      }
    }
  }
  return Status();
}

Status Graph::CheckValue(const PlugRef& plug, Value* value) const {
  KPSA_RETURN_IF_ERROR(CheckPlug(plug));
  const AttributeDef& a = def(plug.node).attributes[static_cast<std::size_t>(plug.attribute)];
  if (a.output) return Status::Invalid("{} is an output and cannot be set", PlugName(plug));
  const Type type = PlugType(plug);
  if (type == Type::kEnum) {
    if (const std::string* text = value->get_if<std::string>()) {
      const auto it = std::find(a.enum_names.begin(), a.enum_names.end(), *text);
      if (it == a.enum_names.end()) {
        return Status::Invalid("{} has no choice \"{}\"; expected one of {}{}", PlugName(plug), *text,
                               fmt::join(a.enum_names, ", "), DidYouMean(*text, a.enum_names));
      }
      *value = Value(static_cast<std::int64_t>(it - a.enum_names.begin()));
    } else if (value->FitsType(type) &&
               (value->AsInt() < 0 || value->AsInt() >= static_cast<std::int64_t>(a.enum_names.size()))) {
      return Status::Invalid("{} has no choice {}; expected one of {}", PlugName(plug), value->ToString(),
                             fmt::join(a.enum_names, ", "));
    }
  }
  if (!value->FitsType(type)) {
    return Status::Invalid("{} takes a {}, not {}", PlugName(plug), TypeName(type), value->ToString());
  }
  return CheckNumbers(plug, *value);
}

Status Graph::Set(const PlugRef& plug, Value value) {
  KPSA_RETURN_IF_ERROR(CheckValue(plug, &value));
  auto& values = node(plug.node).values;
  const auto [begin, end] = Range(values, plug, LastChild(plug), kPlug);
  if (begin == end) {
    values.insert(begin, {plug, std::move(value)});
  } else {
    *begin = {plug, std::move(value)};
    values.erase(begin + 1, end);
  }
  return Status();
}

Status Graph::Unset(const PlugRef& plug) {
  KPSA_RETURN_IF_ERROR(CheckPlug(plug));
  auto& values = node(plug.node).values;
  const auto [begin, end] = Range(values, plug, plug, kPlug);
  values.erase(begin, end);
  return Status();
}

Status Graph::Pose(const PlugRef& plug, Value value) {
  KPSA_RETURN_IF_ERROR(CheckPlug(plug));
  const bool first = !IsPosed(plug.node, plug.attribute);
  const std::span<const SetValue> set = Values(plug.node, plug.attribute);
  std::vector<SetValue> before(set.begin(), set.end());
  KPSA_RETURN_IF_ERROR(Set(plug, std::move(value)));
  Node& n = node(plug.node);
  if (std::none_of(n.written.begin(), n.written.end(),
                   [&](const auto& entry) { return entry.first == plug.attribute; }))
    n.written.emplace_back(plug.attribute, before);
  if (first && !n.def->attributes[static_cast<std::size_t>(plug.attribute)].structural)
    n.unposed.emplace_back(plug.attribute, std::move(before));
  return Status();
}

void Graph::AdoptPoses() {
  for (Node& n : nodes_) n.written.clear();
}

bool Graph::IsPosed(NodeId id, int attribute) const {
  const auto& unposed = node(id).unposed;
  return std::any_of(unposed.begin(), unposed.end(),
                     [&](const auto& entry) { return entry.first == attribute; });
}

std::span<const SetValue> Graph::RestValues(NodeId id, int attribute) const {
  for (const auto& [posed, values] : node(id).unposed) {
    if (posed == attribute) return values;
  }
  return Values(id, attribute);
}

std::span<const SetValue> Graph::WrittenValues(NodeId id, int attribute) const {
  for (const auto& [posed, values] : node(id).written) {
    if (posed == attribute) return values;
  }
  return Values(id, attribute);
}

const Value* Graph::FindValue(const PlugRef& plug) const {
  const auto [begin, end] = Range(node(plug.node).values, plug, plug, kPlug);
  return begin == end ? nullptr : &begin->value;
}

std::span<const SetValue> Graph::Values(NodeId id, int attribute) const {
  const auto [begin, end] = Range(node(id).values, At(attribute, -1, -1), At(attribute, kLast, kLast), kPlug);
  return {begin, end};
}

const Connection* Graph::FindConnection(const PlugRef& destination) const {
  const auto [begin, end] = Range(node(destination.node).inputs, destination, destination, kDestination);
  return begin == end ? nullptr : &*begin;
}

int Graph::ArraySize(NodeId id, int attribute) const {
  int size = 0;
  const Node& n = node(id);
  const PlugRef first = At(attribute, -1, -1), last = At(attribute, kLast, kLast);
  if (const auto [begin, end] = Range(n.values, first, last, kPlug); begin != end)
    size = std::prev(end)->plug.element + 1;
  if (const auto [begin, end] = Range(n.inputs, first, last, kDestination); begin != end) {
    size = std::max(size, std::prev(end)->destination.element + 1);
  }
  if (const auto* names = ElementNames(id, attribute)) size = std::max(size, static_cast<int>(names->size()));
  return size;
}

void Graph::SetElementNames(NodeId id, int attribute, std::vector<std::string> names) {
  // A name that several elements share would name the first of them alone
  std::map<std::string_view, int> uses;
  for (const std::string& name : names) ++uses[name];
  std::vector<std::string> own = names;
  std::set<std::string> given;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (names[i].empty() || uses[names[i]] == 1) continue;
    own[i] = fmt::format("{}#{}", names[i], i);
    while (uses.count(own[i]) != 0 || !given.insert(own[i]).second) own[i] += '#';  // really called that
  }
  names = std::move(own);
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
  Node& n = node(id);
  if (n.name == alias || std::find(n.aliases.begin(), n.aliases.end(), alias) != n.aliases.end()) return;
  by_alias_[alias].push_back(id.index);
  n.aliases.push_back(std::move(alias));
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
  const bool fits =
      a == b || (IsPointType(a) && IsPointType(b) && PointComponents(a) == PointComponents(b)) ||
      (integral && (b == Type::kDouble || b == Type::kBool || b == Type::kInt || b == Type::kEnum)) ||
      (a == Type::kDouble && (b == Type::kBool || b == Type::kInt || b == Type::kEnum));
  if (!fits) {
    return Status::Invalid("{} is a {} and cannot drive {}, a {}", PlugName(source), TypeName(a),
                           PlugName(destination), TypeName(b));
  }
  KPSA_RETURN_IF_ERROR(CheckOverlap(destination, replace));
  Connection replaced;
  if (const Connection* before = FindConnection(destination)) {
    replaced = *before;
    KPSA_RETURN_IF_ERROR(Disconnect(destination));
  }
  Status status = CheckCycle(source, destination);
  if (status.ok()) {
    AddConnection({source, destination});
  } else if (replaced.source.attribute >= 0) {
    AddConnection(replaced);
  }
  return status;
}

void Graph::AddConnection(const Connection& connection) {
  node(connection.source.node).outputs.push_back(connection);
  auto& inputs = node(connection.destination.node).inputs;
  inputs.insert(Range(inputs, connection.destination, connection.destination, kDestination).first,
                connection);
}

// Whether a connection to the plug, to a part of it or to what it is a part of is in the way.
Status Graph::CheckOverlap(const PlugRef& destination, bool replace) const {
  const auto& inputs = node(destination.node).inputs;
  const auto refuse = [&](const Connection& c) {
    return Status::Invalid("{} is driven by {} already", PlugName(c.destination), PlugName(c.source));
  };
  const auto [begin, end] = Range(inputs, destination, LastChild(destination), kDestination);
  for (auto it = begin; it != end; ++it) {
    if (!replace || !(it->destination == destination)) return refuse(*it);
  }
  for (PlugRef whole :
       {At(destination.attribute, destination.element, -1), At(destination.attribute, -1, -1)}) {
    whole.node = destination.node;
    const Connection* c = whole == destination ? nullptr : FindConnection(whole);
    if (c != nullptr) return refuse(*c);
  }
  return Status();
}

Status Graph::Disconnect(const PlugRef& destination) {
  KPSA_RETURN_IF_ERROR(CheckPlug(destination));
  auto& inputs = node(destination.node).inputs;
  const auto [begin, end] = Range(inputs, destination, destination, kDestination);
  if (begin == end) return Status::Invalid("{} has no connection", PlugName(destination));
  auto& outputs = node(begin->source.node).outputs;
  outputs.erase(std::find_if(outputs.begin(), outputs.end(),
                             [&](const Connection& c) { return c.destination == destination; }));
  inputs.erase(begin, end);
  return Status();
}

Status Graph::CheckCycle(const PlugRef& source, const PlugRef& destination) const {
  if (source.node != destination.node &&
      (node(destination.node).outputs.empty() || node(source.node).inputs.empty()))
    return Status();
  // Walk forward from the destination through the groups that read it, looking for the source. A state is a
  // plug; its element is -1 where a group does not work element by element.
  struct State {
    PlugRef plug;
    std::size_t parent;
  };
  struct Hash {
    std::size_t operator()(const PlugRef& p) const {
      std::uint64_t h = p.node.index;
      for (int v : {p.attribute, p.element, p.component})
        h = (h ^ static_cast<std::uint32_t>(v)) * 0x9e3779b97f4a7c15ull;
      return static_cast<std::size_t>(h ^ (h >> 29));
    }
  };
  const auto overlap = [](const PlugRef& a, const PlugRef& b) {
    return a.attribute == b.attribute && (a.element == b.element || a.element < 0 || b.element < 0) &&
           (a.component == b.component || a.component < 0 || b.component < 0);
  };
  std::vector<State> states;
  std::unordered_set<PlugRef, Hash> seen;
  const auto visit = [&](const PlugRef& plug, std::size_t parent) {
    if (seen.insert(plug).second) states.push_back({plug, parent});
  };
  visit(destination, 0);
  for (std::size_t at = 0; at < states.size(); ++at) {
    const PlugRef plug = states[at].plug;
    if (plug.node == source.node && overlap(plug, source)) {
      std::vector<std::string> path;
      for (std::size_t i = at;; i = states[i].parent) {
        path.push_back(PlugName(states[i].plug));
        if (i == 0) break;
      }
      std::reverse(path.begin(), path.end());
      return Status::Invalid("{} -> {} would make a cycle: {} -> {}", PlugName(source), PlugName(destination),
                             fmt::join(path, " -> "), path.front());
    }
    const Node& n = nodes_[plug.node.index];
    for (const Connection& c : n.outputs) {  // an output, or an input that is read on as a source
      if (overlap(c.source, plug)) visit(c.destination, at);
    }
    const AttributeDef& a = n.def->attributes[static_cast<std::size_t>(plug.attribute)];
    if (a.output) continue;
    for (const ComputeGroup& group : n.def->groups) {
      const bool reads = a.structural || std::find(group.inputs.begin(), group.inputs.end(),
                                                   plug.attribute) != group.inputs.end();
      if (!reads) continue;
      for (int output : group.outputs)
        visit({plug.node, output, group.per_geometry && a.per_geometry ? plug.element : -1, -1}, at);
    }
  }
  return Status();
}

}  // namespace kpsa::engine
