#include "host/scene_impl.h"

#include <algorithm>

#include "host/settable_plug.h"

namespace kpsa {
namespace {

// Whether a varying plug is the other one, or all of it.
bool Covers(const engine::PlugRef& varying, const engine::PlugRef& plug) {
  return varying.node == plug.node && varying.attribute == plug.attribute &&
         varying.element == plug.element && (varying.component == plug.component || varying.component < 0);
}

// The value in the runtime's units, of a plug that a scene may set.
engine::Result<engine::Value> ValueFor(const engine::Rig& rig, const engine::PlugRef& plug, double number) {
  const engine::Graph& graph = *rig.graph;
  KPSA_RETURN_IF_ERROR(engine::CheckSettable(graph, plug));
  const engine::AttributeDef& attribute =
      graph.def(plug.node).attributes[static_cast<std::size_t>(plug.attribute)];
  return engine::ValueOf(graph, plug, number * rig.units.FactorOf(attribute.unit));
}

}  // namespace

void Scene::Impl::ApplyHeld(const std::vector<Held>& held, engine::Evaluator* to) {
  for (const Held& one : held) {
    // Checked when it was set; a plug that nothing depends on does not vary
    if (const engine::PlugHandle handle = to->plan().Handle(one.plug)) (void)to->Set(handle, one.value);
  }
}

void Scene::Impl::Forget() {
  playing = nullptr;
  plan = nullptr;
  evaluator = nullptr;
}

engine::Status Scene::Impl::EnsurePlaying() {
  if (playing != nullptr) return engine::Status();
  engine::Result<std::shared_ptr<engine::Playing>> made = shared().PlayingOf(clip);
  if (!made.ok()) return engine::Status(made.status()).At({rig.path()});
  // What the clip drives is no longer held
  const std::shared_ptr<engine::Playing> plain = *made;
  const auto is_driven = [&](const auto& one) {
    return engine::DriverOf(*plain->rig().graph, one.plug) != nullptr;
  };
  std::vector<engine::Setting> kept = settings;
  std::erase_if(kept, is_driven);
  if (!kept.empty()) made = engine::Playing::Make(shared().rest, clip, kept, shared().acceleration);
  if (!made.ok()) return engine::Status(made.status()).At({rig.path()});
  std::erase_if(held, is_driven);
  settings = std::move(kept);
  playing = std::move(*made);
  request = playing->request();
  for (const Held& one : held) Vary(one.plug);
  plan = nullptr;
  return engine::Status();
}

void Scene::Impl::Vary(const engine::PlugRef& plug) {
  const auto covers = [&](const engine::PlugRef& varying) { return Covers(varying, plug); };
  if (std::ranges::none_of(request.varying, covers)) request.varying.push_back(plug), plan = nullptr;
}

engine::Status Scene::Impl::Ensure() {
  KPSA_RETURN_IF_ERROR(EnsurePlaying());
  if (plan != nullptr) return engine::Status();
  engine::Result<std::shared_ptr<const engine::Plan>> made = playing->PlanFor(request);
  if (!made.ok()) return made.status();
  plan = std::move(*made);
  Restart();
  return engine::Status();
}

void Scene::Impl::Restart() {
  evaluator = std::make_unique<engine::Evaluator>(plan);
  run_up.emplace(*plan, playing->rig(), nullptr, [this] { return !on_the_way || on_the_way(); });
  points.assign(plan->outputs().size(), {});
  ApplyHeld(held, evaluator.get());
}

engine::Result<engine::Index> Scene::Impl::OutputOf(const engine::PlugRef& plug) {
  auto at = std::ranges::find(request.outputs, plug, &engine::RequestedOutput::plug);
  if (at == request.outputs.end()) {
    request.outputs.push_back({plug, {}});
    plan = nullptr;
    at = request.outputs.end() - 1;
  }
  const auto index = static_cast<engine::Index>(at - request.outputs.begin());
  if (const engine::Status status = Ensure(); !status.ok()) {
    if (plan == nullptr) request.outputs.resize(playing == nullptr ? 0 : playing->request().outputs.size());
    return status;
  }
  return index;
}

engine::Status Scene::Impl::Pull(engine::Index output) {
  decided.assign(playing->applied().size(), std::nullopt);
  decided_by = playing;
  if (const engine::Status status = run_up->To(time, evaluator.get(), output); !status.ok())
    return playing->Located(status);
  // What needs its previous frame sees every frame, whichever output is asked for; failures are those of outputs
  if (run_up->stateful()) (void)evaluator->Evaluate();
  if (const engine::Status status = evaluator->Pull(output); !status.ok()) return playing->Located(status);
  for (engine::Index n = 0; n < decided.size(); ++n) {
    const engine::Index first = playing->first_decision() + engine::kDecisionOutputs * n;
    if (evaluator->IsFresh(first)) decided[n] = engine::ReadDecision(*evaluator, first);
  }
  return engine::Status();
}

engine::Status Scene::Impl::Set(std::string_view name, double number) {
  // Where what was set before is refused by the subspaces, names are still known, and it may be set right
  std::shared_ptr<engine::Playing> of = playing;
  if (const engine::Status status = EnsurePlaying(); status.ok()) {
    of = playing;
  } else {
    const auto plain = shared().PlayingOf(clip);
    if (!plain.ok()) return status;
    of = *plain;
  }
  const engine::Graph& graph = *of->rig().graph;
  const engine::Result<engine::PlugRef> plug = graph.FindPlug(name);
  if (!plug.ok()) return of->Located(plug.status());
  const engine::Result<engine::Value> value = ValueFor(of->rig(), *plug, number);
  if (!value.ok()) return of->Located(engine::Status(value.status()).OfNode(graph.name(plug->node)));
  if (*plug == of->rig().scene.time) {
    time = value->AsDouble();
    return engine::Status();
  }
  const engine::AttributeDef& attribute =
      graph.def(plug->node).attributes[static_cast<std::size_t>(plug->attribute)];
  const bool control = std::ranges::any_of(
      of->request().varying, [&](const engine::PlugRef& varying) { return Covers(varying, *plug); });
  // Points vary as a whole only: a part of them is set in the graph, as settings are
  if (!control && (shared().acceleration.has_value() || engine::IsPointType(attribute.type))) {
    // Subspaces watch what may vary; whatever else is set has to be there when they come in
    std::erase_if(settings, [&](const engine::Setting& other) { return other.plug == *plug; });
    settings.push_back({*plug, *value, graph.PlugName(*plug)});
    Forget();
    return engine::Status();
  }
  const auto at = std::ranges::find(held, *plug, &Held::plug);
  if (at != held.end()) {
    at->value = *value;
  } else {
    held.push_back({*plug, *value});
    if (playing != nullptr) Vary(*plug);
  }
  if (plan == nullptr) return engine::Status();
  const engine::PlugHandle handle = plan->Handle(*plug);
  return handle ? evaluator->Set(handle, *value) : engine::Status();
}

engine::Result<Scene::Impl::Snapshot> Scene::Impl::Take() {
  KPSA_RETURN_IF_ERROR(EnsurePlaying());
  // The meshes and verdicts alone, whatever was asked for besides
  engine::Result<std::shared_ptr<const engine::Plan>> made =
      playing->PlanFor({playing->request().outputs, request.varying});
  if (!made.ok()) return made.status();
  return Snapshot{playing, std::move(*made), held};
}

engine::Status CheckCount(const engine::Playing& playing, const engine::CharacterMesh& mesh,
                          const engine::PlugRef& points, std::size_t count) {
  if (count == mesh.mesh().point_count()) return engine::Status();
  return playing.Located(engine::Status::Invalid("\"{}\" has {} points, its stack gives {}", mesh.name,
                                                 mesh.mesh().point_count(), count)
                             .OfNode(playing.rig().graph->name(points.node)));
}

}  // namespace kpsa
