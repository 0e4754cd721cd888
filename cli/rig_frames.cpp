#include "cli/rig_frames.h"

#include <algorithm>

#include "cli/common.h"
#include "cli/progress.h"

namespace kpsa::engine {

Request ShownPoints(const Rig& rig) {
  Request request;
  for (const std::size_t m : ShownMeshes(rig.scene))
    request.outputs.push_back({rig.scene.meshes[m].points, {}});
  request.varying.push_back(rig.scene.time);
  return request;
}

Result<std::shared_ptr<const Plan>> CompileFor(const Rig& rig, Compiler* compiler, const Request& request) {
  Result<std::shared_ptr<const Plan>> plan = compiler->Compile(*rig.graph, request);
  if (plan.ok()) return plan;
  Status located;
  for (const Error& error : plan.status().errors()) located.Append(Status(error).At(PlaceOf(rig, error)));
  return located;
}

Status EvaluateTimes(const Rig& rig, const std::shared_ptr<const Plan>& plan,
                     const std::vector<double>& times, const RigFrameOptions& options,
                     const RigFrameSink& sink) {
  Progress progress(options.label, times.size(), options.quiet || options.label.empty());
  const Index time = plan->FindVarying(rig.scene.time);
  FrameOptions frame_options;
  frame_options.threads = options.threads;
  frame_options.cancel = InterruptFlag();
  frame_options.profile = options.profile;
  const Status status = EvaluateFrames(
      plan, times.size(), frame_options,
      [&](std::size_t frame, Evaluator& evaluator) {
        if (time != kNoIndex) evaluator.Set(time, times[frame]);
      },
      [&](std::size_t frame, const Evaluator& evaluator, const Status& evaluated) -> Status {
        if (!evaluated.ok()) {
          const Error& error = evaluated.errors().front();
          return Status::Evaluation("at {} s: {}", times[frame], error.message)
              .OfNode(error.node)
              .At(PlaceOf(rig, error));
        }
        progress.Set(frame + 1);
        return sink(frame, evaluator);
      });
  if (!status.ok() && status.kind() == ErrorKind::kInterrupted) return InterruptedStatus();
  return status;
}

Status EvaluateTo(const Rig& rig, int frame, Evaluator* evaluator, Profile* profile) {
  const Plan& plan = evaluator->plan();
  const Index time = plan.FindVarying(rig.scene.time);
  for (int f = plan.stateful_node().empty() ? frame - 1 : std::min(frame - 1, 0); f <= frame; ++f) {
    if (Interrupted()) return InterruptedStatus();
    if (f == frame && profile != nullptr) evaluator->Record(profile, f);
    if (time != kNoIndex) evaluator->Set(time, f / rig.fps);
    const Status status = evaluator->Evaluate();
    if (status.ok()) continue;
    const Error& error = status.errors().front();
    return Status::Evaluation("at frame {}: {}", f, error.message).OfNode(error.node).At(PlaceOf(rig, error));
  }
  return Status();
}

}  // namespace kpsa::engine
