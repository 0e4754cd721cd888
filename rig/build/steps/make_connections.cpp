#include "rig/build/steps/make_connections.h"

#include <algorithm>
#include <map>

#include "rig/build/references.h"
#include "rig/build/starter_text.h"
#include "rig/graph_editor.h"

namespace kpsa::engine {
namespace {

class Connections {
 public:
  Connections(const BuildInput& in, const OverriddenPlugs& overridden, Graph* graph)
      : in_(in), overridden_(overridden), graph_(graph) {}

  void Run(const std::vector<PendingConnection>& pending) {
    for (const PendingConnection& wanted : pending) {
      if (in_.errors->full()) return;
      const Result<PlugRef> from = graph_->FindPlug(wanted.from);
      if (!from.ok()) {
        // A word in the place of a value was perhaps meant as one
        const bool word = wanted.from.find('.') == std::string::npos;
        in_.FailPlug(wanted.where, wanted.from,
                     word ? Status::Invalid("{}: \"{}\" is neither a value of it nor a plug, node.attribute",
                                            graph_->PlugName(wanted.to), wanted.from)
                          : from.status());
        continue;
      }
      if (!wanted.overrides) ConnectUnlessOverridden(*from, wanted.to, wanted.where, wanted.source, false);
    }
    std::map<PlugKey, SourceLocation> across;  // into references, where what was connected gives way
    for (const RigConnection& connection : in_.file.connections) {
      if (in_.errors->full()) return;
      const Result<PlugRef> from = graph_->FindPlug(connection.from);
      const Result<PlugRef> to = graph_->FindPlug(connection.to);
      const bool good = in_.FailPlug(connection.where, connection.from, from.status());
      if (!in_.FailPlug(connection.where, connection.to, to.status()) || !good) continue;
      if (ReferenceOf(in_.rig, to->node) != nullptr) {
        const auto [it, added] = across.emplace(KeyOf(*to), connection.where);
        if (!added) {
          in_.Fail(connection.where, Status::Invalid("{} is connected twice: here and at {}",
                                                     graph_->PlugName(*to), it->second.ToString()));
          continue;
        }
      }
      ConnectUnlessOverridden(*from, *to, connection.where, connection.source, connection.override_clip);
    }
    for (const PendingConnection& wanted : pending) {
      const Result<PlugRef> from = graph_->FindPlug(wanted.from);
      if (wanted.overrides && from.ok())
        ConnectPlugs(*from, wanted.to, wanted.where, wanted.source, true, true);
    }
  }

 private:
  // The unit of a plug's numbers; points and matrices as wholes are never converted.
  Unit PlugUnit(const PlugRef& plug) const {
    const Type type = graph_->PlugType(plug);
    if (type != Type::kDouble && type != Type::kDouble3) return Unit::kNone;
    return graph_->def(plug.node).attributes[static_cast<std::size_t>(plug.attribute)].unit;
  }

  // What a node or a connection asked for gives way to overrides: of the whole plug, or of single components.
  void ConnectUnlessOverridden(const PlugRef& from, const PlugRef& to, const SourceLocation& where,
                               int source, bool override_clip) {
    if (overridden_.Contains(to)) return;
    bool by_component = false, by_element = false;
    for (auto it = overridden_.keys.lower_bound({to.node.index, to.attribute, to.element, -1});
         it != overridden_.keys.end(); ++it) {
      const auto& [node, attribute, element, component] = *it;
      if (node != to.node.index || attribute != to.attribute) break;
      if (to.element >= 0 && element != to.element) break;
      if (to.component >= 0 && component != to.component) continue;
      by_component = by_component || element == to.element;
      by_element = by_element || element != to.element;
    }
    if (by_element) {
      in_.Fail(where, Status::Invalid(
                          "{} drives {} as a whole, and an override changes a part of it: override {} itself",
                          graph_->PlugName(from), graph_->PlugName(to), graph_->PlugName(to)));
      return;
    }
    if (!by_component) {
      ConnectPlugs(from, to, where, source, override_clip, false);
      return;
    }
    if (graph_->PlugType(from) != graph_->PlugType(to)) {
      in_.Fail(where, graph_->Connect(from, to));  // says what does not fit
      return;
    }
    for (int i = 0; i < (graph_->PlugType(to) == Type::kQuaternion ? 4 : 3); ++i) {
      PlugRef from_part = from, to_part = to;
      from_part.component = to_part.component = i;
      if (!overridden_.Contains(to_part))
        ConnectPlugs(from_part, to_part, where, source, override_clip, false);
    }
  }

