// Many frames of a scene: Frames and Profile.
#include <algorithm>
#include <cmath>
#include <exception>

#include "graph/frames.h"
#include "graph/profile.h"
#include "host/problems.h"
#include "host/rig_frames.h"
#include "host/scene_impl.h"
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

engine::Status CheckTimes(std::span<const double> seconds) {
  for (const double time : seconds) {
    if (!std::isfinite(time)) return engine::Status::Usage("a time of {} s: expected a number", time);
  }
  return engine::Status();
}

engine::Status CheckThreads(const engine::Plan& plan, int threads) {
  const std::string& node = plan.prototype_node();
  if (threads <= 1 || node.empty()) return engine::Status();
  return engine::Status::Usage(
             "\"{}\" is computed by a function of this program, one frame at a time: expected 0 or 1 "
             "threads, got {}",
             node, threads)
      .OfNode(node);
}

}  // namespace

kpsa::Result<std::vector<StepTime>> Scene::Profile(std::span<const double> seconds) {
  const engine::Result<Impl::Snapshot> taken = impl_->Take();
  if (!taken.ok()) return engine::ProblemsOf(taken.status());
  if (const engine::Status status = CheckTimes(seconds); !status.ok())
    return engine::ProblemsOf(taken->playing->Located(status));
  const engine::Plan& plan = *taken->plan;
  engine::Evaluator evaluator(taken->plan);
  engine::RunUp run_up(plan, taken->playing->rig(), nullptr, impl_->on_the_way);
  engine::Profile profile(plan);
  taken->Apply(&evaluator);
  for (const double time : seconds) {
    evaluator.Record(nullptr);
    if (const engine::Status status = run_up.To(time, &evaluator); !status.ok())
      return engine::ProblemsOf(taken->playing->Located(status));
    evaluator.Record(&profile);
    if (const engine::Status status = evaluator.Evaluate(); !status.ok())
      return engine::ProblemsOf(engine::FailedAt(taken->playing->rig(), time, status));
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
  const engine::Result<Impl::Snapshot> taken = impl_->Take();
  if (!taken.ok()) return engine::ProblemsOf(taken.status());
  const engine::Playing& playing = *taken->playing;
  for (const engine::Status& status : {CheckTimes(seconds), CheckThreads(*taken->plan, options.threads)}) {
    if (!status.ok()) return engine::ProblemsOf(playing.Located(status));
  }
  const std::vector<std::size_t> shown = engine::ShownMeshes(playing.rig().scene);
  std::vector<std::vector<float>> points(shown.size());
  std::vector<std::span<const float>> spans(shown.size());
  for (std::size_t m = 0; m < shown.size(); ++m)
    points[m].resize(std::size_t{3} * playing.rig().scene.meshes[shown[m]].vertex_count),
        spans[m] = points[m];
  engine::FrameOptions frame_options;
  frame_options.threads = options.threads;
  frame_options.cancel = options.cancel;
  engine::RunUp run_up(*taken->plan, playing.rig(), options.cancel, impl_->on_the_way);
  engine::Status before;  // of frames that were evaluated on the way; then all run on one thread
  bool ended = false;
  std::exception_ptr thrown;
  const engine::Status status = engine::EvaluateFrames(
      taken->plan, seconds.size(), frame_options,
      [&](std::size_t frame, engine::Evaluator& evaluator) {
        taken->Apply(&evaluator);
        engine::Status status = run_up.To(seconds[frame], &evaluator);
        if (run_up.stateful()) before = std::move(status);
      },
      [&](std::size_t frame, const engine::Evaluator& evaluator,
          const engine::Status& evaluated) -> engine::Status {
        if (!before.ok()) return playing.Located(before);
        if (!evaluated.ok()) return engine::FailedAt(playing.rig(), seconds[frame], evaluated);
        for (std::size_t m = 0; m < shown.size(); ++m) {
          const engine::CharacterMesh& mesh = playing.rig().scene.meshes[shown[m]];
          const engine::ConstPointsView view = evaluator.Points(static_cast<engine::Index>(m));
          KPSA_RETURN_IF_ERROR(CheckCount(playing, mesh, playing.request().outputs[m].plug, view.count));
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
