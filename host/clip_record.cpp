#include "host/clip_record.h"

#include <algorithm>
#include <cmath>

#include "base/quantity_text.h"
#include "base/text.h"
#include "host/rig_frames.h"
#include "host/vertex_points.h"

namespace kpsa::engine {
namespace {

bool IsTest(const Rig& rig, const std::string& clip) {
  return std::ranges::any_of(rig.accelerate, [&](const AccelerateEntry& entry) {
    return std::ranges::find(entry.test_clips, clip) != entry.test_clips.end();
  });
}

Result<std::vector<float>> Record(const Rig& rig, Compiler* compiler, const Request& request,
                                  const std::vector<double>& times, const RigFrameOptions& options) {
  const auto plan = CompileFor(rig, compiler, request);
  if (!plan.ok()) return plan.status();
  const std::size_t width = 3 * ShownVertices(rig);
  std::vector<float> points(times.size() * width);
  KPSA_RETURN_IF_ERROR(
      EvaluateTimes(rig, *plan, times, options, [&](std::size_t frame, const Evaluator& evaluator) -> Status {
        const std::span<float> to = std::span(points).subspan(frame * width, width);
        ReadVertices(rig, evaluator, to);
        if (!std::ranges::all_of(to, [](float x) { return std::isfinite(x); }))
          return Status::Evaluation("at {} s: a point is not finite", times[frame]).At({rig.path});
        return Status();
      }));
  return points;
}

}  // namespace

std::size_t ShownVertices(const Rig& rig) {
  std::size_t vertices = 0;
  for (const std::size_t m : ShownMeshes(rig.scene)) vertices += rig.scene.meshes[m].vertex_count;
  return vertices;
}

void ReadVertices(const Rig& rig, const Evaluator& evaluator, std::span<float> xyz) {
  float* to = xyz.data();
  Index output = 0;
  for (const std::size_t m : ShownMeshes(rig.scene)) {
    const CharacterMesh& mesh = rig.scene.meshes[m];
    Interleave(mesh.mesh(), evaluator.Points(output++), 0, mesh.vertex_count, to);
    to += 3 * std::size_t{mesh.vertex_count};
  }
}

Result<ClipRecord> RecordClip(const RigOpener& opener, const std::string& clip,
                              const ClipRecordOptions& options) {
  RigChange change;
  if (!clip.empty()) change.clip = clip;
  const Result<std::unique_ptr<OpenRig>> open = opener.open(change);
  if (!open.ok()) return open.status();
  Rig& rig = (*open)->rig;
  const Result<std::vector<double>> times = opener.times(**open);
  if (!times.ok()) return times.status();
  ClipRecord record;
  record.name = rig.scene.clip.value_or("(rest)");
  record.test = IsTest(rig, record.name);
  record.fps = rig.fps;
  record.times = *times;
  record.width = 3 * ShownVertices(rig);
  const double bytes = (options.acceleration.has_value() ? 2.0 : 1.0) * sizeof(float) *
                       static_cast<double>(record.width * times->size());
  if (bytes > kMostRecordBytes) {
    return Status::Usage("the clip \"{}\" has {} of {}, which are {} of positions: expected at most {}",
                         record.name, Plural(times->size(), "frame"), Plural(record.width / 3, "vertex"),
                         ByteText(static_cast<std::uint64_t>(bytes)),
                         ByteText(static_cast<std::uint64_t>(kMostRecordBytes)))
        .At({rig.path});
  }
  RigFrameOptions frames;
  frames.threads = options.threads;
  frames.watch = options.watch;
  Compiler compiler;
  Result<std::vector<float>> full = Record(rig, &compiler, ShownPoints(rig), *times, frames);
  if (!full.ok()) return full.status();
  record.full = std::move(*full);
  if (!options.acceleration.has_value()) return record;
  const Result<std::vector<AppliedSubspace>> applied =
      ApplyAcceleration(&rig, &compiler, *options.acceleration);
  if (!applied.ok()) return applied.status();
  Result<std::vector<float>> accelerated = Record(rig, &compiler, ShownPoints(rig), *times, frames);
  if (!accelerated.ok()) return accelerated.status();
  record.accelerated = std::move(*accelerated);
  return record;
}

}  // namespace kpsa::engine
