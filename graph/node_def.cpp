#include "graph/node_def.h"

#include <algorithm>
#include <stdexcept>

namespace kpsa::engine {

std::int64_t Structural::ChoiceOf(std::string_view name, const std::type_info& as) const {
  const std::type_info* declared = choice_type(name);
  if (declared != nullptr && *declared != as)
    throw std::logic_error(fmt::format("it asks for \"{}\" as another enum than it is declared with", name));
  return value(name).AsInt();
}

int NodeDef::FindAttribute(std::string_view attribute_name) const {
  for (std::size_t i = 0; i < attributes.size(); ++i) {
    if (attributes[i].name == attribute_name) return static_cast<int>(i);
  }
  for (std::size_t i = 0; i < attributes.size(); ++i) {
    for (const std::string& alias : attributes[i].aliases) {
      if (alias == attribute_name) return static_cast<int>(i);
    }
  }
  return -1;
}

int NodeDef::GroupOfOutput(int attribute) const {
  for (std::size_t g = 0; g < groups.size(); ++g) {
    for (int output : groups[g].outputs) {
      if (output == attribute) return static_cast<int>(g);
    }
  }
  return -1;
}

std::vector<std::string> NodeDef::Problems() const {
  std::vector<std::string> all = problems;
  if (name.empty()) all.push_back("a node type has no name");
  const bool named =
      !groups.empty() && std::ranges::all_of(groups, [](const ComputeGroup& g) { return g.named; });
  const auto is_read = [&](int number) {
    return std::ranges::any_of(
        groups, [&](const ComputeGroup& g) { return std::ranges::count(g.inputs, number) > 0; });
  };
  for (std::size_t i = 0; i < attributes.size(); ++i) {
    const AttributeDef& a = attributes[i];
    if (a.output && GroupOfOutput(static_cast<int>(i)) < 0)
      all.push_back(
          fmt::format("node type \"{}\", attribute \"{}\": nothing computes this output; expected a "
                      "compute() after it is declared",
                      name, a.name));
    if (named && !a.output && !a.structural && !is_read(static_cast<int>(i)))
      all.push_back(fmt::format(
          "node type \"{}\", attribute \"{}\": no compute names this input; expected it in the list "
          "of one",
          name, a.name));
  }
  return all;
}

std::vector<std::string> NodeDef::AttributeNames() const {
  std::vector<std::string> names;
  for (const AttributeDef& attribute : attributes) names.push_back(attribute.name);
  return names;
}

}  // namespace kpsa::engine
