#include "picture/strips.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "kpsa/kpsa_node.h"
#include "kpsa/subspace.h"
#include "picture/caption.h"

namespace kpsa::engine {

double ShownTolerance(const AppliedSubspace& applied) {
  return std::max(applied.tolerance < kAnyError ? applied.tolerance : applied.subspace->tolerance, 1e-7);
}

Status PlayTestClip(Rig* rig) {
  for (const AccelerateEntry& entry : rig->accelerate) {
    if (!entry.test_clips.empty()) return SetClip(rig, entry.test_clips.front()).At({rig->path});
  }
  return Status();
}

Result<std::vector<Image>> DrawStrip(const Rig& rig, Compiler* compiler, const std::vector<double>& times,
                                     const StripView& view, const RigFrameOptions& options,
                                     std::vector<std::string>* notes) {
  const Result<std::vector<std::size_t>> meshes = ChooseMeshes(rig, view.meshes);
  if (!meshes.ok()) return meshes.status();
  const RigLook look = LookOf(rig, *meshes, view.textures, notes);
  const Result<std::vector<Pose>> poses = EvaluatePoses(rig, compiler, times, options, *meshes);
  if (!poses.ok()) return poses.status();
  const Result<std::vector<Camera>> cameras =
      FrameRig(rig, *poses, view.options, view.framing, view.turntable);
  if (!cameras.ok()) return cameras.status();
  std::vector<Image> images;
  for (std::size_t i = 0; i < (view.turntable > 0 ? cameras->size() : times.size()); ++i) {
    const std::size_t frame = view.turntable > 0 ? 0 : i, camera = view.turntable > 0 ? i : 0;
    Result<Image> image = RenderMesh(MakeInput(look, (*poses)[frame]), (*cameras)[camera], view.options);
    if (!image.ok()) return image.status();
    const std::string turned =
        view.turntable > 0 ? fmt::format("{:.0f} deg", 360.0 * static_cast<double>(i) / view.turntable) : "";
    DrawCaption(*image, Captions(rig, times[frame], turned));
    images.push_back(std::move(*image));
    if (options.watch.cancel != nullptr && *options.watch.cancel) return CancelledStatus();
  }
  return InRows(images);
}

Result<ComparedFrames> CompareFrames(Rig* rig, Compiler* compiler, const AccelerationChoice& choice,
                                     const std::vector<double>& times, bool all, const StripView& view,
                                     const RigFrameOptions& options, std::vector<std::string>* notes) {
  const Result<std::vector<std::size_t>> meshes = ChooseMeshes(*rig, view.meshes);
  if (!meshes.ok()) return meshes.status();
  const RigLook look = LookOf(*rig, *meshes, view.textures, notes);
  const Result<std::vector<Pose>> full = EvaluatePoses(*rig, compiler, times, options, *meshes);
  if (!full.ok()) return full.status();
  const Result<std::vector<AppliedSubspace>> applied = ApplyAcceleration(rig, compiler, choice);
  if (!applied.ok()) return applied.status();
  Verdicts verdicts(*applied);
  const Result<std::vector<Pose>> fast = EvaluatePoses(*rig, compiler, times, options, *meshes, &verdicts);
  if (!fast.ok()) return fast.status();
  ComparedFrames compared;
  std::vector<std::size_t> frames;
  for (std::size_t f = 0; f < times.size(); ++f) {
    frames.push_back(f);
    const double error = WorstDistance((*full)[f], (*fast)[f]);
    if (error > compared.error) compared.worst = f, compared.error = error;
  }
  if (!all) frames = {compared.worst};
  const Result<std::vector<Camera>> camera =
      FrameRig(*rig, all ? *full : std::vector<Pose>{(*full)[compared.worst]}, view.options, view.framing);
  if (!camera.ok()) return camera.status();
  for (std::size_t f : frames) {
    RenderInput exact = MakeInput(look, (*full)[f]), emitted = MakeInput(look, (*fast)[f]);
    exact.tolerance = ShownTolerance(applied->front());
    exact.scalar_max = emitted.scalar_max = view.error_scale.value_or(exact.tolerance);
    const RenderDots dots = KeyPoints(*applied, (*full)[f]);
    const FrameDecision& decision = verdicts.records()[f].decision;
    Result<Image> row =
        RenderComparison(exact, emitted, camera->front(), view.options, &dots, PictureTitle(decision));
    if (!row.ok()) return row.status();
    DrawCaption(*row, Captions(*rig, times[f], VerdictWord(decision)));
    compared.rows.push_back(std::move(*row));
    if (options.watch.cancel != nullptr && *options.watch.cancel) return CancelledStatus();
  }
  return compared;
}

}  // namespace kpsa::engine
