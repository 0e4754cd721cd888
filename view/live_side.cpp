#include "view/live_side.h"

#include <algorithm>
#include <chrono>

#include "host/scene_impl.h"
#include "host/settable_plug.h"
#include "host/vertex_points.h"

namespace kpsa::engine {
namespace {

// The value that the plan begins with.
Value InitialOf(const Plan& plan, const PlugHandle& handle) {
  const Plan::Varying& varying = plan.varying()[handle.varying];
  const Value whole = Value::ReadSlot(varying.type, plan.initial_values().data() + varying.slot);
  if (handle.component < 0) return whole;
  double number = 0;
  return NumbersOf(whole, &number)[static_cast<std::size_t>(handle.component)];
}

}  // namespace

LiveSide::LiveSide(const Rig& rest, std::optional<AccelerationChoice> acceleration)
    : rest_(rest), acceleration_(std::move(acceleration)) {}

LiveSide::LiveSide(const Rig& rest, std::vector<PlugRef> matrices)
    : rest_(rest), matrices_(std::move(matrices)) {}

Result<LiveSide::Kept*> LiveSide::Find(const std::optional<std::string>& clip,
                                       const std::vector<MovedPlug>& taken) {
  for (const auto& kept : kept_) {
    if (kept->clip != clip || kept->taken != taken) continue;
    kept->used = ++uses_;
    return kept.get();
  }
  Result<std::unique_ptr<Kept>> made = Make(clip, taken);
  if (!made.ok()) return made.status();
  if (kept_.size() == kMostKept)
    kept_.erase(std::ranges::min_element(kept_, {}, [](const auto& kept) { return kept->used; }));
  kept_.push_back(std::move(*made));
  kept_.back()->used = ++uses_;
  return kept_.back().get();
}

Result<std::unique_ptr<LiveSide::Kept>> LiveSide::Make(const std::optional<std::string>& clip,
                                                       const std::vector<MovedPlug>& taken) {
  auto kept = std::make_unique<Kept>();
  kept->clip = clip;
  kept->taken = taken;
  std::vector<Setting> settings;
  for (const MovedPlug& moved : taken) {
    const Result<Value> value = ValueOf(*rest_.graph, moved.plug, moved.number);
    if (!value.ok()) return value.status();
    settings.push_back({moved.plug, *value, rest_.graph->PlugName(moved.plug)});
  }
  Result<std::shared_ptr<Playing>> playing = Playing::Make(rest_, clip, settings, acceleration_);
  if (!playing.ok()) return Status(playing.status()).At({rest_.path});
  kept->playing = std::move(*playing);
  if (acceleration_.has_value()) {  // a subspace is read once
    for (const AppliedSubspace& one : kept->playing->applied()) {
      auto& loaded = acceleration_->loaded;
      if (std::ranges::none_of(loaded, [&](const auto& known) { return known.first == one.path; }))
        loaded.emplace_back(one.path, one.subspace);
    }
  }
  Request request = kept->playing->request();
  kept->wanted = static_cast<Index>(request.outputs.size());
  if (!matrices_.empty()) {
    request.outputs.clear();
    for (const PlugRef& matrix : matrices_) request.outputs.push_back({matrix, {}});
    kept->wanted = static_cast<Index>(matrices_.size());
  }
  AskForControls(&request, kept.get());
  Result<std::shared_ptr<const Plan>> plan = kept->playing->PlanFor(request);
  if (!plan.ok()) return plan.status();
  kept->plan = std::move(*plan);
  kept->evaluator = std::make_unique<Evaluator>(kept->plan);
  kept->run_up.emplace(*kept->plan, kept->playing->rig());
  AddPosedControls(kept.get());
  return kept;
}

// Outputs for the controls that something drives.
void LiveSide::AskForControls(Request* request, Kept* kept) const {
  const Graph& graph = *kept->playing->rig().graph;
  for (const Control& control : rest_.controls) {
    if (DriverOf(graph, control.plug) == nullptr) continue;
    PlugRef whole = control.plug;
    whole.component = -1;
    if (!IsSmallType(graph.PlugType(whole))) continue;
    auto at = std::ranges::find(request->outputs, whole, &RequestedOutput::plug);
    if (at == request->outputs.end()) at = request->outputs.insert(at, {whole, {}});
    kept->shown.push_back({&control, static_cast<Index>(at - request->outputs.begin())});
  }
}

void LiveSide::AddPosedControls(Kept* kept) const {
  for (const Control& control : rest_.controls) {
    const PlugHandle handle = kept->plan->Handle(control.plug);
    if (!handle || IsPointType(handle.type)) continue;
    const double number = InitialOf(*kept->plan, handle).AsDouble();
    if (number != control.value) kept->shown.push_back({&control, kNoIndex, number});
  }
}

Status LiveSide::Evaluate(const LivePose& pose) {
  now_ = nullptr;
  Result<Kept*> plain = Find(pose.clip, {});
  if (!plain.ok()) return plain.status();
  // What the clip drives is taken over from it; plugs that are no controls do not vary where subspaces watch
  std::vector<MovedPlug> taken;
  for (const MovedPlug& moved : pose.moved) {
    if (!moved.control)
      taken.push_back(moved);
    else if (DriverOf(*(*plain)->playing->rig().graph, moved.plug) != nullptr)
      taken.push_back({moved.plug, 0, true});
  }
  for (MovedPlug& moved : taken) {
    if (!moved.control) continue;
    // Where it varies, any value will do that the plug takes
    for (const Control& control : rest_.controls) {
      if (control.plug == moved.plug) moved.number = control.value;
    }
  }
  std::ranges::sort(taken, {}, [](const MovedPlug& moved) {
    const PlugRef& plug = moved.plug;
    return std::tuple(plug.node.index, plug.attribute, plug.element, plug.component);
  });
  Result<Kept*> kept = taken.empty() ? plain : Find(pose.clip, taken);
  if (!kept.ok()) return kept.status();
  if ((*kept)->at != pose) {
    (*kept)->at = std::nullopt;
    Forget(pose, *kept);
    const auto begin = std::chrono::steady_clock::now();
    KPSA_RETURN_IF_ERROR(Move(pose, *kept));
    KPSA_RETURN_IF_ERROR(Pull(pose, *kept));
    (*kept)->microseconds =
        std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - begin).count();
    (*kept)->at = pose;
  }
  now_ = *kept;
  return Status();
}

