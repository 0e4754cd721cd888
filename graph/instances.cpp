#include "graph/instances.h"

#include <algorithm>

#include "base/check.h"
#include "graph/authored.h"
#include "graph/structural_view.h"

namespace kpsa::engine {
namespace {

// First fields of the keys in by_key_: nodes use b = group, others are told apart by b.
constexpr int kAssembleKey = -1, kAssembleRestKey = -2, kConvertKey = -100, kConvertRestKey = -200;

const Value& EmptyPoints(Type type) {
  static const Value kPoints{PointBufferPtr(std::make_shared<PointBuffer>(0, 3))};
  static const Value kWeights{PointBufferPtr(std::make_shared<PointBuffer>(0, 1))};
  return type == Type::kWeights ? kWeights : kPoints;
}

double* ComponentOf(Value& value, int component) {
  if (auto* v = const_cast<Double3*>(value.get_if<Double3>())) return &(*v)[component];
  auto* q = const_cast<Quaternion*>(value.get_if<Quaternion>());
  KPSA_CHECK(q != nullptr);
  double* parts[4] = {&q->x, &q->y, &q->z, &q->w};
  return parts[component];
}

// The part of a list, sorted by plug, that belongs to one element.
template <typename T, typename F>
std::span<const T> OfElement(std::span<const T> list, int element, F plug_of) {
  const auto begin = std::partition_point(list.begin(), list.end(),
                                          [&](const T& e) { return plug_of(e).element < element; });
  const auto end =
      std::partition_point(begin, list.end(), [&](const T& e) { return plug_of(e).element == element; });
  return {begin, end};
}
const PlugRef& PlugOf(const SetValue& value) { return value.plug; }
const PlugRef& DestinationOf(const Connection& connection) { return connection.destination; }

float* PointComponent(PointsView view, int component) {
  return component == 0 ? view.x : component == 1 ? view.y : view.z;
}

}  // namespace

const AttributeDef& InstanceTable::input_def(const Instance& i, int position) const {
  return graph_.def(i.node)
      .attributes[static_cast<std::size_t>(group(i).inputs[static_cast<std::size_t>(position)])];
}
const AttributeDef& InstanceTable::output_def(const Instance& i, int position) const {
  return graph_.def(i.node)
      .attributes[static_cast<std::size_t>(group(i).outputs[static_cast<std::size_t>(position)])];
}
Type InstanceTable::OutputType(const Instance& i, int position) const {
  return i.kind == Instance::Kind::kNode ? output_def(i, position).type : i.type;
}

const Value* InstanceTable::Keep(Value value) {
  made_values_.push_back(std::move(value));
  return &made_values_.back();
}

Index InstanceTable::AddVarying(const PlugRef& plug) {
  PlugRef whole = plug;
  whole.component = -1;
  const AttributeDef& a = graph_.def(plug.node).attributes[static_cast<std::size_t>(plug.attribute)];
  if (!a.array) whole.element = -1;
  const Key key{whole.node.index, whole.attribute, whole.element, 0};
  const auto [it, added] = varying_by_key_.emplace(key, static_cast<Index>(varying_.size()));
  if (!added) return it->second;
  varying_.push_back(whole);
  int& size = varying_sizes_[Key{whole.node.index, whole.attribute, 0, 0}];
  size = std::max(size, whole.element + 1);
  return it->second;
}

int InstanceTable::ArraySize(NodeId node, int attribute) const {
  const auto it = varying_sizes_.find(Key{node.index, attribute, 0, 0});
  return std::max(graph_.ArraySize(node, attribute), it == varying_sizes_.end() ? 0 : it->second);
}

const Connection* InstanceTable::FindUsed(const PlugRef& destination, bool rest) const {
  const Connection* c = graph_.FindConnection(destination);
  if (c != nullptr && rest && graph_.def(c->source.node).animation) return nullptr;
  return c;
}

const Value* InstanceTable::HeldValue(NodeId node, int attribute, int element, bool rest) {
  const AttributeDef& a = graph_.def(node).attributes[static_cast<std::size_t>(attribute)];
  rest = rest && graph_.IsPosed(node, attribute);
  const std::span<const SetValue> values =
      rest ? graph_.RestValues(node, attribute) : graph_.Values(node, attribute);
  const Value* value = nullptr;
  if (!rest) {
    value = graph_.FindValue({node, attribute, element, -1});
  } else {
    for (const SetValue& set : values) {
      if (set.plug.element == element && set.plug.component < 0) value = &set.value;
    }
  }
  const bool points = IsPointType(a.type) && !a.array;
  const bool has_children = points || a.type == Type::kDouble3 || a.type == Type::kQuaternion;
  if (!has_children) {
    if (value != nullptr) return value;
    if (!a.default_from && (!a.default_value.empty() || !IsPointType(a.type))) return &a.default_value;
  }
  const Key key{node.index, attribute, element, rest ? 2 : 1};
  if (const auto it = held_by_key_.find(key); it != held_by_key_.end()) return &made_values_[it->second];
  Value made;
  if (value != nullptr) {
    made = *value;
  } else if (a.default_from) {
    const StructuralView view(*this, node, element, nullptr, nullptr);
    made = CallAuthored(*this, node, [&] { return a.default_from(view); });
  } else if (!a.default_value.empty() || !IsPointType(a.type)) {
    made = a.default_value;
  } else {
    made = EmptyPoints(a.type);
  }
  if (points) {
    made = WithSetPoints(made, values);
  } else if (has_children && !made.empty()) {
    for (const auto& [plug, child] : OfElement(values, element, PlugOf)) {
      if (plug.component >= 0) *ComponentOf(made, plug.component) = child.AsDouble();
    }
  }
  held_by_key_.emplace(key, static_cast<Index>(made_values_.size()));
  return Keep(std::move(made));
}

bool InstanceTable::IsSet(NodeId node, int attribute, int element) const {
  std::span<const SetValue> values = graph_.Values(node, attribute);
  std::span<const Connection> inputs = graph_.Inputs(node, attribute);
  if (graph_.def(node).attributes[static_cast<std::size_t>(attribute)].array) {
    values = OfElement(values, element, PlugOf);
    inputs = OfElement(inputs, element, DestinationOf);
  }
  return !values.empty() || !inputs.empty();
}

// Points with those replaced that are set one by one.
Value InstanceTable::WithSetPoints(const Value& whole, std::span<const SetValue> set) {
  std::shared_ptr<PointBuffer> edited;
  for (const auto& [plug, value] : set) {
    if (plug.element < 0) continue;
    if (edited == nullptr) edited = std::make_shared<PointBuffer>(*whole.points());
    if (static_cast<std::size_t>(plug.element) >= edited->count()) {
      if (status_.ok())
        status_ =
            Status::Invalid("{} is set, but there are {} points", graph_.PlugName(plug), edited->count());
      break;
    }
    for (int c = 0; c < edited->components(); ++c) {
      if (plug.component >= 0 && c != plug.component) continue;
      const auto* vector = value.get_if<Double3>();
      PointComponent(edited->view(), c)[plug.element] =
          static_cast<float>(vector != nullptr ? (*vector)[c] : value.AsDouble());
    }
  }
  return edited == nullptr ? whole : Value(PointBufferPtr(edited));
}

Source InstanceTable::Take(Source source, int component) {
  if (component < 0) return source;
  source.type = Type::kDouble;
  if (source.kind == Source::Kind::kValue) {
    Value whole = *source.value;
    source.value = Keep(Value(*ComponentOf(whole, component)));
    return source;
  }
  if (source.value != nullptr) {
    Value whole = *source.value;
    source.value = Keep(Value(*ComponentOf(whole, component)));
  }
  source.component = static_cast<std::int8_t>(component);
  return source;
}

Source InstanceTable::ConvertTo(Source source, Type type, const PlugRef& plug, bool rest) {
  const auto is_int = [](Type t) { return t == Type::kBool || t == Type::kInt || t == Type::kEnum; };
  if (source.type == type || (is_int(source.type) && is_int(type) && type != Type::kBool)) return source;
  if (IsPointType(type)) {  // colours as points, and back: the same numbers
    source.type = type;
    return source;
  }
  if (source.kind == Source::Kind::kValue) {
    if (type == Type::kDouble) source.value = Keep(Value(source.value->AsDouble()));
    if (type == Type::kBool) source.value = Keep(Value(source.value->AsDouble() != 0));
    if (type == Type::kInt || type == Type::kEnum) source.value = Keep(Value(source.value->AsInt()));
    source.type = type;
    return source;
  }
  const Key key{plug.node.index, plug.attribute, plug.element * 8 + plug.component,
                (rest ? kConvertRestKey : kConvertKey) - static_cast<int>(type)};
  const auto [it, added] = by_key_.emplace(key, static_cast<Index>(instances_.size()));
  if (added) {
    Instance convert;
    convert.kind = Instance::Kind::kConvert;
    convert.node = plug.node;
    convert.attribute = plug.attribute;
    convert.type = type;
    convert.inputs.push_back({0, -1, false, source, source});
    convert.array_sizes = convert.output_sizes = {1};
    instances_.push_back(std::move(convert));
  }
  Source converted;
  converted.kind = Source::Kind::kInstance;
  converted.instance = it->second;
  converted.type = type;
  return converted;
}

Index InstanceTable::InstanceOf(NodeId node, int group, int geometry) {
  const auto [it, added] =
      by_key_.emplace(Key{node.index, group, geometry, 0}, static_cast<Index>(instances_.size()));
  if (added) {
    Instance instance;
    instance.node = node;
    instance.group = group;
    instance.geometry = geometry;
    pending_.push_back(it->second);
    instances_.push_back(std::move(instance));
  }
  return it->second;
}

Source InstanceTable::ResolveOutput(const PlugRef& plug) {
  const NodeDef& d = graph_.def(plug.node);
  const int group = d.GroupOfOutput(plug.attribute);
  KPSA_CHECK(group >= 0);
  const ComputeGroup& g = d.groups[static_cast<std::size_t>(group)];
  Source source;
  source.kind = Source::Kind::kInstance;
  source.instance = InstanceOf(plug.node, group, g.per_geometry ? plug.element : -1);
  source.output =
      static_cast<int>(std::find(g.outputs.begin(), g.outputs.end(), plug.attribute) - g.outputs.begin());
  source.element = g.per_geometry ? 0 : std::max(plug.element, 0);
  source.type = d.attributes[static_cast<std::size_t>(plug.attribute)].type;
  return Take(source, plug.component);
}

Source InstanceTable::Resolve(PlugRef plug, bool rest) {
  // Down to an output or to a held value; then up again, converting and taking components as the inputs on
  // the way ask
  struct Hop {
    PlugRef source;
    Type type;
    int component;
  };
  std::vector<Hop> hops;
  Source source;
  for (;;) {
    if (graph_.def(plug.node).attributes[static_cast<std::size_t>(plug.attribute)].output) {
      source = ResolveOutput(plug);
      break;
    }
    PlugRef whole = plug;
    whole.component = -1;
    const Connection* c = plug.component >= 0 ? FindUsed(plug, rest) : nullptr;
    const int component = c != nullptr ? -1 : plug.component;
    if (c == nullptr) c = FindUsed(whole, rest);
    if (c == nullptr) {
      source = ResolveHeld(plug, rest);
      break;
    }
    hops.push_back({c->source, graph_.PlugType(c->destination), component});
    plug = c->source;
  }
  for (auto hop = hops.rbegin(); hop != hops.rend(); ++hop) {
    source = Take(ConvertTo(source, hop->type, hop->source, rest), hop->component);
  }
  return source;
}

Source InstanceTable::ResolveHeld(const PlugRef& plug, bool rest) {
  const AttributeDef& a = graph_.def(plug.node).attributes[static_cast<std::size_t>(plug.attribute)];
  const bool points = IsPointType(a.type) && !a.array;
  const int element = points ? -1 : plug.element;
  Source whole;
  whole.type = a.type;
  whole.value = HeldValue(plug.node, plug.attribute, element, rest);
  const auto it = varying_by_key_.find(Key{plug.node.index, plug.attribute, element, 0});
  if (!rest && it != varying_by_key_.end()) {
    whole.kind = Source::Kind::kVarying;
    whole.varying = it->second;
  }
  if (plug.component >= 0) return Take(whole, plug.component);
  if (!points && a.type != Type::kDouble3 && a.type != Type::kQuaternion) return whole;
  std::vector<const Connection*> children;  // that are driven one by one
  std::span<const Connection> inputs = graph_.Inputs(plug.node, plug.attribute);
  if (!points) inputs = OfElement(inputs, plug.element, DestinationOf);
  for (const Connection& c : inputs) {
    if (!rest || !graph_.def(c.source.node).animation) children.push_back(&c);
  }
  return children.empty() ? whole : Assemble(plug, whole, children, rest);
}

// Recursion ends: points are made of vectors, vectors of numbers.
Source InstanceTable::Assemble(const PlugRef& plug, const Source& whole,
                               const std::vector<const Connection*>& children, bool rest) {
  const bool points = IsPointType(whole.type);
  Source source;
  source.kind = Source::Kind::kInstance;
  source.type = whole.type;
  const Key key{plug.node.index, plug.attribute, plug.element, rest ? kAssembleRestKey : kAssembleKey};
  if (const auto found = by_key_.find(key); found != by_key_.end()) {
    source.instance = found->second;
    return source;
  }
  Instance assemble;
  assemble.kind = Instance::Kind::kAssemble;
  assemble.node = plug.node;
  assemble.attribute = plug.attribute;
  assemble.type = whole.type;
  assemble.output_sizes = {1};
  assemble.inputs.push_back({0, -1, false, whole, whole});
  for (const Connection* c : children) {
    const PlugRef& to = c->destination;
    Input input;
    input.position = static_cast<int>(assemble.inputs.size());
    input.source = input.rest = ConvertTo(Resolve(c->source, rest), graph_.PlugType(to), c->source, rest);
    assemble.inputs.push_back(input);
    assemble.children.push_back((points ? to.element : 0) * 4 + (to.component < 0 ? 3 : to.component));
  }
  assemble.array_sizes.assign(assemble.inputs.size(), 1);
  source.instance = static_cast<Index>(instances_.size());
  by_key_.emplace(key, source.instance);
  instances_.push_back(std::move(assemble));
  return source;
}

void InstanceTable::Expand(Index number) {
  // Resolve may add instances: work on a copy of the fields and store at the end
  const NodeId node = instances_[number].node;
  const int geometry = instances_[number].geometry;
  const NodeDef& d = graph_.def(node);
  const ComputeGroup& g = d.groups[static_cast<std::size_t>(instances_[number].group)];
  std::vector<Input> inputs;
  std::vector<int> sizes;
  for (std::size_t position = 0; position < g.inputs.size(); ++position) {
    const int attribute = g.inputs[position];
    const AttributeDef& a = d.attributes[static_cast<std::size_t>(attribute)];
    const bool one = !a.array || (a.per_geometry && g.per_geometry);
    const int count = one ? 1 : ArraySize(node, attribute);
    sizes.push_back(count);
    for (int e = 0; e < count; ++e) {
      Input input;
      input.position = static_cast<int>(position);
      input.element = !a.array ? -1 : one ? geometry : e;
      input.lazy = a.lazy;
      const PlugRef plug{node, attribute, input.element, -1};
      input.source = Resolve(plug, false);
      input.rest = Resolve(plug, true);
      inputs.push_back(input);
    }
  }
  std::vector<StructuralInput> structural;
  for (const Connection& c : graph_.Inputs(node)) {
    const AttributeDef& a = d.attributes[static_cast<std::size_t>(c.destination.attribute)];
    if (!a.structural) continue;
    structural.push_back(
        {c.destination.attribute, c.destination.element,
         ConvertTo(Resolve(c.source, false), graph_.PlugType(c.destination), c.source, false)});
  }
  std::vector<int> output_sizes;
  for (int attribute : g.outputs) {
    const AttributeDef& a = d.attributes[static_cast<std::size_t>(attribute)];
    int count = 1;
    if (a.array && !g.per_geometry) {
      if (const auto* names = graph_.ElementNames(node, attribute))
        count = std::max(count, static_cast<int>(names->size()));
      for (const Connection& c : graph_.Outputs(node)) {
        if (c.source.attribute == attribute) count = std::max(count, c.source.element + 1);
      }
      for (const RequestedOutput& o : request_.outputs) {
        if (o.plug.node == node && o.plug.attribute == attribute) count = std::max(count, o.plug.element + 1);
      }
    }
    output_sizes.push_back(count);
  }
  Instance& instance = instances_[number];
  instance.inputs = std::move(inputs);
  instance.array_sizes = std::move(sizes);
  instance.structural = std::move(structural);
  instance.output_sizes = std::move(output_sizes);
}

Source InstanceTable::Reach(const PlugRef& plug) {
  const Source source = Resolve(plug, false);
  while (!pending_.empty()) {
    const Index next = pending_.back();
    pending_.pop_back();
    Expand(next);
  }
  return source;
}

std::vector<Index> InstanceTable::Order() const {
  std::vector<Index> order;
  order.reserve(instances_.size());
  std::vector<std::uint8_t> state(instances_.size(), 0);  // 0 new, 1 open, 2 done
  std::vector<Index> stack;
  for (Index root = 0; root < instances_.size(); ++root) {
    if (state[root] == 0) stack.push_back(root);
    while (!stack.empty()) {
      const Index top = stack.back();
      if (state[top] == 1) {
        state[top] = 2;
        order.push_back(top);
      }
      if (state[top] == 2) {
        stack.pop_back();
        continue;
      }
      state[top] = 1;
      const auto visit = [&](const Source& s) {
        if (s.kind == Source::Kind::kInstance && state[s.instance] == 0) stack.push_back(s.instance);
      };
      for (const Input& input : instances_[top].inputs) {
        visit(input.source);
        visit(input.rest);
      }
      for (const StructuralInput& input : instances_[top].structural) visit(input.source);
    }
  }
  return order;
}

}  // namespace kpsa::engine
