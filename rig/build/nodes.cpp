// The nodes of a rig file, the values of their attributes, and overrides.
#include <algorithm>

#include "base/text.h"
#include "rig/build/rig_build.h"
#include "rig/build/references.h"
#include "rig/file/words.h"

namespace kpsa::engine {
namespace {

// Words of stacks: no node may be called so.
constexpr const char* kStackWords[] = {"gltf", "morph", "skin", "transform"};

const AttributeDef& AttributeOf(const Graph& graph, const PlugRef& plug) {
  return graph.def(plug.node).attributes[static_cast<std::size_t>(plug.attribute)];
}

}  // namespace

// What the file that references this one calls ours, as we call it.
void RigBuild::InOwnNames(YamlNode* value, int source) const {
  const std::string& prefix = file_->sources[static_cast<std::size_t>(source)].referenced_as;
  if (prefix.empty()) return;
  if (value->is_scalar() && value->scalar.starts_with(prefix)) value->scalar.erase(0, prefix.size());
  for (YamlNode& item : value->items) InOwnNames(&item, source);
}

RigAttribute RigBuild::SpecialOf(const std::string& key, const RigOverride& override_) const {
  YamlNode key_node;
  key_node.kind = YamlNode::Kind::kScalar;
  key_node.scalar = key;
  key_node.file = override_.value.file;
  key_node.line = override_.plug.where.line;
  key_node.column = override_.plug.where.column;
  RigAttribute special{key, key_node, override_.value, override_.plug.source};
  InOwnNames(&special.value, special.source);
  return special;
}

// An override of a word that is no attribute replaces it in the node before anything is read:
// `wire1.weights`, `lips.vertices`.
void RigBuild::ApplySpecialOverrides() {
  std::vector<RigOverride> others;
  for (RigOverride& override_ : file_->overrides) {
    const std::string& text = override_.plug.text;
    const std::size_t dot = LongestBefore(
        '.', text, [&](std::string_view name) { return written_.count(std::string(name)) != 0; });
    RigNode* const longest =
        dot == std::string::npos ? nullptr : &file_->nodes[written_.at(text.substr(0, dot))];
    const NodeDef* def = longest == nullptr ? nullptr : graph().registry().Find(longest->type);
    const std::string key = longest == nullptr ? "" : text.substr(longest->name.size() + 1);
    if (def == nullptr || !IsRigWord(*def, key)) {
      if (longest == nullptr && TakeOwnSpecial(override_)) continue;
      others.push_back(std::move(override_));
      continue;
    }
    auto& attributes = longest->attributes;
    attributes.erase(std::remove_if(attributes.begin(), attributes.end(),
                                    [&](const RigAttribute& a) { return a.name == key; }),
                     attributes.end());
    attributes.push_back(SpecialOf(key, override_));
  }
  file_->overrides = std::move(others);
}

void RigBuild::AddNodes() {
  for (const RigNode& node : file_->nodes) {
    if (errors_->full()) return;
    if (std::find(std::begin(kStackWords), std::end(kStackWords), node.name) != std::end(kStackWords)) {
      Fail(node.where, Status::Invalid("\"{}\" is a word of stacks: give the node another name", node.name));
      continue;
    }
    if (graph().registry().Find(node.type) == nullptr) {
      errors_->Add(node.type_node, "unknown node type \"{}\"{}", node.type,
                   DidYouMean(node.type, graph().registry().Names()));
      continue;
    }
    Result<NodeId> id = graph().AddNode(node.type, node.name);
    if (!Fail(node.where, id.status())) continue;
    made_by_node_[id->index] = made_.size();
    made_by_name_[node.name] = made_.size();
    rig_->node_places[node.name] = node.where;
    made_.push_back({&node, *id, {}});
  }
}

void RigBuild::ReadAttributes(Made* made) {
  const NodeDef& def = graph().def(made->id);
  if (def.name == "blendShape") NameTargets(*made);
  // Structural ones first, in whatever order they are written: points[s,t,u] needs the divisions
  for (const bool structural : {true, false}) {
    for (const RigAttribute& attribute : made->from->attributes) {
      const int number = def.FindAttribute(attribute.name);
      if ((number >= 0 && def.attributes[static_cast<std::size_t>(number)].structural) != structural)
        continue;
      if (IsRigWord(def, attribute.name)) {
        made->special[attribute.name] = &attribute;
      } else {
        ReadAttribute(*made, attribute, false);
      }
    }
  }
}

void RigBuild::ReadAttribute(const Made& made, const RigAttribute& attribute, bool overrides) {
  const NodeDef& def = graph().def(made.id);
  // A list for a whole array is one value an element
  const int number = def.FindAttribute(attribute.name);
  if (number >= 0) {
    const AttributeDef& a = def.attributes[static_cast<std::size_t>(number)];
    if (a.array && !a.per_geometry) {
      if (!attribute.value.is_sequence()) {
        errors_->Add(attribute.value, "{}.{} is an array: expected a list, or name one element, \"{}[0]\"",
                     made.from->name, a.name, a.name);
        return;
      }
      for (std::size_t i = 0; i < attribute.value.items.size(); ++i) {
        ReadPlug({made.id, number, static_cast<int>(i), -1}, attribute.value.items[i], attribute.source,
                 overrides);
      }
      return;
    }
  }
  const Result<PlugRef> plug = graph().FindPlug(made.from->name + "." + attribute.name);
  if (!plug.ok()) {
    std::string base = attribute.name.substr(0, attribute.name.find_first_of("[."));
    if (number >= 0 || base != attribute.name) {
      errors_->Add(attribute.key, plug.status());
      return;
    }
    std::vector<std::string> names;
    for (const AttributeDef& a : def.attributes) {
      if (!a.output) names.push_back(a.name);
    }
    for (const RigWord& word : RigWordsOf(def)) names.push_back(word.name);
    errors_->Add(attribute.key, "node \"{}\" ({}) has no attribute \"{}\"{}", made.from->name, def.name,
                 attribute.name, DidYouMean(attribute.name, names));
    return;
  }
  ReadPlug(*plug, attribute.value, attribute.source, overrides);
}

// Sets the value, or notes the connection, that is written for one plug.
void RigBuild::ReadPlug(const PlugRef& plug, const YamlNode& value, int source, bool overrides) {
  const AttributeDef& attribute = AttributeOf(graph(), plug);
  const Type type = graph().PlugType(plug);
  const std::string what = graph().PlugName(plug);
  if (attribute.output) {
    errors_->Add(value, "{} is an output and cannot be set", what);
    return;
  }
  auto& written = written_plugs_[overrides ? 1 : 0];
  if (const auto [it, added] = written.emplace(KeyOf(plug), value.where()); !added) {
    errors_->Add(value, "{} is {} twice: here and at {}", what, overrides ? "overridden" : "set",
                 it->second.ToString());
    return;
  }
  const auto is_connection = [&](const YamlNode& node, Type of) {
    return IsConnection(node, graph(), of, attribute.unit, units(source));
  };
  // A vector and one of its components: the order of a map decides nothing. A value whose component is driven
  // is fine
  const bool connected = is_connection(value, type);
  if (connected) connected_plugs_.insert(KeyOf(plug));
  for (int component = -1; component < 3; ++component) {
    PlugRef other = plug;
    other.component = component;
    if ((component < 0) == (plug.component < 0)) continue;
    const auto it = written.find(KeyOf(other));
    if (it == written.end()) continue;
    const bool other_connected = connected_plugs_.count(KeyOf(other)) != 0;
    if (component < 0 ? connected && !other_connected : !connected && other_connected) continue;
    errors_->Add(value, "{} is {} here, and {} at {}: give the components or the whole", what,
                 overrides ? "overridden" : "set", graph().PlugName(other), it->second.ToString());
    return;
  }
  if (connected) {
    const std::string& prefix = file_->sources[static_cast<std::size_t>(source)].referenced_as;
    if (!value.scalar.starts_with(prefix)) {  // a node of the file that references this one, or of another
      file_->returned.push_back({{what, value.where(), source}, value});
      return;
    }
    pending_.push_back({value.scalar.substr(prefix.size()), plug, value.where(), source, overrides});
    if (overrides) overridden_.emplace_back(plug, false);
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
  if (!ReadValue(value, what, attribute, type, units(source), &read, errors_)) return;
  // Characters stand where their files have them at rest
  errors_->Add(value, IsReferenceRoot(*rig_, plug.node) ? graph().Pose(plug, std::move(read))
                                                        : graph().Set(plug, std::move(read)));
  if (overrides) overridden_.emplace_back(plug, true);
}

// Values are set at once (others may depend on them, as lattice points on divisions); connections wait.
void RigBuild::ReadOverrides() {
  const auto is_structural = [&](const RigOverride& override_) {
    const Result<PlugRef> plug = graph().FindPlug(override_.plug.text);
    return plug.ok() && AttributeOf(graph(), *plug).structural;
  };
  std::vector<const RigOverride*> others;
  for (const RigOverride& override_ : file_->overrides) {
    if (errors_->full()) return;
    if (is_structural(override_)) {
      ReadOverride(override_);
    } else {
      others.push_back(&override_);
    }
  }
  for (const RigOverride* override_ : others) {
    if (errors_->full()) return;
    ReadOverride(*override_);
  }
  for (const auto& [plug, by_value] : overridden_) overridden_plugs_.insert(KeyOf(plug));
}

void RigBuild::ReadOverride(const RigOverride& override_) {
  const Result<PlugRef> plug = graph().FindPlug(override_.plug.text);
  if (plug.ok()) {
    ReadPlug(*plug, override_.value, override_.plug.source, true);
    return;
  }
  // A list for a whole array: its elements, and no others
  const Result<PlugRef> first = graph().FindPlug(override_.plug.text + "[0]");
  if (!first.ok() || !AttributeOf(graph(), *first).array || !override_.value.is_sequence()) {
    Fail(override_.plug.where, plug.status());
    return;
  }
  PlugRef element = *first;
  const int before = graph().ArraySize(element.node, element.attribute),
            now = static_cast<int>(override_.value.items.size());
  for (; element.element < now; ++element.element) {
    if (errors_->full() || !Fail(override_.plug.where, graph().CheckPlug(element))) return;
    ReadPlug(element, override_.value.items[static_cast<std::size_t>(element.element)], override_.plug.source,
             true);
  }
  for (; element.element < before; ++element.element) {
    Fail(override_.plug.where, graph().Unset(element));
    overridden_.emplace_back(element, true);
  }
}

// An overriding value also ends what drives the plug; a stack takes it as its input.
void RigBuild::FinishOverrides() {
  for (const auto& [plug, by_value] : overridden_) {
    if (!by_value || stacked_.count(KeyOf(plug)) != 0) continue;
    if (graph().FindConnection(plug) != nullptr) Fail({}, graph().Disconnect(plug));
    if (IsClipPlug(rig_->scene, graph(), plug)) rig_->pinned.push_back(plug);
  }
}

// What no chosen variant sets exists all the same.
void RigBuild::CheckVariants() {
  for (const RigVariant& variant : file_->variants) {
    for (const RigOverride& override_ : variant.overrides) {
      const std::string& text = override_.plug.text;
      if (errors_->full()) return;
      const Result<PlugRef> plug = graph().FindPlug(text);
      if (plug.ok() || graph().FindPlug(text + "[0]").ok()) continue;
      const std::size_t dot = text.rfind('.');
      const Result<NodeId> node = graph().FindNode(text.substr(0, dot));
      const bool written = dot != std::string::npos && node.ok() &&
                           (FindMade(*node) != nullptr || ReferenceOf(*rig_, *node) != nullptr);
      if (!written || !IsRigWord(graph().def(*node), text.substr(dot + 1)))
        Fail(override_.plug.where, plug.status());
    }
  }
}

}  // namespace kpsa::engine
