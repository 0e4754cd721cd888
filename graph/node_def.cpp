#include "graph/node_def.h"

namespace kpsa::engine {

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
  for (std::size_t i = 0; i < attributes.size(); ++i) {
    const AttributeDef& a = attributes[i];
    if (a.output && GroupOfOutput(static_cast<int>(i)) < 0)
      all.push_back(
          fmt::format("node type \"{}\", attribute \"{}\": nothing computes this output; expected a "
                      "compute() after it is declared",
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
