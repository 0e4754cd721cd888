#include "kpsa/edit.h"

#include <algorithm>

#include "host/face_impl.h"
#include "host/problems.h"

namespace kpsa {

struct GraphEdit::Impl {
  engine::Rig rig;
  std::mutex* registry;  // which only a new node looks at
};

namespace {

kpsa::Result<Done> Said(const engine::Status& status) {
  if (!status.ok()) return engine::ProblemsOf(status);
  return Done();
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
  const std::lock_guard<std::mutex> lock(*impl_->registry);
  return Said(impl_->rig.graph->AddNode(type, name).status());
}

kpsa::Result<Done> GraphEdit::Set(std::string_view plug, double value) {
  return Said(SetPlug(&impl_->rig, plug, engine::Value(value)));
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
    return Said(engine::Status::Usage("{}: expected 3, 4 or 16 numbers, got {}", plug, v.size()));
  }
  return Said(SetPlug(&impl_->rig, plug, std::move(value)));
}

kpsa::Result<Done> GraphEdit::Set(std::string_view plug, std::string_view text) {
  return Said(SetPlug(&impl_->rig, plug, engine::Value(std::string(text))));
}

kpsa::Result<Done> GraphEdit::Connect(std::string_view source, std::string_view destination) {
  engine::Graph& graph = *impl_->rig.graph;
  const engine::Result<engine::PlugRef> from = graph.FindPlug(source), to = graph.FindPlug(destination);
  if (!from.ok()) return Said(from.status());
  if (!to.ok()) return Said(to.status());
  return Said(graph.Connect(*from, *to, true));
}

kpsa::Result<Done> GraphEdit::Disconnect(std::string_view destination) {
  const engine::Result<engine::PlugRef> to = impl_->rig.graph->FindPlug(destination);
  return Said(to.ok() ? impl_->rig.graph->Disconnect(*to) : to.status());
}

kpsa::Result<Done> GraphEdit::Deform(std::string_view mesh, std::string_view node) {
  engine::Rig& rig = impl_->rig;
  const auto found = std::ranges::find(rig.scene.meshes, mesh, &engine::CharacterMesh::name);
  if (found == rig.scene.meshes.end()) {
    std::vector<std::string> names;
    for (const engine::CharacterMesh& other : rig.scene.meshes) names.push_back(other.name);
    return Said(engine::Status::Usage("no mesh is called \"{}\"{}", mesh, engine::DidYouMean(mesh, names)));
  }
  const engine::Result<engine::NodeId> id = rig.graph->FindNode(node);
  if (!id.ok()) return Said(id.status());
  const engine::NodeDef& def = rig.graph->def(*id);
  const int in = def.FindAttribute("inPoints"), out = def.FindAttribute("outPoints");
  if (in < 0 || out < 0)
    return Said(
        engine::Status::Usage("{} ({}) is no deformer: it has no inPoints and outPoints", node, def.name));
  // After those meshes that it deforms already
  const int geometry = rig.graph->ArraySize(*id, in);
  std::vector<engine::Stage> stages = found->stages;
  stages.push_back({std::string(node), *id, geometry, found->world, {}});
  engine::CharacterMesh changed = *found;
  engine::Graph graph = *rig.graph;
  const engine::Status status = engine::ConnectStages(std::move(stages), &changed, &graph);
  if (status.ok()) *found = std::move(changed), *rig.graph = std::move(graph);
  return Said(status);
}

kpsa::Result<kpsa::Rig> Rig::Edited(const std::function<Result<Done>(GraphEdit&)>& edit) const {
  if (is_accelerated())
    return Said(engine::Status::Usage("this rig is accelerated: expected the one that it was made of"))
        .problems();
  GraphEdit::Impl edited{impl_->rest, &impl_->library->mutex};
  GraphEdit face(&edited);
  if (const kpsa::Result<Done> done = edit(face); !done) return done.problems();
  edited.rig.graph->AdoptPoses();
  auto impl = Impl::Make(impl_->library, std::move(edited.rig));
  // Whether it compiles is known now, and not when the first scene asks
  const auto playing = impl->PlayingOf(std::nullopt);
  if (!playing.ok()) return Said(playing.status()).problems();
  const auto plan = (*playing)->PlanFor((*playing)->request());
  if (!plan.ok()) return Said(plan.status()).problems();
  return kpsa::Rig(std::move(impl));
}

}  // namespace kpsa
