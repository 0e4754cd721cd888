#include "kpsa/scene.h"

#include <algorithm>
#include <cmath>
#include <exception>

#include "graph/frames.h"
#include "graph/profile.h"
#include "host/decisions.h"
#include "host/face_impl.h"
#include "host/mesh_stage.h"
#include "host/problems.h"
#include "host/vertex_points.h"

namespace kpsa {
namespace {

kpsa::Verdict VerdictOf(const engine::Playing& playing, const engine::Evaluator& evaluator) {
  engine::FrameDecision worst;
  for (engine::Index n = 0; n < playing.applied().size(); ++n) {
    engine::FrameDecision decision = engine::DecisionOf(
        playing.applied()[n], evaluator, playing.first_decision() + engine::kDecisionOutputs * n);
    if (n == 0 || engine::IsWorse(decision, worst)) worst = std::move(decision);
  }
  return {worst.hit(), worst.full_weight, worst.score, std::move(worst.reason)};
}

// An edited graph may give a mesh other points than it has vertices for.
engine::Status CheckCount(const engine::CharacterMesh& mesh, std::size_t count) {
  if (count == mesh.mesh().point_count()) return engine::Status();
  return engine::Status::Invalid("\"{}\" has {} points, its stack gives {}", mesh.name,
                                 mesh.mesh().point_count(), count);
}

struct Held {  // what somebody set
  engine::PlugRef plug;
  engine::Value value;
};

}  // namespace

struct Scene::Impl {
  kpsa::Rig rig;
  std::optional<std::string> clip;
  std::shared_ptr<engine::Playing> playing;  // null until something asks; a failure is told to whoever asks
  engine::Request request;                   // of playing, and what was asked for besides
  std::shared_ptr<const engine::Plan> plan;
  std::unique_ptr<engine::Evaluator> evaluator;
  double time = 0;
  std::vector<Held> held;
  std::vector<engine::Setting> poses;      // plugs that are set in the graph, of an accelerated rig
  std::vector<std::vector<float>> points;  // by output
  kpsa::Verdict verdict;

  explicit Impl(const kpsa::Rig& of) : rig(of) {}
  const Rig::Impl& shared() const { return *rig.impl_; }

  void Forget() {
    playing = nullptr;
    plan = nullptr;
    evaluator = nullptr;
  }

  engine::Status EnsurePlaying() {
    if (playing != nullptr) return engine::Status();
    engine::Result<std::shared_ptr<engine::Playing>> made = [&] {
      if (poses.empty()) return shared().PlayingOf(clip);
      const std::lock_guard<std::mutex> building(shared().library->mutex);
      return engine::Playing::Make(shared().rest, clip, poses, shared().acceleration);
    }();
    if (!made.ok()) return made.status();
    playing = std::move(*made);
    request = playing->request();
    // What the clip drives is no longer held
    std::erase_if(held, [&](const Held& one) { return DriverOf(one.plug) != nullptr; });
    for (const Held& one : held) Vary(one.plug);
    plan = nullptr;
    return engine::Status();
  }

  void Vary(const engine::PlugRef& plug) {
    const auto same = [&](const engine::PlugRef& other) {
      return other.node == plug.node && other.attribute == plug.attribute && other.element == plug.element &&
             (other.component == plug.component || other.component < 0);
    };
    if (std::ranges::none_of(request.varying, same)) request.varying.push_back(plug), plan = nullptr;
  }

  engine::Status Ensure() {
    KPSA_RETURN_IF_ERROR(EnsurePlaying());
    if (plan != nullptr) return engine::Status();
    engine::Result<std::shared_ptr<const engine::Plan>> made = playing->PlanFor(request);
    if (!made.ok()) return made.status();
    plan = std::move(*made);
    Restart();
    return engine::Status();
  }

  void Restart() {
    evaluator = std::make_unique<engine::Evaluator>(plan);
    points.assign(plan->outputs().size(), {});
    Apply(*evaluator);
  }

