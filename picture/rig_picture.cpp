#include "picture/rig_picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <memory>

#include "base/quantity_text.h"
#include "base/text.h"
#include "kpsa/subspace.h"

namespace kpsa::engine {

Result<std::vector<Pose>> EvaluatePoses(const Rig& rig, Compiler* compiler, const std::vector<double>& times,
                                        const RigFrameOptions& options, const std::vector<std::size_t>& shown,
                                        Verdicts* verdicts) {
  Request request;
  for (const std::size_t m : shown) request.outputs.push_back({rig.scene.meshes[m].points, {}});
  request.varying.push_back(rig.scene.time);
  if (verdicts != nullptr) verdicts->Ask(rig, &request);
  const auto plan = CompileFor(rig, compiler, request);
  if (!plan.ok()) return plan.status();
  std::vector<Pose> poses(times.size(), Pose(rig.scene.meshes.size()));
  KPSA_RETURN_IF_ERROR(
      EvaluateTimes(rig, *plan, times, options, [&](std::size_t frame, const Evaluator& evaluator) {
        if (verdicts != nullptr) verdicts->Add(FrameNumber(times[frame], rig.fps), evaluator);
        for (Index output = 0; output < shown.size(); ++output) {
          const ConstPointsView points = evaluator.Points(output);
          std::vector<float>& xyz = poses[frame][shown[output]];
          xyz.resize(3 * points.count);
          for (std::size_t i = 0; i < points.count; ++i)
            xyz[3 * i] = points.x[i], xyz[3 * i + 1] = points.y[i], xyz[3 * i + 2] = points.z[i];
        }
        return Status();
      }));
  return poses;
}

RenderInput MakeInput(const RigLook& look, const Pose& pose) {
  RenderInput input;
  for (std::size_t m = 0; m < pose.size(); ++m) {
    if (pose[m].empty()) continue;  // hidden
    const MeshLook& mesh = look[m];
    auto points = std::make_shared<std::vector<float>>();
    points->reserve(3 * mesh.points.size());
    for (const Index point : mesh.points) {
      const auto from = pose[m].begin() + std::ptrdiff_t{3} * point;
      points->insert(points->end(), from, from + 3);
    }
    RenderPart& part = input.parts.emplace_back();
    part.points = *points, part.owner = points;
    part.triangles = mesh.triangles, part.smooth = mesh.smooth, part.colors = mesh.colors;
    part.textures = mesh.textures, part.texture = mesh.texture, part.uvs = mesh.uvs;
  }
  return input;
}

RenderDots KeyPoints(const std::vector<AppliedSubspace>& applied, const Pose& pose) {
  RenderDots dots;
  std::size_t scalars = 0;
  bool paper = true;
  for (const AppliedSubspace& one : applied) {
    paper = paper && one.subspace->mode == EstimatorMode::kPaper;
    for (const CueDescription& cue : one.subspace->cues) {
      if (cue.kind != CueDescription::Kind::kPoint || one.entry.points[cue.mesh].colors) {
        ++scalars;
        continue;
      }
      const std::vector<float>& points = pose[one.entry.points[cue.mesh].mesh];
      if (points.empty()) continue;  // of a hidden mesh
      for (std::size_t k = 0; k < 3; ++k) dots.points.push_back(points[3 * std::size_t{cue.point} + k]);
    }
  }
  dots.title = Plural(dots.points.size() / 3, paper ? "key point" : "point");
  if (scalars > 0) dots.title += ", " + Plural(scalars, "scalar");
  return dots;
}

double WorstDistance(const Pose& a, const Pose& b) {
  double worst = 0;
  for (std::size_t m = 0; m < a.size(); ++m) {
    for (float distance : PointDistances(a[m], b[m])) worst = std::max(worst, double{distance});
  }
  return worst;
}

std::vector<std::string> Captions(const Rig& rig, double time, const std::string& more) {
  std::string stem = rig.character->path.empty() ? rig.path : rig.character->path;
  stem = std::filesystem::path(stem).stem().string();
  std::string clip = rig.scene.clip.value_or("no clip");
  if (!rig.scene.clip.has_value() && rig.playing.has_value()) {
    clip.clear();
    for (const PlayedClip& played : rig.played) clip += (clip.empty() ? "" : " + ") + played.id;
  }
  const double frame = time * rig.fps;
  const std::string when = std::abs(frame - std::round(frame)) < 1e-3
                               ? fmt::format("frame {}", FrameNumber(time, rig.fps))
                               : fmt::format("{:.4g} s", time);
  const std::string end = more.empty() ? when : when + ", " + more;
  return {stem + ", " + clip + ", " + end, clip + ", " + end, end, more.empty() ? when : more};
}

std::string VerdictWord(const FrameDecision& decision) {
  return decision.verdict() == FrameVerdict::kHit     ? "hit"
         : decision.verdict() == FrameVerdict::kBlend ? "blend"
                                                      : "miss";
}

std::string PictureTitle(const FrameDecision& decision) {
  switch (decision.verdict()) {
    case FrameVerdict::kHit:
      return "accelerated";
    case FrameVerdict::kBlend:
      // Never 0 or 100: these are the other two
      return fmt::format("blend: {:.0f} % full", std::clamp(100 * decision.full_weight, 1.0, 99.0));
    case FrameVerdict::kMiss:
      break;
  }
  return "miss: fully evaluated";
}

}  // namespace kpsa::engine
