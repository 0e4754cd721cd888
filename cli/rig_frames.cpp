#include "cli/rig_frames.h"

#include "cli/common.h"
#include "cli/progress.h"

namespace kpsa {

Request AllMeshes(const Rig& rig) {
  Request request;
  for (const CharacterMesh& mesh : rig.scene.meshes) request.outputs.push_back({mesh.points, {}});
  request.varying.push_back(rig.scene.time);
  return request;
}

Result<std::shared_ptr<const Plan>> CompileFor(const Rig& rig, Compiler* compiler, const Request& request) {
  Result<std::shared_ptr<const Plan>> plan = compiler->Compile(*rig.graph, request);
  if (!plan.ok()) return Status(plan.status()).At({rig.path});
  return plan;
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
          return Status::Evaluation("at {} s: {}", times[frame], evaluated.errors().front().message)
              .At({rig.path});
        }
        progress.Set(frame + 1);
        return sink(frame, evaluator);
      });
  if (!status.ok() && status.kind() == ErrorKind::kInterrupted) return InterruptedStatus();
  return status;
}

}  // namespace kpsa
