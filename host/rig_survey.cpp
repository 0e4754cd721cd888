#include "host/rig_survey.h"

#include <cmath>

#include "graph/evaluator.h"
#include "host/clip_record.h"
#include "host/rig_frames.h"
#include "host/rig_training.h"

namespace kpsa::engine {
namespace {

Result<std::vector<float>> RestVertices(const Rig& rig) {
  Compiler compiler;
  const auto plan = CompileFor(rig, &compiler, ShownPoints(rig));
  if (!plan.ok()) return plan.status();
  Evaluator evaluator(*plan);
  const Status evaluated = evaluator.Evaluate();
  if (!evaluated.ok()) return FailedAt(rig, 0, evaluated);
  std::vector<float> vertices(3 * ShownVertices(rig));
  ReadVertices(rig, evaluator, vertices);
  for (const float x : vertices) {
    if (!std::isfinite(x)) return Status::Evaluation("at rest: a point is not finite").At({rig.path});
  }
  if (vertices.empty()) return Status::Invalid("there is no mesh to show").At({rig.path});
  return vertices;
}

Request VaryingPoints(const Rig& rig) {
  Request request = ShownPoints(rig);
  request.varying = VaryingPlugs(rig);
  return request;
}

// The nodes of the clip's rig, with subspaces or without.
Status Outline(const RigOpener& opener, const std::string& clip,
               const std::optional<AccelerationChoice>& choice, RigSurvey* survey) {
  RigChange change;
  if (!clip.empty()) change.clip = clip;
  const Result<std::unique_ptr<OpenRig>> open = opener.open(change);
  if (!open.ok()) return open.status();
  Rig& rig = (*open)->rig;
  Compiler compiler;
  const auto full = CompileFor(rig, &compiler, VaryingPoints(rig));
  if (!full.ok()) return full.status();
  if (!choice.has_value()) {
    survey->nodes = OutlineNodes(*rig.graph, **full, nullptr, {});
    return Status();
  }
  const Result<std::vector<AppliedSubspace>> applied = ApplyAcceleration(&rig, &compiler, *choice);
  if (!applied.ok()) return applied.status();
  const auto accelerated = CompileFor(rig, &compiler, VaryingPoints(rig));
  if (!accelerated.ok()) return accelerated.status();
  survey->nodes = OutlineNodes(*rig.graph, **full, accelerated->get(), *applied);
  return Status();
}

}  // namespace

Result<RigSurvey> SurveyRig(const RigOpener& opener, const RigOpener& rest, const std::string& clip,
                            const std::optional<AccelerationChoice>& choice, const Watch& watch) {
  const Result<std::unique_ptr<OpenRig>> open = rest.open({});
  if (!open.ok()) return open.status();
  Rig& rig = (*open)->rig;
  RigSurvey survey;
  Result<std::vector<float>> vertices = RestVertices(rig);
  if (!vertices.ok()) return vertices.status();
  survey.rest = std::move(*vertices);
  if (rig.controls.size() <= kMostReaches) {
    Result<std::vector<ControlReach>> reaches = ReachOfControls(rig, watch);
    if (!reaches.ok()) return reaches.status();
    survey.reaches = std::move(*reaches);
  }
  KPSA_RETURN_IF_ERROR(Outline(opener, clip, choice, &survey));
  if (!choice.has_value()) return survey;
  Compiler compiler;
  Result<std::vector<AppliedSubspace>> applied = ApplyAcceleration(&rig, &compiler, *choice);
  if (!applied.ok()) return applied.status();
  Result<std::vector<CueMark>> cues = MarkCues(rig, *applied, survey.rest);
  if (!cues.ok()) return cues.status();
  survey.cues = std::move(*cues);
  survey.applied = std::move(*applied);
  return survey;
}

}  // namespace kpsa::engine
