#include "kpsa/scene.h"

#include <cmath>
#include <utility>

#include "host/mesh_stage.h"
#include "host/problems.h"
#include "host/scene_impl.h"
#include "host/vertex_points.h"

namespace kpsa {

Scene::Scene(const kpsa::Rig& rig) : impl_(std::make_unique<Impl>(rig)) {}
Scene::~Scene() = default;
Scene::Scene(Scene&&) noexcept = default;
Scene& Scene::operator=(Scene&&) noexcept = default;
const kpsa::Rig& Scene::rig() const { return impl_->rig; }

kpsa::Result<Done> Scene::Play(const std::optional<std::string>& clip) {
  const std::optional<std::string> before = std::exchange(impl_->clip, clip);
  impl_->Forget();
  const engine::Status status = impl_->EnsurePlaying();
  if (status.ok()) return Done();
  impl_->clip = before;
  impl_->Forget();
  return engine::ProblemsOf(status);
}

void Scene::SetTime(double seconds) { impl_->time = std::isfinite(seconds) ? seconds : 0; }

void Scene::WatchRunUp(std::function<bool()> go_on) { impl_->on_the_way = std::move(go_on); }

kpsa::Result<Done> Scene::Set(std::string_view plug, double value) {
  const engine::Status status = impl_->Set(plug, value);
  if (!status.ok()) return engine::ProblemsOf(status);
  return Done();
}

void Scene::Reset() {
  impl_->held.clear();
  if (impl_->playing != nullptr && impl_->request.varying != impl_->playing->request().varying)
    impl_->request.varying = impl_->playing->request().varying, impl_->plan = nullptr;
  if (!impl_->settings.empty()) impl_->settings.clear(), impl_->Forget();
  if (impl_->plan != nullptr) impl_->Restart();
}

kpsa::Result<std::span<const float>> Scene::Points(std::string_view mesh) {
  impl_->decided.clear();
  if (const engine::Status status = impl_->EnsurePlaying(); !status.ok()) return engine::ProblemsOf(status);
  const engine::Playing& playing = *impl_->playing;
  const engine::Result<engine::MeshStage> found = engine::FindMeshStage(playing.rig(), mesh);
  if (!found.ok()) return engine::ProblemsOf(playing.Located(found.status()));
  const engine::Result<engine::Index> output = impl_->OutputOf(found->points);
  if (!output.ok()) return engine::ProblemsOf(output.status());
  if (const engine::Status status = impl_->Pull(*output); !status.ok()) return engine::ProblemsOf(status);
  const engine::ConstPointsView points = impl_->evaluator->Points(*output);
  if (const engine::Status status = CheckCount(playing, *found->mesh, found->points, points.count);
      !status.ok())
    return engine::ProblemsOf(status);
  std::vector<float>& xyz = impl_->points[*output];
  xyz.resize(std::size_t{3} * found->mesh->vertex_count);
  engine::Interleave(found->mesh->mesh(), points, 0, found->mesh->vertex_count, xyz.data());
  return std::span<const float>(xyz);
}

kpsa::Result<std::vector<double>> Scene::Values(std::string_view plug) {
  impl_->decided.clear();
  if (const engine::Status status = impl_->EnsurePlaying(); !status.ok()) return engine::ProblemsOf(status);
  const engine::Rig& rig = impl_->playing->rig();
  const engine::Graph& graph = *rig.graph;
  const engine::Result<engine::PlugRef> found = graph.FindPlug(plug);
  if (!found.ok()) return engine::ProblemsOf(impl_->playing->Located(found.status()));
  const engine::Type type = graph.PlugType(*found);
  if (!engine::IsSmallType(type))
    return engine::ProblemsOf(impl_->playing->Located(
        engine::Status::Usage("{} is {}: expected a number, a vector, a quaternion or a matrix",
                              graph.PlugName(*found), engine::TypeName(type))
            .OfNode(graph.name(found->node))));
  engine::PlugRef whole = *found;
  whole.component = -1;
  const engine::Result<engine::Index> output = impl_->OutputOf(whole);
  if (!output.ok()) return engine::ProblemsOf(output.status());
  if (const engine::Status status = impl_->Pull(*output); !status.ok()) return engine::ProblemsOf(status);
  const engine::Value value =
      engine::Value::ReadSlot(graph.PlugType(whole), &impl_->evaluator->Get<std::byte>(*output));
  double one = 0;
  const std::span<const double> numbers = engine::NumbersOf(value, &one);
  std::vector<double> values(numbers.begin(), numbers.end());
  if (found->component >= 0) values = {values[static_cast<std::size_t>(found->component)]};
  const engine::AttributeDef& attribute =
      graph.def(found->node).attributes[static_cast<std::size_t>(found->attribute)];
  for (double& number : values) number /= rig.units.FactorOf(attribute.unit);
  return values;
}

const kpsa::Verdict& Scene::verdict() {
  std::optional<engine::FrameDecision> worst;
  for (engine::Index n = 0; n < impl_->decided.size(); ++n) {
    if (!impl_->decided[n].has_value()) continue;
    engine::FrameDecision decision = engine::DecisionOf(impl_->decided_by->applied()[n], *impl_->decided[n]);
    if (!worst.has_value() || engine::IsWorse(decision, *worst)) worst = std::move(decision);
  }
  impl_->verdict = {};
  if (worst.has_value())
    impl_->verdict = {worst->hit(), worst->full_weight, worst->score, std::move(worst->reason)};
  return impl_->verdict;
}

}  // namespace kpsa
