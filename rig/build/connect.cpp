// Connections, unit conversions, and names of meshes and transforms.
#include <algorithm>
#include <cmath>

#include "rig/build/rig_build.h"
#include "rig/build/references.h"

namespace kpsa::engine {

// The rest of a curve node is set by now, or has its own error.
std::optional<NodeId> RigBuild::FindCurve(const YamlNode& value) {
  std::string name;
  if (!ReadString(value, "curve", &name, errors_)) return std::nullopt;
  const Result<NodeId> curve = graph().FindNode(name);
  if (!curve.ok()) {
    errors_->Add(value, curve.status());
    return std::nullopt;
  }
  if (graph().def(*curve).name != "curve") {
    errors_->Add(value, "\"{}\" is a {}; expected a curve", name, graph().def(*curve).name);
    return std::nullopt;
  }
  GraphEditor edit(&graph());
  const bool set = graph().FindValue(edit.Plug(*curve, "curve")) != nullptr;
  return set ? std::optional(*curve) : std::nullopt;
}

// A wire's `curve: lips` or `curves: [upper, lower]`: the rest curves as assets, and what moves them.
void RigBuild::ConnectCurves() {
  for (Made& made : made_) {
    const auto one = made.special.find("curve"), several = made.special.find("curves");
    GraphEditor edit(&graph());
    const auto follow = [&](const YamlNode& value, const char* rest, const char* displacements, int element) {
      const std::optional<NodeId> curve = FindCurve(value);
      if (!curve.has_value()) return;
      edit.Set(made.id, rest, element, *graph().FindValue(edit.Plug(*curve, "curve")));
      edit.Connect(edit.Plug(*curve, "displacements"), edit.Plug(made.id, displacements, element));
      if (edit.Has(made.id, "curveMatrix"))
        edit.Connect(edit.Plug(*curve, "worldMatrix"), edit.Plug(made.id, "curveMatrix"));
      Fail(value.where(), edit.Take());
    };
    if (one != made.special.end()) follow(one->second->value, "curve", "displacements", -1);
    if (several == made.special.end()) continue;
    const YamlNode& list = several->second->value;
    if (one != made.special.end()) {
      errors_->Add(several->second->key, "\"{}\" has a curve, too: write all of them in curves",
                   made.from->name);
    } else if (!list.is_sequence() || list.items.empty()) {
      errors_->Add(list, "curves: expected a list of curves, as in [lipsUp, lipsLow]");
    } else {
      for (std::size_t i = 0; i < list.items.size(); ++i)
        follow(list.items[i], "baseWire", "deformedWire", static_cast<int>(i));
    }
  }
}

void RigBuild::MakeConnections() {
  for (const Pending& pending : pending_) {
    if (errors_->full()) return;
    const Result<PlugRef> from = graph().FindPlug(pending.from);
    if (!from.ok()) {
      Fail(pending.where, from.status());
      continue;
    }
    if (!pending.overrides) ConnectUnlessOverridden(*from, pending.to, pending.where, pending.source, false);
  }
  std::map<PlugKey, SourceLocation> across;  // into references, where what was connected gives way
  for (const RigConnection& connection : file_->connections) {
    if (errors_->full()) return;
    const Result<PlugRef> from = graph().FindPlug(connection.from);
    const Result<PlugRef> to = graph().FindPlug(connection.to);
    const bool good = Fail(connection.where, from.status());
    if (!Fail(connection.where, to.status()) || !good) continue;
    if (ReferenceOf(*rig_, to->node) != nullptr) {
      const auto [it, added] = across.emplace(KeyOf(*to), connection.where);
      if (!added) {
        Fail(connection.where, Status::Invalid("{} is connected twice: here and at {}", graph().PlugName(*to),
                                               it->second.ToString()));
        continue;
      }
    }
    ConnectUnlessOverridden(*from, *to, connection.where, connection.source, connection.override_clip);
  }
  for (const Pending& pending : pending_) {
    const Result<PlugRef> from = graph().FindPlug(pending.from);
    if (pending.overrides && from.ok())
      ConnectPlugs(*from, pending.to, pending.where, pending.source, true, true);
  }
}

// Whether an override sets or connects the plug, or what it is a part of.
bool RigBuild::IsOverridden(const PlugRef& plug) const {
  for (const int element : {plug.element, -1}) {
    for (const int component : {plug.component, -1}) {
      if (overridden_plugs_.count({plug.node.index, plug.attribute, element, component}) != 0) return true;
    }
  }
  return false;
}

// What a node or a connection asked for gives way to overrides: of the whole plug, or of single components.
void RigBuild::ConnectUnlessOverridden(const PlugRef& from, const PlugRef& to, const SourceLocation& where,
                                       int source, bool override_clip) {
  if (IsOverridden(to)) return;
  bool by_component = false, by_element = false;
  for (auto it = overridden_plugs_.lower_bound({to.node.index, to.attribute, to.element, -1});
       it != overridden_plugs_.end(); ++it) {
    const auto& [node, attribute, element, component] = *it;
    if (node != to.node.index || attribute != to.attribute) break;
    if (to.element >= 0 && element != to.element) break;
    if (to.component >= 0 && component != to.component) continue;
    by_component = by_component || element == to.element;
    by_element = by_element || element != to.element;
  }
  if (by_element) {
    Fail(where,
         Status::Invalid("{} drives {} as a whole, and an override changes a part of it: override {} itself",
                         graph().PlugName(from), graph().PlugName(to), graph().PlugName(to)));
    return;
  }
  if (!by_component) {
    ConnectPlugs(from, to, where, source, override_clip, false);
    return;
  }
  if (graph().PlugType(from) != graph().PlugType(to)) {
    Fail(where, graph().Connect(from, to));  // says what does not fit
    return;
  }
  for (int i = 0; i < (graph().PlugType(to) == Type::kQuaternion ? 4 : 3); ++i) {
    PlugRef from_part = from, to_part = to;
    from_part.component = to_part.component = i;
    if (!IsOverridden(to_part)) ConnectPlugs(from_part, to_part, where, source, override_clip, false);
  }
}

// The unit of a plug's numbers; points and matrices as wholes are never converted.
Unit RigBuild::PlugUnit(const PlugRef& plug) const {
  const Type type = graph().PlugType(plug);
  if (type != Type::kDouble && type != Type::kDouble3) return Unit::kNone;
  return graph().def(plug.node).attributes[static_cast<std::size_t>(plug.attribute)].unit;
}

void RigBuild::ConnectPlugs(const PlugRef& from, const PlugRef& to, const SourceLocation& where, int source,
                            bool override_clip, bool replace) {
  if (IsClipPlug(rig_->scene, graph(), to)) {
    if (!override_clip) {
      Fail(where,
           Status::Invalid("a clip drives {0}: write {{from: {1}, to: {0}, override: true}} to take it over",
                           graph().PlugName(to), graph().PlugName(from)));
      return;
    }
    replace = true;
  }
  // What the referenced file connects gives way, the parts of the plug and what it is a part of as well
  if (const Reference* reference = ReferenceOf(*rig_, to.node); reference != nullptr) {
    const auto overlap = [](int a, int b) { return a == b || a < 0 || b < 0; };
    std::vector<PlugRef> driven;
    for (const Connection& driver : graph().Inputs(to.node, to.attribute)) {
      const PlugRef& plug = driver.destination;
      const NodeId by = driver.source.node;
      const bool theirs =
          ReferenceOf(*rig_, by) == reference || by == reference->root || by == rig_->scene.time.node;
      if (theirs && overlap(plug.element, to.element) && overlap(plug.component, to.component))
        driven.push_back(plug);
    }
    for (const PlugRef& plug : driven) Fail(where, graph().Disconnect(plug));
  }
  const double factor = units(source).FactorOf(PlugUnit(to)) / units(source).FactorOf(PlugUnit(from));
  const Type from_type = graph().PlugType(from), to_type = graph().PlugType(to);
  const bool triple = from_type == Type::kDouble3 && to_type == Type::kDouble3;
  const bool scalar = to_type == Type::kDouble && (from_type == Type::kDouble || from_type <= Type::kEnum);
  if (PlugUnit(from) == PlugUnit(to) || factor == 1 || (!triple && !scalar)) {
    Fail(where, graph().Connect(from, to, replace));
    return;
  }
  // As Maya does: a node that converts, one a component
  if (replace && graph().FindConnection(to) != nullptr) Fail(where, graph().Disconnect(to));
  for (int i = triple ? 0 : -1; i < (triple ? 3 : 0); ++i) {
    PlugRef from_part = from, to_part = to;
    if (triple) from_part.component = to_part.component = i;
    GraphEditor edit(&graph());
    const NodeId conversion =
        edit.AddFresh("unitConversion", fmt::format("unitConversion{}", ++conversions_));
    if (edit.ok()) edit.Set(conversion, "conversionFactor", factor);
    if (edit.ok()) {
      edit.Connect(from_part, edit.Plug(conversion, "input"));
      edit.Connect(edit.Plug(conversion, "output"), to_part);
    }
    Fail(where, edit.Take());
  }
}

// Among mesh nodes only: by glTF name, name in outputs, `name#<index>` or path.
std::optional<std::size_t> RigBuild::FindMesh(const std::string& name, const SourceLocation& where) {
  std::vector<std::size_t> found;
  const auto by_name = gltf_by_name_.find(name);
  const Result<NodeId> by_plug_name =
      by_name == gltf_by_name_.end() ? graph().FindNode(name) : Result<NodeId>(NodeId());
  for (std::size_t m = 0; m < rig_->scene.meshes.size(); ++m) {
    const CharacterMesh& mesh = rig_->scene.meshes[m];
    const bool verbatim =
        by_name != gltf_by_name_.end() &&
        std::find(by_name->second.begin(), by_name->second.end(), mesh.gltf_node) != by_name->second.end();
    if (verbatim || mesh.name == name || (by_plug_name.ok() && *by_plug_name == mesh.transform))
      found.push_back(m);
  }
  if (found.size() == 1) return found[0];
  if (found.empty()) {
    std::vector<std::string> names;
    for (const CharacterMesh& mesh : rig_->scene.meshes) names.push_back(mesh.name);
    Fail(where, Status::Invalid("unknown mesh \"{}\"{}", name, DidYouMean(name, names)));
    return std::nullopt;
  }
  std::vector<std::string> several;
  for (std::size_t m : found) several.push_back(rig_->scene.meshes[m].name);
  Fail(where,
       Status::Invalid("\"{}\" is the name of several meshes: write {}", name, fmt::join(several, " or ")));
  return std::nullopt;
}

// Among transforms only: glTF nodes without a mesh first, then the rig's own, then mesh nodes.
std::optional<NodeId> RigBuild::FindTransform(const std::string& name, const SourceLocation& where) {
  std::vector<std::string> several;
  NodeId only;
  if (const auto it = gltf_by_name_.find(name); it != gltf_by_name_.end()) {
    for (Index i : it->second) {
      if (rig_->character->nodes[i].mesh != kNoIndex) continue;
      only = rig_->scene.transforms[i];
      several.push_back(graph().name(only));
    }
  }
  if (several.size() == 1) return only;
  if (several.size() > 1) {
    Fail(where, Status::Invalid("\"{}\" is the name of several transforms: write {}", name,
                                fmt::join(several, " or ")));
    return std::nullopt;
  }
  const Result<NodeId> found = graph().FindNode(name);
  if (!found.ok()) {
    Fail(where, found.status());
    return std::nullopt;
  }
  if (graph().def(*found).FindAttribute("worldMatrix") < 0) {
    Fail(where, Status::Invalid("\"{}\" is a {}; expected a transform", name, graph().def(*found).name));
    return std::nullopt;
  }
  return *found;
}

}  // namespace kpsa::engine