  void ConnectPlugs(const PlugRef& from, const PlugRef& to, const SourceLocation& where, int source,
                    bool override_clip, bool replace) {
    if (IsClipPlug(in_.rig.scene, *graph_, to)) {
      if (!override_clip) {
        in_.Fail(where, Status::Invalid(
                            "a clip drives {}: write {{from: {}, to: {}, override: true}} to take it over",
                            graph_->PlugName(to), Quoted(graph_->PlugName(from), true),
                            Quoted(graph_->PlugName(to), true)));
        return;
      }
      replace = true;
    }
    // What the referenced file connects gives way, the parts of the plug and what it is a part of as well
    if (const Reference* reference = ReferenceOf(in_.rig, to.node); reference != nullptr) {
      const auto overlap = [](int a, int b) { return a == b || a < 0 || b < 0; };
      std::vector<PlugRef> driven;
      for (const Connection& driver : graph_->Inputs(to.node, to.attribute)) {
        const PlugRef& plug = driver.destination;
        const NodeId by = driver.source.node;
        const bool theirs =
            ReferenceOf(in_.rig, by) == reference || by == reference->root || by == in_.rig.scene.time.node;
        if (theirs && overlap(plug.element, to.element) && overlap(plug.component, to.component))
          driven.push_back(plug);
      }
      for (const PlugRef& plug : driven) in_.Fail(where, graph_->Disconnect(plug));
    }
    const double factor =
        in_.units(source).FactorOf(PlugUnit(to)) / in_.units(source).FactorOf(PlugUnit(from));
    const Type from_type = graph_->PlugType(from), to_type = graph_->PlugType(to);
    const bool triple = from_type == Type::kDouble3 && to_type == Type::kDouble3;
    const bool scalar = to_type == Type::kDouble && (from_type == Type::kDouble || from_type <= Type::kEnum);
    if (PlugUnit(from) == PlugUnit(to) || factor == 1 || (!triple && !scalar)) {
      in_.Fail(where, graph_->Connect(from, to, replace));
      return;
    }
    // As Maya does: a node that converts, one a component
    if (replace && graph_->FindConnection(to) != nullptr) in_.Fail(where, graph_->Disconnect(to));
    for (int i = triple ? 0 : -1; i < (triple ? 3 : 0); ++i) {
      PlugRef from_part = from, to_part = to;
      if (triple) from_part.component = to_part.component = i;
      GraphEditor edit(graph_);
      const NodeId conversion =
          edit.AddFresh("unitConversion", fmt::format("unitConversion{}", ++conversions_));
      if (edit.ok()) edit.Set(conversion, "conversionFactor", factor);
      if (edit.ok()) {
        edit.Connect(from_part, edit.Plug(conversion, "input"));
        edit.Connect(edit.Plug(conversion, "output"), to_part);
      }
      in_.Fail(where, edit.Take());
    }
  }

  const BuildInput& in_;
  const OverriddenPlugs& overridden_;
  Graph* graph_;
  int conversions_ = 0;  // names of them
};

}  // namespace

void MakeConnections(const BuildInput& in, const std::vector<PendingConnection>& pending,
                     const OverriddenPlugs& overridden, Graph* graph) {
  Connections(in, overridden, graph).Run(pending);
}

}  // namespace kpsa::engine
