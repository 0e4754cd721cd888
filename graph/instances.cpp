#include "graph/instances.h"

#include <algorithm>

#include "base/check.h"
#include "graph/structural_view.h"

namespace kpsa {
namespace {

// First fields of the keys in by_key_: nodes use b = group, others are told apart by b.
constexpr int kAssembleKey = -1, kAssembleRestKey = -2, kConvertKey = -100;

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

float* PointComponent(PointsView view, int component) { return component == 0 ? view.x : component == 1 ? view.y : view.z; }

}  // namespace

const AttributeDef& InstanceTable::input_def(const Instance& i, int position) const {
  return graph_.def(i.node).attributes[static_cast<std::size_t>(group(i).inputs[static_cast<std::size_t>(position)])];
}
const AttributeDef& InstanceTable::output_def(const Instance& i, int position) const {
  return graph_.def(i.node).attributes[static_cast<std::size_t>(group(i).outputs[static_cast<std::size_t>(position)])];
}
Type InstanceTable::OutputType(const Instance& i, int position) const {
  return i.kind == Instance::Kind::kNode ? output_def(i, position).type : i.type;
}

const Value* InstanceTable::Keep(Value value) {
  made_values_.push_back(std::make_unique<Value>(std::move(value)));
  return made_values_.back().get();
}

Index InstanceTable::AddVarying(const PlugRef& plug) {
  PlugRef whole = plug;
  whole.component = -1;
  const AttributeDef& a = graph_.def(plug.node).attributes[static_cast<std::size_t>(plug.attribute)];
  if (!a.array) whole.element = -1;
  const Key key{whole.node.index, whole.attribute, whole.element, 0};
  const auto [it, added] = varying_by_key_.emplace(key, static_cast<Index>(varying_.size()));
  if (added) varying_.push_back(whole);
  return it->second;
}

const Connection* InstanceTable::FindUsed(const PlugRef& destination, bool rest) const {
  const Connection* c = graph_.FindConnection(destination);
  if (c != nullptr && rest && graph_.def(c->source.node).animation) return nullptr;
  return c;
}

const Value* InstanceTable::HeldValue(NodeId node, int attribute, int element) {
  const AttributeDef& a = graph_.def(node).attributes[static_cast<std::size_t>(attribute)];
  const PlugRef whole{node, attribute, element, -1};
  const Value* value = graph_.FindValue(whole);
  const bool has_children = a.type == Type::kDouble3 || a.type == Type::kQuaternion || (IsPointType(a.type) && !a.array);
  if (value != nullptr && !has_children) return value;
  const Key key{node.index, attribute, element, 1};
  if (const auto it = held_by_key_.find(key); it != held_by_key_.end()) return made_values_[it->second].get();
  Value made;
  if (value != nullptr) {
    made = *value;
  } else if (a.default_from) {
    made = a.default_from(StructuralView(*this, node, element, nullptr, nullptr));
  } else if (!a.default_value.empty() || !IsPointType(a.type)) {
    made = a.default_value;
  } else {
    made = EmptyPoints(a.type);
  }
  if (has_children && !made.empty()) {  // children that are set one by one
    if (IsPointType(a.type)) {
      std::shared_ptr<PointBuffer> edited;
      const auto count = made.points()->count();
      for (std::size_t e = 0; e < count; ++e) {
        for (int component = -1; component < 3; ++component) {
          const Value* child = graph_.FindValue({node, attribute, static_cast<int>(e), component});
          if (child == nullptr) continue;
          if (edited == nullptr) edited = std::make_shared<PointBuffer>(*made.points());
          for (int c = 0; c < edited->components(); ++c) {
            if (component >= 0 && c != component) continue;
            const double v = child->get_if<Double3>() != nullptr ? child->get<Double3>()[c] : child->AsDouble();
            PointComponent(edited->view(), c)[e] = static_cast<float>(v);
          }
        }
      }
      if (edited != nullptr) made = Value(PointBufferPtr(edited));
    } else {
      for (int component = 0; component < (a.type == Type::kDouble3 ? 3 : 4); ++component) {
        const Value* child = graph_.FindValue({node, attribute, element, component});
        if (child != nullptr) *ComponentOf(made, component) = child->AsDouble();
      }
    }
  }
  held_by_key_.emplace(key, static_cast<Index>(made_values_.size()));
  return Keep(std::move(made));
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

Source InstanceTable::ConvertTo(Source source, Type type, const PlugRef& plug) {
  const auto is_int = [](Type t) { return t == Type::kBool || t == Type::kInt || t == Type::kEnum; };
  if (source.type == type || (is_int(source.type) && is_int(type) && type != Type::kBool)) return source;
  if (source.kind == Source::Kind::kValue) {
    if (type == Type::kDouble) source.value = Keep(Value(source.value->AsDouble()));
    if (type == Type::kBool) source.value = Keep(Value(source.value->AsDouble() != 0));
    if (type == Type::kInt || type == Type::kEnum) source.value = Keep(Value(source.value->AsInt()));
    source.type = type;
    return source;
  }
  const Key key{plug.node.index, plug.attribute, plug.element * 8 + plug.component, kConvertKey - static_cast<int>(type)};
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
  const auto [it, added] = by_key_.emplace(Key{node.index, group, geometry, 0}, static_cast<Index>(instances_.size()));
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

Source InstanceTable::Resolve(PlugRef plug, bool rest) {
  const NodeDef& d = graph_.def(plug.node);
  const AttributeDef& a = d.attributes[static_cast<std::size_t>(plug.attribute)];
  if (!a.output) return ResolveInput(plug, rest);
  const int group = d.GroupOfOutput(plug.attribute);
  KPSA_CHECK(group >= 0);
  const ComputeGroup& g = d.groups[static_cast<std::size_t>(group)];
  Source source;
  source.kind = Source::Kind::kInstance;
  source.instance = InstanceOf(plug.node, group, g.per_geometry ? plug.element : -1);
  source.output = static_cast<int>(std::find(g.outputs.begin(), g.outputs.end(), plug.attribute) - g.outputs.begin());
  source.element = g.per_geometry ? 0 : std::max(plug.element, 0);
  source.type = a.type;
  return Take(source, plug.component);
}

Source InstanceTable::ResolveInput(PlugRef plug, bool rest) {
  const AttributeDef& a = graph_.def(plug.node).attributes[static_cast<std::size_t>(plug.attribute)];
  const bool points = IsPointType(a.type) && !a.array;
  const int component = plug.component;
  PlugRef whole = plug;
  whole.component = -1;
  if (component >= 0) {
    if (const Connection* c = FindUsed(plug, rest)) return ConvertTo(Resolve(c->source, rest), Type::kDouble, c->source);
  }
  if (const Connection* c = FindUsed(whole, rest)) {
    return Take(ConvertTo(Resolve(c->source, rest), graph_.PlugType(whole), c->source), component);
  }

  // The value that the plug holds, or that varies
  Source base;
  base.type = a.type;
  base.value = HeldValue(plug.node, plug.attribute, points ? -1 : plug.element);
  const auto it = varying_by_key_.find(Key{plug.node.index, plug.attribute, points ? -1 : plug.element, 0});
  if (!rest && it != varying_by_key_.end()) {
    base.kind = Source::Kind::kVarying;
    base.varying = it->second;
  }
  if (component >= 0) return Take(base, component);

  // Children that are driven one by one
  std::vector<const Connection*> children;
  for (const Connection& c : graph_.Inputs(plug.node)) {
    if (c.destination.attribute != plug.attribute || c.destination == whole) continue;
    if (!points && c.destination.element != plug.element) continue;
    if (rest && graph_.def(c.source.node).animation) continue;
    children.push_back(&c);
  }
  if (children.empty()) return base;
  const Key key{plug.node.index, plug.attribute, plug.element, rest ? kAssembleRestKey : kAssembleKey};
  Index number;
  if (const auto found = by_key_.find(key); found != by_key_.end()) {
    number = found->second;
  } else {
    Instance assemble;
    assemble.kind = Instance::Kind::kAssemble;
    assemble.node = plug.node;
    assemble.attribute = plug.attribute;
    assemble.type = a.type;
    assemble.inputs.push_back({0, -1, false, base, base});
    assemble.output_sizes = {1};
    assemble.array_sizes = {1};
    for (const Connection* c : children) {
      const PlugRef& to = c->destination;
      Input input;
      input.position = static_cast<int>(assemble.inputs.size());
      input.source = input.rest = ConvertTo(Resolve(c->source, rest), graph_.PlugType(to), c->source);
      assemble.inputs.push_back(input);
      assemble.array_sizes.push_back(1);
      assemble.children.push_back((points ? to.element : 0) * 4 + (to.component < 0 ? 3 : to.component));
    }
    number = static_cast<Index>(instances_.size());
    by_key_.emplace(key, number);
    instances_.push_back(std::move(assemble));
  }
  Source source;
  source.kind = Source::Kind::kInstance;
  source.instance = number;
  source.type = a.type;
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
    const int count = one ? 1 : graph_.ArraySize(node, attribute);
    sizes.push_back(count);
    for (int e = 0; e < count; ++e) {
      Input input;
      input.position = static_cast<int>(position);
      input.element = !a.array ? -1 : one ? geometry : e;
      input.lazy = a.lazy;
      const PlugRef plug{node, attribute, input.element, -1};
      input.source = ResolveInput(plug, false);
      input.rest = ResolveInput(plug, true);
      inputs.push_back(input);
    }
  }
  std::vector<StructuralInput> structural;
  for (const Connection& c : graph_.Inputs(node)) {
    const AttributeDef& a = d.attributes[static_cast<std::size_t>(c.destination.attribute)];
    if (!a.structural) continue;
    structural.push_back({c.destination.attribute, c.destination.element,
                          ConvertTo(Resolve(c.source, false), graph_.PlugType(c.destination), c.source)});
  }
  std::vector<int> output_sizes;
  for (int attribute : g.outputs) {
    const AttributeDef& a = d.attributes[static_cast<std::size_t>(attribute)];
    int count = 1;
    if (a.array && !g.per_geometry) {
      if (const auto* names = graph_.ElementNames(node, attribute)) count = std::max(count, static_cast<int>(names->size()));
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

}  // namespace kpsa
