#include "graph/node_builder.h"

#include <algorithm>

namespace kpsa::engine {
namespace {

// Whether a default tells a type; assets and buffers do not.
bool TypeOfDefault(const Value& value, Type* type) {
  if (value.get_if<double>() != nullptr) return *type = Type::kDouble, true;
  if (value.get_if<std::int64_t>() != nullptr) return *type = Type::kInt, true;
  if (value.get_if<Double3>() != nullptr) return *type = Type::kDouble3, true;
  if (value.get_if<Quaternion>() != nullptr) return *type = Type::kQuaternion, true;
  if (value.get_if<Matrix4>() != nullptr) return *type = Type::kMatrix, true;
  if (value.get_if<std::string>() != nullptr) return *type = Type::kString, true;
  if (value.get_if<std::vector<std::int64_t>>() != nullptr) return *type = Type::kInts, true;
  if (value.get_if<std::vector<double>>() != nullptr) return *type = Type::kDoubles, true;
  return false;
}

}  // namespace

void NodeBuilder::problem(std::string_view attribute, std::string_view text) {
  def_->problems.push_back(
      attribute.empty() ? fmt::format("node type \"{}\": {}", def_->name, text)
                        : fmt::format("node type \"{}\", attribute \"{}\": {}", def_->name, attribute, text));
}

AttributeDef& NodeBuilder::attribute() {
  if (def_->attributes.empty()) {
    problem("", "an attribute is changed before one is declared");
    def_->attributes.emplace_back();
  }
  return def_->attributes.back();
}

ComputeGroup& NodeBuilder::group() {
  if (def_->groups.empty()) {
    problem("", "a word that follows compute() stands before it");
    def_->groups.emplace_back();
  }
  return def_->groups.back();
}

NodeBuilder& NodeBuilder::add(AttributeDef attribute) {
  if (attribute.name.empty()) problem("", "an attribute has no name");
  if (def_->FindAttribute(attribute.name) >= 0)
    problem(attribute.name, "declared twice; expected each name once");
  def_->attributes.push_back(std::move(attribute));
  return *this;
}

NodeBuilder& NodeBuilder::in(std::string name, Value default_value, AttributeOptions options) {
  AttributeDef a;
  a.name = std::move(name);
  if (!TypeOfDefault(default_value, &a.type))
    problem(
        a.name,
        "its default tells no type; expected a number, a vector, a quaternion, a matrix, a text or a list");
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
  if (!IsPointType(type)) problem(name, "points_in() of another type; expected points, colors or weights");
  AttributeDef a;
  a.name = std::move(name);
  a.type = type;
  a.doc = std::move(doc);
  return add(std::move(a));
}

NodeBuilder& NodeBuilder::out(std::string name, Type type, std::string doc) {
  if (SlotSize(type) == 0)
    problem(name, fmt::format("an output of type {}; expected one that flows at run time", TypeName(type)));
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
  if (attribute().type != Type::kMatrix || attribute().array || attribute().output)
    problem(attribute().name, "world_place() of something else; expected a matrix input that is no array");
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

NodeBuilder& NodeBuilder::compute_ports(ComputeFn f, std::span<const Port> ports) {
  ComputeGroup g = GroupOf(*def_, ports, &def_->problems);
  g.compute = f;
  if (std::ranges::none_of(ports, [](const Port& port) { return !port.input; }))
    problem("", "a compute() that names no output");
  def_->groups.push_back(std::move(g));
  return *this;
}

void NodeBuilder::check_ports(std::span<const Port> ports, std::string_view word) {
  for (std::string& text : PortProblems(*def_, group(), ports, word))
    def_->problems.push_back(std::move(text));
}

NodeBuilder& NodeBuilder::group_compute(CheckedCompute compute) {
  ComputeGroup g;
  g.compute = compute.function;
  for (std::size_t i = 0; i < def_->attributes.size(); ++i) {
    const AttributeDef& a = def_->attributes[i];
    const int number = static_cast<int>(i);
    if (a.output && def_->GroupOfOutput(number) < 0) g.outputs.push_back(number);
    if (!a.output && !a.structural) g.inputs.push_back(number);
  }
  def_->groups.push_back(std::move(g));
  finish_group(compute);
  return *this;
}

NodeBuilder& NodeBuilder::group_for(std::vector<std::string> outputs, std::vector<std::string> inputs,
                                    CheckedCompute compute) {
  ComputeGroup g;
  g.compute = compute.function;
  for (const std::string& name : outputs) {
    const int number = def_->FindAttribute(name);
    if (number < 0 || !attribute_of(number).output) {
      problem(name, "compute_for() names it as an output, which it is not");
    } else if (def_->GroupOfOutput(number) >= 0) {
      problem(name, "computed twice; expected one compute for each output");
    } else {
      g.outputs.push_back(number);
    }
  }
  for (const std::string& name : inputs) {
    const int number = def_->FindAttribute(name);
    if (number < 0 || attribute_of(number).output) {
      problem(name, "compute_for() names it as an input, which it is not");
    } else {
      g.inputs.push_back(number);
    }
  }
  def_->groups.push_back(std::move(g));
  finish_group(compute);
  return *this;
}

void NodeBuilder::finish_group(const CheckedCompute& compute) {
  ComputeGroup& g = group();
  if (g.outputs.empty())
    problem("", "a compute() has no output left to compute; expected an out() before it");
  for (int output : g.outputs) {
    if (attribute_of(output).per_geometry) g.per_geometry = true;
  }
  if (g.compute == nullptr) problem("", "a compute() without a function");
  if (!compute.signature.has_value()) return;
  for (std::string& text : SignatureProblems(*def_, g, *compute.signature))
    def_->problems.push_back(std::move(text));
}

int NodeBuilder::input_position(std::string_view input) {
  const auto& inputs = group().inputs;
  const auto it = std::find(inputs.begin(), inputs.end(), def_->FindAttribute(input));
  if (it == inputs.end()) {
    problem(input, "the compute before it has no such input");
    return -1;
  }
  return static_cast<int>(it - inputs.begin());
}

bool NodeBuilder::one_output(std::string_view word) {
  const std::size_t outputs = group().outputs.size();
  if (outputs != 1)
    problem("", fmt::format("{}() of a compute with {} outputs; expected one", word, outputs));
  return outputs == 1;
}

NodeBuilder& NodeBuilder::in_place(std::string_view input) {
  group().in_place_input = input_position(input);
  return *this;
}

NodeBuilder& NodeBuilder::batch(BindBatchFn bind, ComputeBatchFn f) {
  one_output("batch");
  if (group().decide != nullptr || group().compute_block != nullptr)
    problem("", "batch() of a compute with decide() or block(); expected neither");
  for (const std::vector<int>* numbers : {&group().inputs, &group().outputs}) {
    for (int number : *numbers) {
      const AttributeDef& a = attribute_of(number);
      if (a.array || !IsSmallType(a.type))
        problem(a.name, "batch() of a compute with arrays or points; expected small values only");
    }
  }
  group().bind_batch = std::move(bind);
  group().compute_batch = f;
  return *this;
}

NodeBuilder& NodeBuilder::passes(std::string_view input, const std::vector<std::string>& held) {
  const int position = input_position(input);
  if (!one_output("passes") || position < 0) return *this;
  group().passed_input = position;
  if (attribute_of(group().inputs[static_cast<std::size_t>(position)]).type !=
      attribute_of(group().outputs[0]).type)
    problem(input, "passes() as an output of another type");
  for (const std::string& name : held) {
    if (const int at = input_position(name); at >= 0) group().held_inputs.push_back(at);
  }
  return *this;
}

NodeBuilder& NodeBuilder::touches(std::string_view input, TouchFn f) {
  one_output("touches");
  group().touched_input = input_position(input);
  group().touches = std::move(f);
  return *this;
}

NodeBuilder& NodeBuilder::strength(std::string_view input) {
  const int position = input_position(input);
  if (position < 0) return *this;
  const AttributeDef& a = attribute_of(group().inputs[static_cast<std::size_t>(position)]);
  if (a.type != Type::kDouble || a.array || group().touched_input < 0)
    problem(input, "strength() of something else; expected one double, after touches()");
  group().strength_input = position;
  return *this;
}

}  // namespace kpsa::engine
