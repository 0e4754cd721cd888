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
namespace {

// COLOR_0 times the materials' colours (glTF 2.0, 3.7.2.1) by point of a mesh; null where the file has no
// COLOR_0.
std::shared_ptr<const std::vector<float>> PointColors(const Rig& rig, std::size_t m) {
  const CharacterMesh& mesh = rig.scene.meshes[m];
  const gltf::Mesh& file = rig.character->meshes[rig.character->nodes[mesh.gltf_node].mesh];
  if (file.colors.empty()) return nullptr;
  const auto& point_of = mesh.mesh().data().vertex_to_point;
  auto colors = std::make_shared<std::vector<float>>(3 * std::size_t{mesh.mesh().point_count()}, 1.0f);
  for (const gltf::Primitive& primitive : file.primitives) {
    std::array<double, 4> base = {1, 1, 1, 1};
    if (primitive.material != kNoIndex) base = rig.character->materials[primitive.material].base_color;
    for (std::size_t v = primitive.first_vertex;
         v < std::size_t{primitive.first_vertex} + primitive.vertex_count; ++v) {
      for (std::size_t k = 0; k < 3; ++k) {
        (*colors)[3 * std::size_t{point_of[v]} + k] = static_cast<float>(file.colors[3 * v + k] * base[k]);
      }
    }
  }
  return colors;
}

}  // namespace

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

RenderInput MakeInput(const Rig& rig, const Pose& pose) {
  RenderInput input;
  for (std::size_t m = 0; m < pose.size(); ++m) {
    if (pose[m].empty()) continue;  // hidden
    const Mesh::Data& mesh = rig.scene.meshes[m].mesh().data();
    const std::span<const Index> triangles(mesh.triangles);
    if (const auto colors = PointColors(rig, m); colors != nullptr) {
      RenderPart part;
      part.points = pose[m], part.triangles = triangles;
      part.colors = *colors, part.owner = colors;
      input.parts.push_back(part);
      continue;
    }
    const bool colored =
        std::any_of(mesh.primitives.begin(), mesh.primitives.end(), [](const Mesh::Primitive& p) {
          return p.base_color[0] != p.base_color[1] || p.base_color[1] != p.base_color[2];
        });
    if (!colored) {
      RenderPart part;
      part.points = pose[m], part.triangles = triangles;
      input.parts.push_back(part);
      continue;
    }
    for (const Mesh::Primitive& primitive : mesh.primitives) {
      RenderPart part;
      part.points = pose[m], part.triangles = triangles.subspan(std::size_t{3} * primitive.first_triangle,
                                                                std::size_t{3} * primitive.triangle_count);
      part.color = {double{primitive.base_color[0]}, double{primitive.base_color[1]},
                    double{primitive.base_color[2]}};
      if (!part.triangles.empty()) input.parts.push_back(part);
    }
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
