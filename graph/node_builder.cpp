#include "graph/node_builder.h"

#include <algorithm>

#include "base/check.h"

namespace kpsa {
namespace {

Type TypeOfDefault(const Value& value) {
  if (value.get_if<double>() != nullptr) return Type::kDouble;
  if (value.get_if<std::int64_t>() != nullptr) return Type::kInt;
  if (value.get_if<Double3>() != nullptr) return Type::kDouble3;
  if (value.get_if<Quaternion>() != nullptr) return Type::kQuaternion;
  if (value.get_if<Matrix4>() != nullptr) return Type::kMatrix;
  if (value.get_if<std::string>() != nullptr) return Type::kString;
  if (value.get_if<std::vector<std::int64_t>>() != nullptr) return Type::kInts;
  if (value.get_if<std::vector<double>>() != nullptr) return Type::kDoubles;
  KPSA_CHECK(false);
  return Type::kDouble;
}

}  // namespace

NodeBuilder& NodeBuilder::add(AttributeDef attribute) {
  KPSA_CHECK_EQ(def_->FindAttribute(attribute.name), -1);
  def_->attributes.push_back(std::move(attribute));
  return *this;
}

NodeBuilder& NodeBuilder::in(std::string name, Value default_value, AttributeOptions options) {
  AttributeDef a;
  a.name = std::move(name);
  a.type = TypeOfDefault(default_value);
  a.default_value = std::move(default_value);
  a.min = options.min, a.max = options.max, a.unit = options.unit, a.doc = std::move(options.doc),
  a.diagnostic = options.diagnostic;
  return add(std::move(a));
}

NodeBuilder& NodeBuilder::structural(std::string name, Value default_value, AttributeOptions options) {
  in(std::move(name), std::move(default_value), std::move(options));
  attribute().structural = true;
  return *this;
}

NodeBuilder& NodeBuilder::structural(std::string name, Type type, AttributeOptions options) {
  AttributeDef a;
  a.name = std::move(name);
  a.type = type;
  a.structural = true;
  a.min = options.min, a.max = options.max, a.unit = options.unit, a.doc = std::move(options.doc),
  a.diagnostic = options.diagnostic;
  return add(std::move(a));
}

NodeBuilder& NodeBuilder::enumeration(std::string name, std::vector<std::string> names, bool structural,
                                      std::string doc, int default_choice) {
  AttributeDef a;
  a.name = std::move(name);
  a.type = Type::kEnum;
  a.default_value = Value(default_choice);
  a.enum_names = std::move(names);
  a.structural = structural;
  a.doc = std::move(doc);
  return add(std::move(a));
}

NodeBuilder& NodeBuilder::points_in(std::string name, std::string doc, Type type) {
  KPSA_CHECK(IsPointType(type));
  AttributeDef a;
  a.name = std::move(name);
  a.type = type;
  a.doc = std::move(doc);
  return add(std::move(a));
}

NodeBuilder& NodeBuilder::out(std::string name, Type type, std::string doc) {
  KPSA_CHECK(SlotSize(type) > 0);
  AttributeDef a;
  a.name = std::move(name);
  a.type = type;
  a.output = true;
  a.doc = std::move(doc);
  return add(std::move(a));
}

NodeBuilder& NodeBuilder::array() {
  attribute().array = true;
  return *this;
}
NodeBuilder& NodeBuilder::per_geometry() {
  attribute().array = attribute().per_geometry = true;
  return *this;
}
NodeBuilder& NodeBuilder::lazy(bool together) {
  attribute().lazy = true;
  attribute().lazy_together = together;
  return *this;
}
NodeBuilder& NodeBuilder::world_place() {
  KPSA_CHECK(attribute().type == Type::kMatrix && !attribute().array && !attribute().output);
  attribute().world_place = true;
  return *this;
}
NodeBuilder& NodeBuilder::alias(std::string other_name) {
  attribute().aliases.push_back(std::move(other_name));
  return *this;
}
NodeBuilder& NodeBuilder::grid(std::string divisions_attribute) {
  attribute().grid = std::move(divisions_attribute);
  return *this;
}
NodeBuilder& NodeBuilder::default_from(std::function<Value(const Structural&)> f) {
  attribute().default_from = std::move(f);
  return *this;
}

NodeBuilder& NodeBuilder::group_compute(ComputeFn compute) {
  ComputeGroup g;
  g.compute = compute;
  for (std::size_t i = 0; i < def_->attributes.size(); ++i) {
    const AttributeDef& a = def_->attributes[i];
    const int number = static_cast<int>(i);
    if (a.output && def_->GroupOfOutput(number) < 0) g.outputs.push_back(number);
    if (!a.output && !a.structural) g.inputs.push_back(number);
  }
  def_->groups.push_back(std::move(g));
  finish_group();
  return *this;
}

NodeBuilder& NodeBuilder::group_for(std::vector<std::string> outputs, std::vector<std::string> inputs,
                                    ComputeFn compute) {
  ComputeGroup g;
  g.compute = compute;
  for (const std::string& name : outputs) {
    const int number = def_->FindAttribute(name);
    KPSA_CHECK(number >= 0 && def_->attributes[static_cast<std::size_t>(number)].output);
    KPSA_CHECK_EQ(def_->GroupOfOutput(number), -1);
    g.outputs.push_back(number);
  }
  for (const std::string& name : inputs) {
    const int number = def_->FindAttribute(name);
    KPSA_CHECK(number >= 0 && !def_->attributes[static_cast<std::size_t>(number)].output);
    g.inputs.push_back(number);
  }
  def_->groups.push_back(std::move(g));
  finish_group();
  return *this;
}

void NodeBuilder::finish_group() {
  ComputeGroup& g = group();
  KPSA_CHECK(!g.outputs.empty());
  for (int output : g.outputs) {
    if (def_->attributes[static_cast<std::size_t>(output)].per_geometry) g.per_geometry = true;
  }
}

int NodeBuilder::input_position(std::string_view input) {
  const auto& inputs = group().inputs;
  const auto it = std::find(inputs.begin(), inputs.end(), def_->FindAttribute(input));
  KPSA_CHECK(it != inputs.end());
  return static_cast<int>(it - inputs.begin());
}

NodeBuilder& NodeBuilder::in_place(std::string_view input) {
  group().in_place_input = input_position(input);
  return *this;
}

NodeBuilder& NodeBuilder::batch(BindBatchFn bind, ComputeBatchFn f) {
  KPSA_CHECK_EQ(group().outputs.size(), std::size_t{1});
  KPSA_CHECK(group().decide == nullptr && group().compute_block == nullptr);
  for (const std::vector<int>* numbers : {&group().inputs, &group().outputs}) {
    for (int number : *numbers) {
      const AttributeDef& a = def_->attributes[static_cast<std::size_t>(number)];
      KPSA_CHECK(!a.array && IsSmallType(a.type));
    }
  }
  group().bind_batch = std::move(bind);
  group().compute_batch = f;
  return *this;
}

NodeBuilder& NodeBuilder::passes(std::string_view input, const std::vector<std::string>& held) {
  KPSA_CHECK_EQ(group().outputs.size(), std::size_t{1});
  group().passed_input = input_position(input);
  const auto type_of = [&](int number) { return def_->attributes[static_cast<std::size_t>(number)].type; };
  KPSA_CHECK(type_of(group().inputs[static_cast<std::size_t>(group().passed_input)]) ==
             type_of(group().outputs[0]));
  for (const std::string& name : held) group().held_inputs.push_back(input_position(name));
  return *this;
}

NodeBuilder& NodeBuilder::touches(std::string_view input, TouchFn f) {
  KPSA_CHECK_EQ(group().outputs.size(), std::size_t{1});
  group().touched_input = input_position(input);
  group().touches = std::move(f);
  return *this;
}

NodeBuilder& NodeBuilder::strength(std::string_view input) {
  const int position = input_position(input);
  const int attribute = group().inputs[static_cast<std::size_t>(position)];
  const AttributeDef& a = def_->attributes[static_cast<std::size_t>(attribute)];
  KPSA_CHECK(a.type == Type::kDouble && !a.array && group().touched_input >= 0);
  group().strength_input = position;
  return *this;
}

}  // namespace kpsa
