#include "kpsa/cue_places.h"

#include <algorithm>
#include <map>

#include "kpsa/mode_choice.h"

namespace kpsa {
namespace {

constexpr std::size_t kProbePoints = 20;  // of a stage, to see what cues there would drag in
constexpr double kMaxPointsPerCue = 1.5;  // points of a step that a local cue may cost
constexpr double kSaving = 0.01;          // of the full cost, from each place to the next
// Candidates of a place at earlier stages, over all meshes: neighbours tell much the same, and modes are
// found for the outputs, not for many more points of stages.
constexpr std::size_t kStagePoints = 500;

// What the compiler keeps for some points.
struct Kept {
  double cost = 0;   // ns of the steps with points
  Index points = 0;  // most of a step over `total` points
};
Result<Kept> KeptFor(const TrainingRig& rig, Compiler* compiler, RequestedOutput output, Index total) {
  Request request;
  request.outputs.push_back(std::move(output));
  request.varying = {rig.time};
  for (const ControlRange& control : rig.controls) {
    if (!control.by_clip) request.varying.push_back(control.plug);
  }
  const Result<std::shared_ptr<const Plan>> plan = compiler->Compile(*rig.graph, request);
  if (!plan.ok()) return plan.status();
  Kept kept;
  for (const Plan::StepInfo& info : (*plan)->infos()) {
    if (info.points_total == 0) continue;
    kept.cost += static_cast<double>(info.cost_ns);
    if (info.points_total == total) kept.points = std::max(kept.points, info.points);
  }
  return kept;
}

// A stage of a mesh, and what a few points of it cost.
struct PricedStage {
  std::size_t stage = 0;
  double cost = 0;
};

// Stages of a mesh, the latest local one first, each cheaper than the one before by at least `saving`.
Result<std::vector<PricedStage>> PriceStages(const TrainingRig& rig, Compiler* compiler,
                                             const AccelerationTarget::MeshPoints& mesh, Index total,
                                             double saving) {
  std::vector<PricedStage> priced;
  const std::vector<Index> probe = EvenSpread(total, kProbePoints);
  const auto local = static_cast<Index>(kMaxPointsPerCue * static_cast<double>(probe.size()));
  for (std::size_t stage = mesh.stages.size(); stage-- > 0;) {
    const Result<Kept> kept =
        KeptFor(rig, compiler, {mesh.stages[stage].points, PointSet::Of(probe, total)}, total);
    if (!kept.ok()) return kept.status();
    if (priced.empty() ? kept->points <= local || stage == 0 : kept->cost <= priced.back().cost - saving)
      priced.push_back({stage, kept->cost});
    if (!priced.empty() && priced.back().cost < saving) break;
  }
  return priced;
}

}  // namespace

Result<CuePlaces> FindCuePlaces(const TrainingRig& rig, Compiler* compiler, std::span<const Index> totals) {
  const auto& meshes = rig.target.meshes;
  CuePlaces result;
  std::size_t all = 0, count = 0;
  for (std::size_t m = 0; m < meshes.size(); ++m) {
    const Result<Kept> full = KeptFor(rig, compiler, {meshes[m].stages.back().points, {}}, totals[m]);
    if (!full.ok()) return full.status();
    result.full_cost += full->cost;
    all += totals[m];
  }
  std::vector<std::vector<PricedStage>> stages;  // by mesh
  for (std::size_t m = 0; m < meshes.size(); ++m) {
    Result<std::vector<PricedStage>> priced =
        PriceStages(rig, compiler, meshes[m], totals[m], kSaving * result.full_cost);
    if (!priced.ok()) return priced.status();
    count = std::max(count, priced->size());
    stages.push_back(std::move(*priced));
  }
  std::map<std::pair<std::size_t, std::size_t>, Index> recorded;  // mesh and stage: its first stage point
  Index next = 0;
  for (std::size_t p = 0; p < count; ++p) {
    CuePlace& place = result.places.emplace_back();
    Index output = 0;
    for (std::size_t m = 0; m < meshes.size(); output += totals[m++]) {
      const PricedStage& stage = stages[m][std::min(p, stages[m].size() - 1)];
      place.cost += stage.cost;
      if (stage.stage + 1 == meshes[m].stages.size()) {
        for (Index i = 0; i < totals[m]; ++i) place.points.push_back({CueKind::kOutput, output + i});
        continue;
      }
      const std::vector<Index> points =
          EvenSpread(totals[m], std::max<std::size_t>(1, kStagePoints * totals[m] / all));
      const auto [at, first] = recorded.emplace(std::pair(m, stage.stage), next);
      if (first) {
        result.stages.push_back({m, stage.stage, points});
        next += static_cast<Index>(points.size());
      }
      for (std::size_t i = 0; i < points.size(); ++i)
        place.points.push_back({CueKind::kStage, at->second + static_cast<Index>(i)});
    }
  }
  return result;
}

}  // namespace kpsa