  // Everything that is set; equal values cost nothing.
  void Apply(engine::Evaluator& to) const {
    SetTime(to, time);
    for (const Held& one : held) {
      // Checked when it was set; a plug that nothing depends on does not vary
      if (const engine::PlugHandle handle = plan->Handle(one.plug)) (void)to.Set(handle, one.value);
    }
  }
  void SetTime(engine::Evaluator& to, double seconds) const {
    const engine::Index varying = plan->FindVarying(playing->rig().scene.time);
    if (varying != engine::kNoIndex) to.Set(varying, seconds);
  }

  // The number of an output; a new one changes the plan.
  engine::Result<engine::Index> OutputOf(const engine::PlugRef& plug) {
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

  // What drives a plug, a part of it, or what it is a part of; null if nothing does.
  const engine::Connection* DriverOf(const engine::PlugRef& plug) const {
    const auto overlap = [](int a, int b) { return a == b || a < 0 || b < 0; };
    for (const engine::Connection& driver : playing->rig().graph->Inputs(plug.node, plug.attribute)) {
      if (overlap(driver.destination.element, plug.element) &&
          overlap(driver.destination.component, plug.component))
        return &driver;
    }
    return nullptr;
  }

  engine::Status Set(std::string_view name, double number) {
    KPSA_RETURN_IF_ERROR(EnsurePlaying());
    const engine::Graph& graph = *playing->rig().graph;
    const engine::Result<engine::PlugRef> plug = graph.FindPlug(name);
    if (!plug.ok()) return plug.status();
    const engine::AttributeDef& attribute =
        graph.def(plug->node).attributes[static_cast<std::size_t>(plug->attribute)];
    const engine::Type type = graph.PlugType(*plug);
    const std::string& full = graph.PlugName(*plug);
    if (attribute.output) return engine::Status::Usage("{} is an output and cannot be set", full);
    if (attribute.structural)
      return engine::Status::Usage("{} is structural: it is read when a rig is loaded, and no scene sets it",
                                   full);
    if (type > engine::Type::kDouble)
      return engine::Status::Usage("{} is a {}: expected one number of it, as in {}.x", full,
                                   engine::TypeName(type), full);
    if (const engine::Connection* driver = DriverOf(*plug))
      return engine::Status::Usage("{} is driven by {} and cannot be set", full,
                                   graph.PlugName(driver->source));
    engine::Value value(number * playing->rig().units.FactorOf(attribute.unit));
    const bool whole = type != engine::Type::kDouble;
    if (whole && number == std::floor(number) && std::abs(number) <= 0x1p53)
      value = engine::Value(static_cast<std::int64_t>(number));
    KPSA_RETURN_IF_ERROR(graph.CheckValue(*plug, &value));

    const std::vector<engine::PlugRef>& usual = playing->request().varying;
    const bool control = std::ranges::any_of(usual, [&](const engine::PlugRef& other) {
      return other.node == plug->node && other.attribute == plug->attribute &&
             other.element == plug->element && (other.component == plug->component || other.component < 0);
    });
    if (*plug == playing->rig().scene.time) {
      time = value.AsDouble();
      if (plan != nullptr) SetTime(*evaluator, time);
      return engine::Status();
    }
    // Points vary as a whole only: a part of them is set in the graph, as poses are
    if (!control && (shared().acceleration.has_value() || engine::IsPointType(attribute.type))) {
      // Subspaces watch what may vary; whatever else is set has to be there when they come in
      std::erase_if(poses, [&](const engine::Setting& other) { return other.plug == *plug; });
      poses.push_back({*plug, value, full});
      Forget();
      return engine::Status();
    }
    const auto at = std::ranges::find(held, *plug, &Held::plug);
    if (at != held.end()) {
      at->value = value;
    } else {
      held.push_back({*plug, value});
      Vary(*plug);
    }
    if (plan == nullptr) return engine::Status();
    const engine::PlugHandle handle = plan->Handle(*plug);
    return handle ? evaluator->Set(handle, value) : engine::Status();
  }
};

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

void Scene::SetTime(double seconds) {
  impl_->time = std::isfinite(seconds) ? seconds : 0;
  if (impl_->evaluator != nullptr && impl_->plan != nullptr) impl_->SetTime(*impl_->evaluator, impl_->time);
}

kpsa::Result<Done> Scene::Set(std::string_view plug, double value) {
  const engine::Status status = impl_->Set(plug, value);
  if (!status.ok()) return engine::ProblemsOf(status);
  return Done();
}

void Scene::Reset() {
  impl_->held.clear();
  if (impl_->playing != nullptr && impl_->request.varying != impl_->playing->request().varying)
    impl_->request.varying = impl_->playing->request().varying, impl_->plan = nullptr;
  if (!impl_->poses.empty()) impl_->poses.clear(), impl_->Forget();
  if (impl_->plan != nullptr) impl_->Restart();
}

kpsa::Result<std::span<const float>> Scene::Points(std::string_view mesh) {
  if (const engine::Status status = impl_->EnsurePlaying(); !status.ok()) return engine::ProblemsOf(status);
  const engine::Result<engine::MeshStage> found = engine::FindMeshStage(impl_->playing->rig(), mesh);
  if (!found.ok()) return engine::ProblemsOf(found.status());
  const engine::Result<engine::Index> output = impl_->OutputOf(found->points);
  if (!output.ok()) return engine::ProblemsOf(output.status());
  if (const engine::Status status = impl_->evaluator->Pull(*output); !status.ok())
    return engine::ProblemsOf(status);
  if (const engine::Status status = CheckCount(*found->mesh, impl_->evaluator->Points(*output).count);
      !status.ok())
    return engine::ProblemsOf(status);
  std::vector<float>& xyz = impl_->points[*output];
  xyz.resize(std::size_t{3} * found->mesh->vertex_count);
  engine::Interleave(found->mesh->mesh(), impl_->evaluator->Points(*output), 0, found->mesh->vertex_count,
                     xyz.data());
  return std::span<const float>(xyz);
}

kpsa::Result<std::vector<double>> Scene::Values(std::string_view plug) {
  if (const engine::Status status = impl_->EnsurePlaying(); !status.ok()) return engine::ProblemsOf(status);
  const engine::Graph& graph = *impl_->playing->rig().graph;
  const engine::Result<engine::PlugRef> found = graph.FindPlug(plug);
  if (!found.ok()) return engine::ProblemsOf(found.status());
  const engine::Type type = graph.PlugType(*found);
  if (!engine::IsSmallType(type))
    return engine::ProblemsOf(
        engine::Status::Usage("{} is {}: expected a number, a vector, a quaternion or a matrix",
                              graph.PlugName(*found), engine::TypeName(type)));
  const engine::AttributeDef& attribute =
      graph.def(found->node).attributes[static_cast<std::size_t>(found->attribute)];
  engine::PlugRef whole = *found;
  whole.component = -1;
  const engine::Result<engine::Index> output = impl_->OutputOf(whole);
  if (!output.ok()) return engine::ProblemsOf(output.status());
  if (const engine::Status status = impl_->evaluator->Pull(*output); !status.ok())
    return engine::ProblemsOf(status);
  const engine::Value value =
      engine::Value::ReadSlot(graph.PlugType(whole), &impl_->evaluator->Get<std::byte>(*output));
  double one = 0;
  const std::span<const double> numbers = engine::NumbersOf(value, &one);
  std::vector<double> values(numbers.begin(), numbers.end());
  if (found->component >= 0) values = {values[static_cast<std::size_t>(found->component)]};
  const double si = impl_->playing->rig().units.FactorOf(attribute.unit);
  for (double& number : values) number /= si;
  return values;
}

const kpsa::Verdict& Scene::verdict() {
  impl_->verdict = {};
  if (impl_->plan == nullptr || impl_->playing->applied().empty()) return impl_->verdict;
  for (engine::Index n = 0; n < impl_->playing->applied().size(); ++n) {
    // Of what Points() has evaluated, so that nothing new is
    if (!impl_->evaluator->Pull(impl_->playing->first_decision() + engine::kDecisionOutputs * n).ok())
      return impl_->verdict;
  }
  return impl_->verdict = VerdictOf(*impl_->playing, *impl_->evaluator);
}

kpsa::Result<std::vector<StepTime>> Scene::Profile(std::span<const double> seconds) {
  if (const engine::Status status = impl_->Ensure(); !status.ok()) return engine::ProblemsOf(status);
  const engine::Plan& plan = *impl_->plan;
  engine::Evaluator evaluator(impl_->plan);
  engine::Profile profile(plan);
  impl_->Apply(evaluator);
  evaluator.Record(&profile);
  for (const double time : seconds) {
    impl_->SetTime(evaluator, time);
    if (const engine::Status status = evaluator.Evaluate(); !status.ok()) return engine::ProblemsOf(status);
  }
  std::vector<StepTime> steps;
  for (engine::Index s = 0; s < plan.steps().size(); ++s) {
    const std::size_t ran = profile.counts()[s];
    steps.push_back({plan.step_name(s), plan.step_type(s), plan.step_label(s), ran, plan.infos()[s].points,
                     1e-6 * static_cast<double>(profile.self_ns()[s])});
  }
  std::ranges::stable_sort(steps, std::ranges::greater(), &StepTime::milliseconds);
  return steps;
}

kpsa::Result<Done> Scene::Frames(std::span<const double> seconds,
                                 const std::function<bool(const Frame&)>& take, const FrameOptions& options) {
  if (const engine::Status status = impl_->Ensure(); !status.ok()) return engine::ProblemsOf(status);
  const engine::Playing& playing = *impl_->playing;
  const std::vector<std::size_t> shown = engine::ShownMeshes(playing.rig().scene);
  std::vector<std::vector<float>> points(shown.size());
  std::vector<std::span<const float>> spans(shown.size());
  for (std::size_t m = 0; m < shown.size(); ++m)
    points[m].resize(std::size_t{3} * playing.rig().scene.meshes[shown[m]].vertex_count),
        spans[m] = points[m];
  engine::FrameOptions frame_options;
  frame_options.threads = options.threads;
  frame_options.cancel = options.cancel;
  bool ended = false;
  std::exception_ptr thrown;
  const engine::Status status = engine::EvaluateFrames(
      impl_->plan, seconds.size(), frame_options,
      [&](std::size_t frame, engine::Evaluator& evaluator) {
        impl_->Apply(evaluator);
        impl_->SetTime(evaluator, seconds[frame]);
      },
      [&](std::size_t frame, const engine::Evaluator& evaluator,
          const engine::Status& evaluated) -> engine::Status {
        if (!evaluated.ok()) {
          const engine::Error& error = evaluated.errors().front();
          return engine::Status::Evaluation("at {} s: {}", seconds[frame], error.message)
              .OfNode(error.node)
              .At(engine::PlaceOf(playing.rig(), error));
        }
        for (std::size_t m = 0; m < shown.size(); ++m) {
          const engine::CharacterMesh& mesh = playing.rig().scene.meshes[shown[m]];
          const engine::ConstPointsView view = evaluator.Points(static_cast<engine::Index>(m));
          KPSA_RETURN_IF_ERROR(CheckCount(mesh, view.count));
          engine::Interleave(mesh.mesh(), view, 0, mesh.vertex_count, points[m].data());
        }
        kpsa::Verdict verdict;
        if (!playing.applied().empty()) verdict = VerdictOf(playing, evaluator);
        try {
          ended = !take({frame, seconds[frame], spans, playing.applied().empty() ? nullptr : &verdict});
        } catch (...) {  // of the caller's own; not on a thread that nobody watches
          thrown = std::current_exception(), ended = true;
        }
        return ended ? engine::Status::Make(engine::ErrorKind::kInterrupted, "ended") : engine::Status();
      });
  if (thrown != nullptr) std::rethrow_exception(thrown);
  if (!status.ok() && !ended) return engine::ProblemsOf(status);
  return Done();
}

}  // namespace kpsa
