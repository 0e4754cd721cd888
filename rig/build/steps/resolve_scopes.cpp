#include "rig/build/steps/resolve_scopes.h"

#include <algorithm>
#include <iterator>
#include <string_view>

#include "rig/file/words.h"

namespace kpsa::engine {
namespace {

bool TakesPlugs(const AttributeDef& attribute) {
  return (IsSmallType(attribute.type) && attribute.type != Type::kEnum) || IsPointType(attribute.type);
}

// Words of a rig file whose values name nodes. Those of a blend shape's targets are the mesh's.
bool NamesNodes(const NodeDef& def, std::string_view word) {
  constexpr std::string_view kWords[] = {"parent",      "at",    "curve", "curves", "falloffs", "driver",
                                         "constrained", "start", "mid",   "end",    "camera",   "lights"};
  return std::ranges::find(kWords, word) != std::end(kWords) ||
         (word == "targets" && def.name != "blendShape");
}

// The text with the prefix of the innermost scope that has a node of this name: up to the end, or what
// follows a node's name in plugs and places.
std::string InScope(const RigNames& names, const RigFile& file, const std::string& text, int source) {
  for (int s = source; s >= 0; s = file.sources[static_cast<std::size_t>(s)].outer) {
    const std::string& scope = file.sources[static_cast<std::size_t>(s)].scope;
    if (scope.empty()) break;
    const std::string name = scope + text;
    for (std::size_t end = name.size(); end != std::string::npos && end > scope.size();
         end = name.find_last_of(".[@", end - 1)) {
      if (names.IsWritten(name.substr(0, end))) return name;
    }
  }
  return text;
}

void InScope(const RigNames& names, const RigFile& file, YamlNode* value, int source) {
  if (value->is_scalar()) value->scalar = InScope(names, file, value->scalar, source);
  if (value->is_sequence()) {
    for (YamlNode& item : value->items) InScope(names, file, &item, source);
  }
}

}  // namespace

void ResolveScopes(const RigNames& names, const NodeRegistry& registry, RigFile* file) {
  const auto scoped = [&](int source) {
    return !file->sources[static_cast<std::size_t>(source)].scope.empty();
  };
  for (RigNode& node : file->nodes) {
    const NodeDef* def = registry.Find(node.type);
    if (!scoped(node.source) || def == nullptr) continue;
    for (RigAttribute& attribute : node.attributes) {
      if (IsRigWord(*def, attribute.name)) {
        if (NamesNodes(*def, attribute.name) || (attribute.name == "falloff" && attribute.value.is_scalar()))
          InScope(names, *file, &attribute.value, attribute.source);
        if (attribute.name != "falloff" || !attribute.value.is_map()) continue;
        for (std::size_t i = 0; i < attribute.value.keys.size(); ++i) {
          if (attribute.value.keys[i].scalar == "at")
            InScope(names, *file, &attribute.value.items[i], attribute.source);
        }
        continue;
      }
      const std::string name = attribute.name.substr(0, attribute.name.find_first_of("[."));
      int number = def->FindAttribute(name);
      if (number < 0 && name.size() > 1) number = def->FindAttribute(name.substr(0, name.size() - 1));
      if (number >= 0 && TakesPlugs(def->attributes[static_cast<std::size_t>(number)]))
        InScope(names, *file, &attribute.value, attribute.source);
    }
  }
  for (RigConnection& connection : file->connections) {
    connection.from = InScope(names, *file, connection.from, connection.source);
    connection.to = InScope(names, *file, connection.to, connection.source);
  }
  for (RigDeform& deform : file->deform) {
    for (RigString& deformer : deform.stack)
      deformer.text = InScope(names, *file, deformer.text, deformer.source);
    if (deform.points.has_value())
      deform.points->text = InScope(names, *file, deform.points->text, deform.points->source);
  }
  for (RigControl& control : file->controls)
    control.plug.text = InScope(names, *file, control.plug.text, control.plug.source);
}

}  // namespace kpsa::engine
