#include "host/bench/contender.h"

#include <fmt/format.h>

#include <algorithm>

#include "host/rig_frames.h"
#include "host/rig_training.h"
#include "kpsa/training_record.h"

namespace kpsa::engine {
namespace {

// Where colours are accelerated, they are what is compared: those of the nodes, or what takes their place.
Request ColorOutputs(const Rig& rig, const std::vector<AppliedSubspace>& applied, bool accelerated) {
  Request request;
  for (const AppliedSubspace& one : applied) {
    for (std::size_t p = 0; p < one.entry.points.size(); ++p) {
      if (one.entry.points[p].colors)
        request.outputs.push_back({accelerated ? one.Output(*rig.graph, p) : one.entry.points[p].points, {}});
    }
  }
  request.varying.push_back(rig.scene.time);
  return request;
}

}  // namespace

Status Contender::Load(const RigOpener& opener, const RigChange& clip, const SideOptions& options,
                       Request* outputs) {
  Result<std::unique_ptr<OpenRig>> loaded = opener.open(clip);
  if (!loaded.ok()) return loaded.status();
  side.reset(), verdicts.reset(), applied.clear();  // of the clip before, which refer to its rig
  open = std::move(*loaded);
  Rig& rig = open->rig;
  Compiler compiler;
  *outputs = ShownPoints(rig);
  Result<std::vector<AppliedSubspace>> made = ApplyAcceleration(&rig, &compiler, choice);
  if (!made.ok()) return made.status();
  applied = std::move(*made);
  request = ShownPoints(rig);
  if (Request colors = ColorOutputs(rig, applied, false); !colors.outputs.empty()) {
    *outputs = std::move(colors);
    request = ColorOutputs(rig, applied, true);
  }
  compared = request.outputs.size();
  if (options.still) outputs->varying = request.varying = VaryingPlugs(rig);
  verdicts = std::make_unique<Verdicts>(applied);
  verdicts->Ask(rig, &request);
  const auto plan = CompileFor(rig, &compiler, request);
  if (!plan.ok()) return plan.status();
  cue_costs.Load(rig, **plan, applied, &compiler);
  side = std::make_unique<Side>(rig, *plan, options);
  clip_errors = PointErrors(compared);
  weights.clear();
  return tolerances.Load(opener, clip, {&choice, &applied, &request, compared}, options);
}

void Contender::Describe() {
  const Rig& rig = open->rig;
  result.clips.push_back(rig.scene.clip.value_or("(rest)"));
  if (result.clips.size() > 1) return;
  std::map<std::string, std::size_t> stages;
  if (ColorOutputs(rig, applied, false).outputs.empty()) {
    for (const std::size_t m : ShownMeshes(rig.scene))
      result.output_points += rig.scene.meshes[m].mesh().point_count();
  } else {
    for (const AppliedSubspace& one : applied) {
      for (const SubspaceOutput& output : one.subspace->outputs) result.output_points += output.points;
    }
  }
  result.subspace = applied.front().path;
  result.mode = applied.front().subspace->mode == EstimatorMode::kMap ? "map" : "paper";
  result.light = applied.front().subspace->of_light();
  result.promise.Make(applied);
  double bytes = 0, tiles = 0;
  for (const AppliedSubspace& one : applied) {
    for (const std::string& note : one.notes) result.notes.push_back(note);
    for (const SubspaceOutput& output : one.subspace->outputs) result.points += output.points;
    for (const TileMap& map : one.subspace->tiles) {
      bytes += static_cast<double>(map.bytes()), tiles += static_cast<double>(map.tiles());
      result.mean_rank += map.mean_rank() * static_cast<double>(map.tiles());
    }
    result.cues += one.subspace->cues.size();
    result.modes += one.subspace->modes;
    for (const CueDescription& cue : one.subspace->cues) {
      const bool scalar = cue.kind != CueDescription::Kind::kPoint;
      ++stages[cue.kind == CueDescription::Kind::kProduct ? "products of scalars"
               : scalar                                   ? "scalars"
                                                          : "points of " + CueName(*one.subspace, cue)];
      result.cue_points += !scalar;
    }
    const TrainingRecord record = ParseTraining(one.subspace->training);
    for (const std::string& clip : record.clips) result.trained_on.push_back(clip);
    if (record.sampled_poses > 0)
      result.trained_on.push_back(fmt::format("{} samples of the controls", record.sampled_poses));
  }
  result.bytes_per_point = bytes / static_cast<double>(std::max<std::size_t>(1, result.points));
  result.mean_rank /= std::max(1.0, tiles);
  for (const auto& [stage, count] : stages) result.cue_stages.push_back(fmt::format("{} {}", count, stage));
}

// After both have evaluated a frame.
void Contender::Compare(std::int64_t frame, const Evaluator& full, const std::string& clip) {
  verdicts->Add(frame, *side->evaluator);
  const FrameDecision& decision = verdicts->records().back().decision;
  result.hits += decision.hit();
  result.blends += decision.verdict() == FrameVerdict::kBlend;
  if (!decision.hit()) {
    reasons.Add((applied.size() > 1 ? decision.entry + ": " : "") + decision.reason,
                fmt::format("frame {} of {}", frame, clip));
  }
  weights.emplace_back();
  for (const FrameDecision& one : verdicts->last()) weights.back().push_back(one.full_weight);
  const double worst = clip_errors.AddFrame(full, *side->evaluator), rms = clip_errors.frame_rms();
  const bool accepted = std::any_of(weights.back().begin(), weights.back().end(),
                                    [](double full_weight) { return full_weight < 1; });
  result.promise.Add(clip, frame, decision.hit(), accepted, result.light ? rms : worst);
  result.per_frame.push_back({clip, frame, decision, rms, worst, 0, 0});
  if (worst > result.error_max)
    result.error_max = worst, result.worst_frame = frame, result.worst_clip = clip;
}

// What makes the frames of a clip say little.
void Contender::NoteClip(const std::string& clip, bool still) {
  constexpr double kMotion = 1e-6;  // of the diagonal: rounding
  if (!still && side->times.ns().size() > 1 && clip_errors.motion_rms() <= kMotion * clip_errors.diagonal())
    result.notes.push_back(fmt::format("nothing moves in {}: its errors are those of one pose", clip));
  // A clip of several rigs is called "a:wave + b:wave"
  for (std::size_t begin = 0; begin < clip.size();) {
    const std::size_t end = std::min(clip.find(" + ", begin), clip.size());
    const std::string part = clip.substr(begin, end - begin);
    begin = end + 3;
    for (const AppliedSubspace& one : applied) {
      const TrainingRecord record = ParseTraining(one.subspace->training);
      const std::string inner = MakeTarget(open->rig, one.entry).within.Inner(part);
      const auto learnt = std::ranges::find(
          record.learnt, inner, [](const auto& clip) -> const std::string& { return clip.first; });
      if (std::ranges::find(record.clips, inner) != record.clips.end()) {
        result.notes.push_back(
            fmt::format("{} was trained on: its errors say nothing about new frames", part));
      } else if (learnt != record.learnt.end()) {
        result.notes.push_back(fmt::format("{} frames of {} were learnt: the clip says little about new ones",
                                           learnt->second.size(), part));
      } else {
        continue;
      }
      break;
    }
  }
}

}  // namespace kpsa::engine
