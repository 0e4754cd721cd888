#include "graph/compute_signature.h"

#include <algorithm>

#include "graph/node_def.h"
#include "graph/slot_names.h"

namespace kpsa::engine {
namespace {

// `strictly`: an enum is its scoped enum only, as where a named input reads it.
bool Fits(const ComputeParameter& parameter, const AttributeDef& attribute, bool strictly = false) {
  const Type type = attribute.type;
  switch (parameter.kind) {
    case SlotKind::kBool:
      return type == Type::kBool;
    case SlotKind::kInteger:
      return type == Type::kInt || (type == Type::kEnum && (!strictly || parameter.array)) ||
             (parameter.array && type == Type::kBool);
    case SlotKind::kChoice:
      return type == Type::kEnum && (attribute.choice == nullptr || *attribute.choice == *parameter.choice);
    default:
      return IsPlainSlot(parameter.kind, type);
  }
}

std::string CppName(const ComputeParameter& parameter) {
  const char* name = "?";
  switch (parameter.kind) {
    case SlotKind::kBool:
      name = "bool";
      break;
    case SlotKind::kInteger:
      name = parameter.array ? "std::int64_t" : "an integer";
      break;
    case SlotKind::kChoice:
      name = "an enum";
      break;
    default:
      if (const char* plain = PlainSlotName(parameter.kind)) name = plain;
      break;
  }
  return parameter.array ? fmt::format("ArrayView<{}>", name) : name;
}

// How a function takes an attribute of that type.
std::string ExpectedName(Type type, bool array) {
  ComputeParameter p{SlotKind::kOther, array, nullptr};
  switch (type) {
    case Type::kBool:
      p.kind = array ? SlotKind::kInteger : SlotKind::kBool;
      break;
    case Type::kInt:
    case Type::kEnum:
      p.kind = SlotKind::kInteger;
      break;
    case Type::kDouble:
      p.kind = SlotKind::kDouble;
      break;
    case Type::kDouble3:
      p.kind = SlotKind::kDouble3;
      break;
    case Type::kQuaternion:
      p.kind = SlotKind::kQuaternion;
      break;
    case Type::kMatrix:
      p.kind = SlotKind::kMatrix;
      break;
    case Type::kPoints:
    case Type::kColors:
    case Type::kWeights:
      p.kind = SlotKind::kPoints;
      break;
    default:
      break;
  }
  return CppName(p);
}

std::string Described(const AttributeDef& attribute) {
  return fmt::format("{}{}", TypeName(attribute.type), attribute.array ? " array" : "");
}

// An enum that was declared with a scoped one is taken as that.
std::string Expected(const AttributeDef& attribute, bool array, std::string otherwise) {
  if (attribute.choice == nullptr || array) return otherwise;
  return "the enum that it is declared with";
}

// How a named port of that attribute is written in a list.
std::string ExpectedPort(const AttributeDef& a, bool array, bool input) {
  if (input)
    return a.type == Type::kEnum && !array ? Expected(a, array, "a scoped enum")
                                           : ExpectedName(a.type, array);
  if (!array && a.type == Type::kEnum) return "std::int64_t";
  const bool integers = a.type == Type::kBool || a.type == Type::kInt || a.type == Type::kEnum;
  const std::string name = IsPointType(a.type) ? "PointsView"
                           : array && integers ? "std::int64_t"
                                               : ExpectedName(a.type, false);
  return array ? fmt::format("OutArray<{}>", name) : name;
}

std::string GivenPort(const Port& port) {
  if (port.input) return CppName(port.parameter);
  const bool points = port.parameter.kind == SlotKind::kPoints;
  ComputeParameter element = port.parameter;
  element.array = false;
  const std::string name = points ? "PointsView" : CppName(element);
  return port.parameter.array ? fmt::format("OutArray<{}>", name) : name;
}

// -1 if there is none; a name that is written in code is the attribute's own, no alias.
int FindByName(const NodeDef& def, std::string_view name) {
  const auto it = std::find_if(def.attributes.begin(), def.attributes.end(),
                               [&](const AttributeDef& a) { return a.name == name; });
  return it == def.attributes.end() ? -1 : static_cast<int>(it - def.attributes.begin());
}

// Whether an attribute is an array for one step of a group.
bool IsArrayIn(const ComputeGroup& group, const AttributeDef& a) {
  return a.array && !(a.per_geometry && group.per_geometry);
}

}  // namespace

ComputeGroup GroupOf(const NodeDef& def, std::span<const Port> ports, std::vector<std::string>* problems) {
  ComputeGroup group;
  group.named = true;
  const auto tell = [&](const Port& port, const std::string& text) {
    problems->push_back(fmt::format("node type \"{}\", attribute \"{}\": compute {} it, {}", def.name,
                                    port.name, port.input ? "reads" : "writes", text));
  };
  for (const Port& port : ports) {
    const int number = FindByName(def, port.name);
    const AttributeDef* a = number < 0 ? nullptr : &def.attributes[static_cast<std::size_t>(number)];
    if (a == nullptr) {
      std::string names;
      for (const AttributeDef& other : def.attributes) {
        if (other.output == !port.input && !other.structural)
          names += (names.empty() ? "" : ", ") + other.name;
      }
      tell(port, fmt::format("but it is not declared; expected one of the {}s before it ({})",
                             port.input ? "input" : "output", names.empty() ? "none" : names));
    } else if (a->output == port.input) {
      tell(port, a->output ? "but it is an output" : "but it is an input");
    } else if (a->structural) {
      tell(port, "but it is structural; expected it to be read where kernels are bound");
    } else if (a->output && def.GroupOfOutput(number) >= 0) {
      tell(port, "as another one does; expected one compute for each output");
    } else {
      (port.input ? group.inputs : group.outputs).push_back(number);
      if (a->output && a->per_geometry) group.per_geometry = true;
    }
  }
  for (const Port& port : ports) {
    const int number = FindByName(def, port.name);
    if (number < 0) continue;
    const AttributeDef& a = def.attributes[static_cast<std::size_t>(number)];
    const bool array = IsArrayIn(group, a);
    if (a.output == port.input || a.structural) continue;
    if (Fits(port.parameter, a, port.input) && port.parameter.array == array) continue;
    problems->push_back(fmt::format(
        "node type \"{}\", attribute \"{}\" ({}): compute {} it as {}; expected {}", def.name, a.name,
        Described(a), port.input ? "reads" : "writes", GivenPort(port), ExpectedPort(a, array, port.input)));
  }
  return group;
}

std::vector<std::string> PortProblems(const NodeDef& def, const ComputeGroup& group,
                                      std::span<const Port> ports, std::string_view word) {
  std::vector<std::string> problems;
  std::size_t inputs = 0, outputs = 0;
  for (const Port& port : ports) {
    const std::vector<int>& numbers = port.input ? group.inputs : group.outputs;
    const std::size_t at = port.input ? inputs++ : outputs++;
    const AttributeDef* a =
        at < numbers.size() ? &def.attributes[static_cast<std::size_t>(numbers[at])] : nullptr;
    if (a != nullptr && a->name == port.name && port.parameter.array == IsArrayIn(group, *a) &&
        Fits(port.parameter, *a, port.input))
      continue;
    problems.push_back(fmt::format(
        "node type \"{}\", attribute \"{}\": {} names it as {} {}; expected {}, as the compute before it",
        def.name, port.name, word, port.input ? "input" : "output", at + 1,
        a == nullptr ? std::string("no more of them")
                     : fmt::format("{} ({})", a->name, ExpectedPort(*a, IsArrayIn(group, *a), port.input))));
  }
  return problems;
}

std::vector<std::string> SignatureProblems(const NodeDef& def, const ComputeGroup& group,
                                           const ComputeSignature& signature) {
  std::vector<std::string> problems;
  const auto attribute = [&](int number) -> const AttributeDef& {
    return def.attributes[static_cast<std::size_t>(number)];
  };
  const std::size_t given = signature.parameters.size();
  if (given != group.inputs.size()) {
    std::string names;
    for (int input : group.inputs) names += (names.empty() ? "" : ", ") + attribute(input).name;
    problems.push_back(fmt::format(
        "node type \"{}\": compute takes {} parameter{}; expected {}, one for each input that is not "
        "structural "
        "({})",
        def.name, given, given == 1 ? "" : "s", group.inputs.size(), names.empty() ? "none" : names));
  }
  for (std::size_t i = 0; i < given && i < group.inputs.size(); ++i) {
    const AttributeDef& a = attribute(group.inputs[i]);
    if (Fits(signature.parameters[i], a) && signature.parameters[i].array == a.array) continue;
    problems.push_back(
        fmt::format("node type \"{}\", attribute \"{}\" ({}): compute takes {} as parameter {}; expected {}",
                    def.name, a.name, Described(a), CppName(signature.parameters[i]), i + 1,
                    Expected(a, a.array, ExpectedName(a.type, a.array))));
  }
  if (group.outputs.size() != 1) {
    problems.push_back(fmt::format(
        "node type \"{}\": compute returns one value, but is to compute {} outputs; expected a function "
        "of ComputeContext&, or a compute_for() for each of them",
        def.name, group.outputs.size()));
    return problems;
  }
  const AttributeDef& out = attribute(group.outputs[0]);
  if (out.array || IsPointType(out.type)) {
    problems.push_back(
        fmt::format("node type \"{}\", attribute \"{}\" ({}): compute returns {}; expected a function of "
                    "ComputeContext& that writes the output itself",
                    def.name, out.name, Described(out), CppName(signature.result)));
  } else if (!Fits(signature.result, out)) {
    problems.push_back(fmt::format("node type \"{}\", attribute \"{}\" ({}): compute returns {}; expected {}",
                                   def.name, out.name, Described(out), CppName(signature.result),
                                   ExpectedName(out.type, false)));
  }
  return problems;
}

}  // namespace kpsa::engine
