#include "kpsa/edit.h"

#include <algorithm>

#include "host/face_impl.h"
#include "host/problems.h"
#include "rig/graph_editor.h"

namespace kpsa {

struct GraphEdit::Impl {
  engine::Rig rig;
  int conversions = 0;
};

namespace {

// Errors with the node that they are about, where it is known, and its place in the rig's file.
kpsa::Result<Done> Said(const engine::Rig& rig, engine::Status status, std::string_view node = "") {
  if (status.ok()) return Done();
  engine::Status located;
  status = std::move(status).OfNode(node);
  for (const engine::Error& error : status.errors())
    located.Append(engine::Status(error).At(engine::PlaceOf(rig, error)));
  return engine::ProblemsOf(located);
}

std::string_view NodeOf(const engine::Rig& rig, std::string_view plug) {
  const engine::Result<engine::PlugRef> found = rig.graph->FindPlug(plug);
  return found.ok() ? std::string_view(rig.graph->name(found->node)) : std::string_view();
}

// Numbers of points and matrices as wholes are never converted.
engine::Unit UnitOf(const engine::Graph& graph, const engine::PlugRef& plug) {
  const engine::Type type = graph.PlugType(plug);
  if (type != engine::Type::kDouble && type != engine::Type::kDouble3) return engine::Unit::kNone;
  return graph.def(plug.node).attributes[static_cast<std::size_t>(plug.attribute)].unit;
}

bool AreTriples(const engine::Graph& graph, const engine::PlugRef& from, const engine::PlugRef& to) {
  return graph.PlugType(from) == engine::Type::kDouble3 && graph.PlugType(to) == engine::Type::kDouble3;
}

// What numbers are multiplied with where they go from one plug to the other: plain ones count in the units of the
// file, as `connections:` of a rig has it. 1: they go over as they are.
double ConversionFactor(const engine::Rig& rig, const engine::PlugRef& from, const engine::PlugRef& to) {
  const engine::Graph& graph = *rig.graph;
  const engine::Unit from_unit = UnitOf(graph, from), to_unit = UnitOf(graph, to);
  const engine::Type from_type = graph.PlugType(from);
  const bool number = graph.PlugType(to) == engine::Type::kDouble && from_type <= engine::Type::kDouble;
  if (from_unit == to_unit || (!AreTriples(graph, from, to) && !number)) return 1;
  return rig.units.FactorOf(to_unit) / rig.units.FactorOf(from_unit);
}

// With a node in between that multiplies, one a component.
engine::Status ConnectConverted(const engine::PlugRef& from, const engine::PlugRef& to, double factor,
                                int* conversions, engine::Graph* graph) {
  const bool triple = AreTriples(*graph, from, to);
  // What drives all of it, or a part, gives way
  std::vector<engine::PlugRef> driven;
  for (const engine::Connection& driver : graph->Inputs(to.node, to.attribute)) {
    const engine::PlugRef& plug = driver.destination;
    if (plug.element == to.element && (plug.component == to.component || (triple && to.component < 0)))
      driven.push_back(plug);
  }
  for (const engine::PlugRef& plug : driven) KPSA_RETURN_IF_ERROR(graph->Disconnect(plug));
  engine::GraphEditor edit(graph);
  for (int i = triple ? 0 : -1; i < (triple ? 3 : 0); ++i) {
    engine::PlugRef from_part = from, to_part = to;
    if (triple) from_part.component = to_part.component = i;
    const engine::NodeId conversion =
        edit.AddFresh("unitConversion", fmt::format("unitConversion{}", ++*conversions));
    if (edit.ok()) edit.Set(conversion, "conversionFactor", factor);
    if (edit.ok()) {
      edit.Connect(from_part, edit.Plug(conversion, "input"));
      edit.Connect(edit.Plug(conversion, "output"), to_part);
    }
  }
  return edit.Take();
}

// What remembers its previous frame follows the scene's time, unless the edit gives it another one.
engine::Status ConnectTime(engine::Rig* rig) {
  engine::GraphEditor edit(rig->graph.get());
  for (const engine::NodeId node : rig->graph->Nodes()) {
    if (!rig->graph->def(node).stateful || !edit.Has(node, "time")) continue;
    const engine::PlugRef time = edit.Plug(node, "time");
    if (rig->graph->FindValue(time) == nullptr && rig->graph->FindConnection(time) == nullptr)
      edit.Connect(rig->scene.time, time);
  }
  return edit.Take();
}

// What controls rest at, of a graph that was edited.
void RestControls(engine::Rig* rig) {
  for (engine::Control& control : rig->controls) {
    const engine::PlugRef& plug = control.plug;
    engine::PlugRef whole = plug;
    whole.component = -1;
    if (const engine::Value* own = rig->graph->FindValue(plug)) {
      control.value = own->AsDouble();
    } else if (const engine::Value* set = rig->graph->FindValue(whole)) {
      double one = 0;
      const std::span<const double> numbers = engine::NumbersOf(*set, &one);
      control.value = numbers[plug.component < 0 ? 0 : static_cast<std::size_t>(plug.component)];
    }
  }
}

engine::Status SetPlug(engine::Rig* rig, std::string_view name, engine::Value value) {
  const engine::Result<engine::PlugRef> plug = rig->graph->FindPlug(name);
  if (!plug.ok()) return plug.status();
  const engine::AttributeDef& attribute =
      rig->graph->def(plug->node).attributes[static_cast<std::size_t>(plug->attribute)];
  const double si = rig->units.FactorOf(attribute.unit);
  const engine::Type type = rig->graph->PlugType(*plug);
  const bool whole = type == engine::Type::kBool || type == engine::Type::kInt || type == engine::Type::kEnum;
  if (const auto* number = value.get_if<double>()) {
    if (whole &&
        *number == static_cast<double>(static_cast<std::int64_t>(std::clamp(*number, -1e15, 1e15)))) {
      value = engine::Value(static_cast<std::int64_t>(*number));
    } else {
      value = engine::Value(*number * si);
    }
  } else if (const auto* vector = value.get_if<engine::Double3>()) {
    value = engine::Value(engine::Double3{vector->x * si, vector->y * si, vector->z * si});
  }
  return rig->graph->Set(*plug, std::move(value));
}

}  // namespace

kpsa::Result<Done> GraphEdit::AddNode(std::string_view type, std::string_view name) {
  return Said(impl_->rig, impl_->rig.graph->AddNode(type, name).status(), name);
}

kpsa::Result<Done> GraphEdit::Set(std::string_view plug, double value) {
  return Said(impl_->rig, SetPlug(&impl_->rig, plug, engine::Value(value)), NodeOf(impl_->rig, plug));
}

kpsa::Result<Done> GraphEdit::Set(std::string_view plug, std::span<const double> v) {
  engine::Value value;
  if (v.size() == 3) {
    value = engine::Value(engine::Double3{v[0], v[1], v[2]});
  } else if (v.size() == 4) {
    value = engine::Value(engine::Quaternion{v[0], v[1], v[2], v[3]});
  } else if (v.size() == 16) {
    engine::Matrix4 matrix;
    std::ranges::copy(v, matrix.m.begin());
    value = engine::Value(matrix);
  } else {
    return Said(impl_->rig, engine::Status::Usage("{}: expected 3, 4 or 16 numbers, got {}", plug, v.size()),
                NodeOf(impl_->rig, plug));
  }
  return Said(impl_->rig, SetPlug(&impl_->rig, plug, std::move(value)), NodeOf(impl_->rig, plug));
}

kpsa::Result<Done> GraphEdit::Set(std::string_view plug, std::string_view text) {
  return Said(impl_->rig, SetPlug(&impl_->rig, plug, engine::Value(std::string(text))),
              NodeOf(impl_->rig, plug));
}

kpsa::Result<Done> GraphEdit::Connect(std::string_view source, std::string_view destination) {
  engine::Graph& graph = *impl_->rig.graph;
  const engine::Result<engine::PlugRef> from = graph.FindPlug(source), to = graph.FindPlug(destination);
  if (!from.ok()) return Said(impl_->rig, from.status());
  if (!to.ok()) return Said(impl_->rig, to.status());
  const double factor = ConversionFactor(impl_->rig, *from, *to);
  engine::Status status;
  if (factor == 1) {
    status = graph.Connect(*from, *to, true);
  } else {
    engine::Graph changed = graph;  // a refused connection changes nothing
    status = ConnectConverted(*from, *to, factor, &impl_->conversions, &changed);
    if (status.ok()) graph = std::move(changed);
  }
  return Said(impl_->rig, status, graph.name(to->node));
}

kpsa::Result<Done> GraphEdit::Disconnect(std::string_view destination) {
  const engine::Result<engine::PlugRef> to = impl_->rig.graph->FindPlug(destination);
  return Said(impl_->rig, to.ok() ? impl_->rig.graph->Disconnect(*to) : to.status(),
              NodeOf(impl_->rig, destination));
}

kpsa::Result<Done> GraphEdit::Deform(std::string_view mesh, std::string_view node) {
  engine::Rig& rig = impl_->rig;
  const auto found = std::ranges::find(rig.scene.meshes, mesh, &engine::CharacterMesh::name);
  if (found == rig.scene.meshes.end()) {
    std::vector<std::string> names;
    for (const engine::CharacterMesh& other : rig.scene.meshes) names.push_back(other.name);
    return Said(rig,
                engine::Status::Usage("no mesh is called \"{}\"{}", mesh, engine::DidYouMean(mesh, names)));
  }
  const engine::Result<engine::NodeId> id = rig.graph->FindNode(node);
  if (!id.ok()) return Said(rig, id.status());
  const engine::NodeDef& def = rig.graph->def(*id);
  const int in = def.FindAttribute("inPoints"), out = def.FindAttribute("outPoints");
  if (in < 0 || out < 0)
    return Said(
        rig,
        engine::Status::Usage("{} ({}) is no deformer: it has no inPoints and outPoints", node, def.name),
        node);
  // After those meshes that it deforms already
  const int geometry = rig.graph->ArraySize(*id, in);
  std::vector<engine::Stage> stages = found->stages;
  stages.push_back({std::string(node), *id, geometry, found->world, {}});
  engine::CharacterMesh changed = *found;
  engine::Graph graph = *rig.graph;
  const engine::Status status = engine::ConnectStages(std::move(stages), &changed, &graph);
  if (status.ok()) *found = std::move(changed), *rig.graph = std::move(graph);
  return Said(rig, status, node);
}

kpsa::Result<kpsa::Rig> Rig::Edited(const std::function<Result<Done>(GraphEdit&)>& edit) const {
  if (is_accelerated())
    return engine::ProblemsOf(
        engine::Status::Usage("this rig is accelerated: expected the one that it was made of").At({path()}));
  GraphEdit::Impl edited{impl_->rest};
  GraphEdit face(&edited);
  if (const kpsa::Result<Done> done = edit(face); !done) return done.problems();
  if (const engine::Status status = ConnectTime(&edited.rig); !status.ok()) return engine::ProblemsOf(status);
  edited.rig.graph->AdoptPoses();
  RestControls(&edited.rig);
  auto impl = Impl::Make(impl_->library, std::move(edited.rig));
  // Whether it compiles is known now, and not when the first scene asks
  const auto playing = impl->PlayingOf(std::nullopt);
  if (!playing.ok()) return engine::ProblemsOf(playing.status());
  const auto plan = (*playing)->PlanFor((*playing)->request());
  if (!plan.ok()) return engine::ProblemsOf(plan.status());
  return kpsa::Rig(std::move(impl));
}

}  // namespace kpsa