// What nodes remember is of the controls that they saw: other ones are run up to anew.
void LiveSide::Forget(const LivePose& pose, Kept* kept) {
  if (kept->run_up->stateful() && kept->moved != pose.moved) {
    kept->evaluator->Restart();
    kept->run_up.emplace(*kept->plan, kept->playing->rig());
  }
  kept->moved = pose.moved;
}

// What no pose moves any more goes back to where the rig has it; equal values cost nothing.
Status LiveSide::Move(const LivePose& pose, Kept* kept) {
  for (const MovedPlug& moved : pose.moved) {
    if (std::ranges::find(kept->touched, moved.plug, &Touched::plug) != kept->touched.end()) continue;
    const PlugHandle handle = kept->plan->Handle(moved.plug);
    if (handle) kept->touched.push_back({moved.plug, handle, InitialOf(*kept->plan, handle)});
  }
  for (const Touched& touched : kept->touched) {
    const auto moved = std::ranges::find(pose.moved, touched.plug, &MovedPlug::plug);
    if (moved == pose.moved.end()) {
      KPSA_RETURN_IF_ERROR(kept->evaluator->Set(touched.handle, touched.initial));
      continue;
    }
    const Result<Value> value = ValueOf(*kept->playing->rig().graph, touched.plug, moved->number);
    if (!value.ok()) return value.status();
    KPSA_RETURN_IF_ERROR(kept->evaluator->Set(touched.handle, *value));
  }
  return Status();
}

Status LiveSide::Pull(const LivePose& pose, Kept* kept) const {
  const Playing& playing = *kept->playing;
  Evaluator& evaluator = *kept->evaluator;
  if (const Status status = kept->run_up->To(pose.seconds, &evaluator); !status.ok())
    return playing.Located(status);
  // What needs its previous frame sees every frame; failures are those of outputs
  if (kept->run_up->stateful()) (void)evaluator.Evaluate();
  for (Index output = 0; output < kept->wanted; ++output) {
    if (const Status status = evaluator.Pull(output); !status.ok()) return playing.Located(status);
  }
  return Status();
}

Status LiveSide::CopyPoints(std::span<float> xyz) const {
  const Playing& playing = *now_->playing;
  std::size_t at = 0;
  Index output = 0;
  for (const std::size_t m : ShownMeshes(playing.rig().scene)) {
    const CharacterMesh& mesh = playing.rig().scene.meshes[m];
    const ConstPointsView points = now_->evaluator->Points(output++);
    KPSA_RETURN_IF_ERROR(CheckCount(playing, mesh, mesh.points, points.count));
    Interleave(mesh.mesh(), points, 0, mesh.vertex_count, xyz.data() + at);
    at += std::size_t{3} * mesh.vertex_count;
  }
  return Status();
}

std::optional<FrameDecision> LiveSide::Decision() const {
  std::optional<FrameDecision> worst;
  const std::vector<AppliedSubspace>& applied = now_->playing->applied();
  for (Index n = 0; n < applied.size(); ++n) {
    FrameDecision decision =
        DecisionOf(applied[n], *now_->evaluator, now_->playing->first_decision() + kDecisionOutputs * n);
    if (!worst.has_value() || IsWorse(decision, *worst)) worst = std::move(decision);
  }
  return worst;
}

Result<std::vector<std::pair<std::string, double>>> LiveSide::Values() {
  std::vector<std::pair<std::string, double>> values;
  for (const Shown& shown : now_->shown) {
    double number = shown.number;
    const PlugRef& plug = shown.control->plug;
    if (shown.output != kNoIndex) {
      if (const Status status = now_->evaluator->Pull(shown.output); !status.ok())
        return now_->playing->Located(status);
      const Value value = Value::ReadSlot(now_->plan->outputs()[shown.output].type,
                                          &now_->evaluator->Get<std::byte>(shown.output));
      double one = 0;
      number = NumbersOf(value, &one)[static_cast<std::size_t>(std::max(0, plug.component))];
    } else if (std::ranges::find(now_->at->moved, plug, &MovedPlug::plug) != now_->at->moved.end()) {
      continue;
    }
    values.emplace_back(shown.control->name, number / rest_.units.FactorOf(shown.control->unit));
  }
  return values;
}

}  // namespace kpsa::engine
