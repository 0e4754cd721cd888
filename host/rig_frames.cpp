#include "host/rig_frames.h"

#include <algorithm>
#include <cmath>

#include "base/text.h"
#include "host/run_up.h"

namespace kpsa::engine {
namespace {

constexpr double kFrameRounding = 1e-3;  // of a frame: times of clips are floats

}  // namespace

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

Result<std::vector<double>> FramesBetween(std::string_view clip, double begin, double end, double fps) {
  // A clip that was made at this rate ends on a frame, but for rounding
  // (+ 0: from a first frame -0)
  const double first = std::ceil(begin * fps - kFrameRounding) + 0.0,
               last = std::floor(end * fps + kFrameRounding);
  if (!(last - first < static_cast<double>(kMaxSamples)))
    return Status::Usage("the clip \"{}\" lasts {} s, more than {} frames", clip, end,
                         Thousands(kMaxSamples));
  std::vector<double> times;
  for (double frame = first; frame <= last; ++frame) times.push_back(frame / fps);
  return times;
}

Result<std::vector<double>> ClipTimes(const CharacterClip& clip, double fps) {
  return FramesBetween(clip.id, clip.begin, clip.duration, fps);
}

Result<std::vector<double>> ClipTimes(const Rig& rig) {
  CharacterClip playing;
  if (rig.playing.has_value()) playing = *rig.playing;
  for (const CharacterClip& clip : rig.scene.clips) {
    if (rig.scene.clip.has_value() && clip.id == *rig.scene.clip) playing = clip;
  }
  playing.id = rig.scene.clip.value_or("");
  return ClipTimes(playing, rig.fps);
}

std::int64_t FrameNumber(double seconds, double fps) {
  return std::llround(std::clamp(seconds * fps, -1e15, 1e15));
}

Status FailedAt(const Rig& rig, double seconds, const Status& evaluated) {
  const Error& error = evaluated.errors().front();
  return Status::Evaluation("at {} s: {}", seconds, error.message).OfNode(error.node).At(PlaceOf(rig, error));
}

Status EvaluateTimes(const Rig& rig, const std::shared_ptr<const Plan>& plan,
                     const std::vector<double>& times, const RigFrameOptions& options,
                     const RigFrameSink& sink) {
  RunUp run_up(*plan, rig, options.watch.cancel);
  Status before;  // of frames on the way; then all run on one thread
  FrameOptions frame_options;
  frame_options.threads = options.threads;
  frame_options.cancel = options.watch.cancel;
  frame_options.profile = options.profile;
  const Status status = EvaluateFrames(
      plan, times.size(), frame_options,
      [&](std::size_t frame, Evaluator& evaluator) {
        if (run_up.stateful()) evaluator.Record(nullptr);
        Status status = run_up.To(times[frame], &evaluator);
        if (run_up.stateful()) before = std::move(status);
      },
      [&](std::size_t frame, const Evaluator& evaluator, const Status& evaluated) -> Status {
        if (!before.ok()) return before;
        if (!evaluated.ok()) return FailedAt(rig, times[frame], evaluated);
        options.watch.Done(frame + 1, times.size());
        return sink(frame, evaluator);
      });
  if (!status.ok() && status.kind() == ErrorKind::kInterrupted) return CancelledStatus();
  return status;
}

Status EvaluateTo(const Rig& rig, int frame, Evaluator* evaluator, const Watch& watch, Profile* profile) {
  const Plan& plan = evaluator->plan();
  const Index time = plan.FindVarying(rig.scene.time);
  for (int f = plan.stateful_node().empty() ? frame - 1 : std::min(frame - 1, 0); f <= frame; ++f) {
    if (watch.cancelled()) return CancelledStatus();
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
