#include "graph/compute_signature.h"

#include "graph/node_def.h"

namespace kpsa::engine {
namespace {

bool Fits(const ComputeParameter& parameter, Type type) {
  switch (parameter.kind) {
    case SlotKind::kBool:
      return type == Type::kBool;
    case SlotKind::kInteger:
      return type == Type::kInt || type == Type::kEnum || (parameter.array && type == Type::kBool);
    case SlotKind::kChoice:
      return type == Type::kEnum;
    case SlotKind::kDouble:
      return type == Type::kDouble;
    case SlotKind::kDouble3:
      return type == Type::kDouble3;
    case SlotKind::kQuaternion:
      return type == Type::kQuaternion;
    case SlotKind::kMatrix:
      return type == Type::kMatrix;
    case SlotKind::kPoints:
      return IsPointType(type);
    case SlotKind::kOther:
      return false;
  }
  return false;
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
    case SlotKind::kDouble:
      name = "double";
      break;
    case SlotKind::kDouble3:
      name = "Double3";
      break;
    case SlotKind::kQuaternion:
      name = "Quaternion";
      break;
    case SlotKind::kMatrix:
      name = "Matrix4";
      break;
    case SlotKind::kPoints:
      name = "ConstPointsView";
      break;
    case SlotKind::kOther:
      break;
  }
  return parameter.array ? fmt::format("ArrayView<{}>", name) : name;
}

// How a function takes an attribute of that type.
std::string ExpectedName(Type type, bool array) {
  ComputeParameter p{SlotKind::kOther, array};
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

}  // namespace

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
    if (Fits(signature.parameters[i], a.type) && signature.parameters[i].array == a.array) continue;
    problems.push_back(fmt::format(
        "node type \"{}\", attribute \"{}\" ({}): compute takes {} as parameter {}; expected {}", def.name,
        a.name, Described(a), CppName(signature.parameters[i]), i + 1, ExpectedName(a.type, a.array)));
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
  } else if (!Fits(signature.result, out.type)) {
    problems.push_back(fmt::format("node type \"{}\", attribute \"{}\" ({}): compute returns {}; expected {}",
                                   def.name, out.name, Described(out), CppName(signature.result),
                                   ExpectedName(out.type, false)));
  }
  return problems;
}

}  // namespace kpsa::engine
