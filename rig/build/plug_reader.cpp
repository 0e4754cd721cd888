#include "rig/build/plug_reader.h"

#include <algorithm>

#include "base/near_names.h"
#include "rig/build/references.h"
#include "rig/file/values.h"
#include "rig/file/words.h"

namespace kpsa::engine {

void PlugReader::ReadAttribute(const MadeNode& made, const RigAttribute& attribute) {
  const NodeDef& def = graph_->def(made.id);
  // A list for a whole array is one value an element
  const int number = def.FindAttribute(attribute.name);
  if (number >= 0) {
    const AttributeDef& a = def.attributes[static_cast<std::size_t>(number)];
    if (a.array && !a.per_geometry) {
      if (!attribute.value.is_sequence()) {
        in_.errors->Add(attribute.value, "{}.{} is an array: expected a list, or name one element, \"{}[0]\"",
                        made.from->name, a.name, a.name);
        return;
      }
      for (std::size_t i = 0; i < attribute.value.items.size(); ++i) {
        ReadPlug({made.id, number, static_cast<int>(i), -1}, attribute.value.items[i], attribute.source,
                 false);
      }
      return;
    }
  }
  const Result<PlugRef> plug = graph_->FindPlug(made.from->name + "." + attribute.name);
  if (!plug.ok()) {
    std::string base = attribute.name.substr(0, attribute.name.find_first_of("[."));
    if (number >= 0 || base != attribute.name) {
      in_.errors->Add(attribute.key, plug.status());
      return;
    }
    std::vector<std::string> names;
    for (const AttributeDef& a : def.attributes) {
      if (!a.output) names.push_back(a.name);
    }
    for (const RigWord& word : RigWordsOf(def)) names.push_back(word.name);
    if (NearNames(attribute.name, names).empty()) {
      in_.errors->Add(attribute.key,
                      "node \"{0}\" ({1}) has no attribute \"{2}\"; kpsa nodes {1} tells what it has",
                      made.from->name, def.name, attribute.name);
      return;
    }
    in_.errors->Add(attribute.key, "node \"{}\" ({}) has no attribute \"{}\"{}", made.from->name, def.name,
                    attribute.name, DidYouMean(attribute.name, names));
    return;
  }
  ReadPlug(*plug, attribute.value, attribute.source, false);
}

void PlugReader::ReadPlug(const PlugRef& plug, const YamlNode& value, int source, bool overrides) {
  const AttributeDef& attribute = graph_->def(plug.node).attributes[static_cast<std::size_t>(plug.attribute)];
  const Type type = graph_->PlugType(plug);
  const std::string what = graph_->PlugName(plug);
  if (attribute.output) {
    in_.errors->Add(value, "{} is an output and cannot be set", what);
    return;
  }
  auto& written = written_[overrides ? 1 : 0];
  if (const auto [it, added] = written.emplace(KeyOf(plug), value.where()); !added) {
    in_.errors->Add(value, "{} is {} twice: here and at {}", what, overrides ? "overridden" : "set",
                    it->second.ToString());
    return;
  }
  const auto is_connection = [&](const YamlNode& node, Type of) {
    return IsConnection(node, *graph_, of, attribute.unit, in_.units(source));
  };
  // A vector and one of its components: the order of a map decides nothing. A value whose component is driven
  // is fine
  const bool connected = is_connection(value, type);
  if (connected) connected_.insert(KeyOf(plug));
  for (int component = -1; component < 3; ++component) {
    PlugRef other = plug;
    other.component = component;
    if ((component < 0) == (plug.component < 0)) continue;
    const auto it = written.find(KeyOf(other));
    if (it == written.end()) continue;
    const bool other_connected = connected_.count(KeyOf(other)) != 0;
    if (component < 0 ? connected && !other_connected : !connected && other_connected) continue;
    in_.errors->Add(value, "{} is {} here, and {} at {}: give the components or the whole", what,
                    overrides ? "overridden" : "set", graph_->PlugName(other), it->second.ToString());
    return;
  }
  if (connected) {
    const std::string& prefix = in_.file.sources[static_cast<std::size_t>(source)].referenced_as;
    if (!value.scalar.starts_with(prefix)) {  // a node of the file that references this one, or of another
      returned_->push_back({{what, value.where(), source}, value});
      return;
    }
    pending_.push_back({value.scalar.substr(prefix.size()), plug, value.where(), source, overrides});
    if (overrides) Override(plug, false);
    return;
  }
  // [a.x, 0, b.y]: components of their own
  if (type == Type::kDouble3 && value.is_sequence() && value.items.size() == 3 &&
      std::any_of(value.items.begin(), value.items.end(),
                  [&](const YamlNode& item) { return is_connection(item, Type::kDouble); })) {
    written.erase(KeyOf(plug));
    for (int i = 0; i < 3; ++i) {
      PlugRef component = plug;
      component.component = i;
      ReadPlug(component, value.items[static_cast<std::size_t>(i)], source, overrides);
    }
    return;
  }
  Value read;
  if (!ReadValue(value, what, attribute, type, in_.units(source), &read, in_.errors)) return;
  // Characters stand where their files have them at rest
  in_.errors->Add(value, IsReferenceRoot(in_.rig, plug.node) ? graph_->Pose(plug, std::move(read))
                                                             : graph_->Set(plug, std::move(read)));
  if (overrides) Override(plug, true);
}

}  // namespace kpsa::engine
