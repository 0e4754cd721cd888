#include "cli/rig_frames.h"

#include <algorithm>

#include "cli/common.h"
#include "cli/progress.h"

namespace kpsa {

std::vector<std::size_t> ShownMeshes(const Rig& rig) {
  const std::vector<CharacterMesh>& meshes = rig.scene.meshes;
  const bool any = std::any_of(meshes.begin(), meshes.end(), [](const auto& mesh) { return mesh.visible; });
  std::vector<std::size_t> shown;
  for (std::size_t m = 0; m < meshes.size(); ++m) {
    if (meshes[m].visible || !any) shown.push_back(m);
  }
  return shown;
}

Request ShownPoints(const Rig& rig) {
  Request request;
  for (const std::size_t m : ShownMeshes(rig)) request.outputs.push_back({rig.scene.meshes[m].points, {}});
  request.varying.push_back(rig.scene.time);
  return request;
}

Result<std::shared_ptr<const Plan>> CompileFor(const Rig& rig, Compiler* compiler, const Request& request) {
  Result<std::shared_ptr<const Plan>> plan = compiler->Compile(*rig.graph, request);
  if (plan.ok()) return plan;
  Status located;
  for (const Error& error : plan.status().errors())
    located.Append(Status(error).At(PlaceOfMessage(rig, error.message)));
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
          const std::string& message = evaluated.errors().front().message;
          return Status::Evaluation("at {} s: {}", times[frame], message).At(PlaceOfMessage(rig, message));
        }
        progress.Set(frame + 1);
        return sink(frame, evaluator);
      });
  if (!status.ok() && status.kind() == ErrorKind::kInterrupted) return InterruptedStatus();
  return status;
}

}  // namespace kpsa
