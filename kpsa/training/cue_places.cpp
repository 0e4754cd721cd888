#include "kpsa/training/cue_places.h"

#include <algorithm>
#include <map>
#include <numeric>

#include "graph/plan_report.h"
#include "kpsa/tiles.h"
#include "kpsa/training/mode_choice.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kProbePoints = 20;  // of a stage, to see what cues there would drag in
constexpr double kMaxPointsPerCue = 1.5;  // points of a step that a local cue may cost
constexpr double kSaving = 0.01;          // of the full cost, from each place to the next
// Candidates of a place at earlier stages, over all meshes: neighbours tell much the same, and modes are
// found for the outputs, not for many more points of stages.
constexpr std::size_t kStagePoints = 500;
constexpr std::size_t kMinStagePoints = 50;                // of a mesh, however many there are beside it
constexpr double kSeldomRead = 1.5;                        // what points cost whose data are not in the cache
constexpr std::size_t kOfTiles = 3, kMostOfTiles = 12000;  // of the first place: every third point

// What the compiler keeps for some points.
struct Kept {
  double cost = 0;    // ns of the steps with points
  double spread = 0;  // likewise, of all steps, where a deformer that spreads works on all that it reads
  Index points = 0;   // most of a step over `total` points
};
// The mean of what a step reads and what it writes; at least 1.
double ReadPoints(const Plan& plan, Index step) {
  const Plan::StepInfo& info = plan.infos()[step];
  Index read = info.points;
  for (const Index producer : Producers(plan, step)) {
    if (producer >= plan.infos().size()) continue;
    const Plan::StepInfo& of = plan.infos()[producer];
    if (of.points_total == info.points_total) read = std::max(read, of.points);
  }
  return info.points == 0 ? 1 : (static_cast<double>(read) + info.points) / 2;
}
Result<Kept> KeptFor(const TrainingRig& rig, Compiler* compiler, std::vector<RequestedOutput> outputs,
                     Index total) {
  Request request;
  request.outputs = std::move(outputs);
  request.varying = {rig.time};
  for (const ControlRange& control : rig.controls) request.varying.push_back(control.plug);
  const Result<std::shared_ptr<const Plan>> plan = compiler->Compile(*rig.graph, request);
  if (!plan.ok()) return plan.status();
  Kept kept;
  for (Index s = 0; s < (*plan)->infos().size(); ++s) {
    const Plan::StepInfo& info = (*plan)->infos()[s];
    const auto cost = static_cast<double>(info.cost_ns);
    kept.spread += cost * ReadPoints(**plan, s) / std::max<Index>(info.points, 1);
    if (info.points_total == 0) continue;
    kept.cost += cost;
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
Result<std::vector<PricedStage>> PriceStages(const TrainingRig& rig, Compiler* compiler, std::size_t m,
                                             Index total, double saving) {
  const AccelerationTarget::MeshPoints& mesh = rig.target.meshes[m];
  // What comes out of a last step is not among the poses
  const std::size_t stages = mesh.stages.size() - (rig.step(m) == nullptr ? 0 : 1);
  if (rig.target.colors && mesh.stages.size() > 1)
    return std::vector<PricedStage>(1);  // that is what it is for
  std::vector<PricedStage> priced;
  const std::vector<Index> probe = EvenSpread(total, kProbePoints);
  const auto local = static_cast<Index>(kMaxPointsPerCue * static_cast<double>(probe.size()));
  for (std::size_t stage = stages; stage-- > 0;) {
    const Result<Kept> kept =
        KeptFor(rig, compiler, {{mesh.stages[stage].points, PointSet::Of(probe, total)}}, total);
    if (!kept.ok()) return kept.status();
    if (priced.empty() ? kept->points <= local || stage == 0 : kept->cost <= priced.back().cost - saving)
      priced.push_back({stage, kept->cost});
    if (!priced.empty() && priced.back().cost < saving) break;
  }
  return priced;
}

// How many candidates a mesh has at an earlier stage, of so many over all meshes.
std::size_t StagePoints(Index total, std::size_t of_all, std::size_t most) {
  if (most >= of_all) return total;
  return std::min<std::size_t>(total, std::max(kMinStagePoints, most * total / of_all));
}

}  // namespace

Result<std::vector<Index>> PointTotals(const TrainingRig& rig, Compiler* compiler) {
  std::vector<Index> totals;
  for (const auto& mesh : rig.target.meshes) {
    Request request;
    request.outputs.push_back({mesh.stages.back().points, {}});
    const Result<std::shared_ptr<const Plan>> plan = compiler->Compile(*rig.graph, request);
    if (!plan.ok()) return plan.status();
    totals.push_back((*plan)->outputs()[0].points.total());
  }
  return totals;
}

Result<CuePlaces> FindCuePlaces(const TrainingRig& rig, Compiler* compiler, std::span<const Index> totals,
                                std::size_t max_light_points) {
  const auto& meshes = rig.target.meshes;
  CuePlaces result;
  std::vector<RequestedOutput> outputs;
  for (const auto& mesh : meshes) outputs.push_back({mesh.stages.back().points, {}});
  const Result<Kept> full = KeptFor(rig, compiler, std::move(outputs), 0);
  if (!full.ok()) return full.status();
  result.full_cost = full->cost;
  const std::size_t all = std::accumulate(totals.begin(), totals.end(), std::size_t{0});
  std::vector<std::vector<PricedStage>> stages;  // by mesh
  std::size_t count = 0;
  for (std::size_t m = 0; m < meshes.size(); ++m) {
    Result<std::vector<PricedStage>> priced =
        PriceStages(rig, compiler, m, totals[m], kSaving * result.full_cost);
    if (!priced.ok()) return priced.status();
    count = std::max(count, priced->size());
    stages.push_back(std::move(*priced));
  }
  std::map<std::pair<std::size_t, std::size_t>, Index> recorded;  // mesh and stage: its first stage point
  std::map<Index, std::size_t> recorded_points;                   // of each, by its first
  Index next = 0;
  for (std::size_t p = 0; p < count; ++p) {
    CuePlace& place = result.places.emplace_back();
    Index output = 0;
    for (std::size_t m = 0; m < meshes.size(); output += rig.rows(m, totals[m]), ++m) {
      const std::size_t stage = stages[m][std::min(p, stages[m].size() - 1)].stage;
      if (stage + 1 == meshes[m].stages.size()) {
        const Index rows = rig.rows(m, totals[m]);
        for (Index i = 0; i < rows; ++i) place.push_back({CueKind::kOutput, output + i});
        if (p == 0) result.of_tiles.insert(result.of_tiles.end(), place.end() - rows, place.end());
        continue;
      }
      const auto [at, first] = recorded.emplace(std::pair(m, stage), next);
      const bool colors = rig.target.colors;
      const std::size_t some = StagePoints(totals[m], all, colors ? max_light_points : kStagePoints),
                        many = std::min<std::size_t>(totals[m] / kOfTiles, kMostOfTiles * totals[m] / all);
      if (first) {
        const std::vector<Index> points = colors
                                              ? GoldenSpread(totals[m], some)
                                              : EvenSpread(totals[m], p == 0 ? std::max(some, many) : some);
        recorded_points[at->second] = points.size();
        result.stages.push_back({m, stage, points});
        next += static_cast<Index>(points.size());
      }
      const std::size_t count = recorded_points[at->second];
      for (const Index i : EvenSpread(count, std::min(count, some)))
        place.push_back({CueKind::kStage, at->second + i});
      if (p > 0) continue;
      for (Index i = 0; i < count; ++i) result.of_tiles.push_back({CueKind::kStage, at->second + i});
    }
  }
  return result;
}

Result<double> CostOfPoints(const TrainingRig& rig, Compiler* compiler, std::span<const Index> totals,
                            std::span<const CandidateStage> stages, std::span<const CueRef> cues) {
  const auto& meshes = rig.target.meshes;
  std::vector<RequestedOutput> outputs;
  // The cues of a kind whose indices are [begin, begin + count), as points of the mesh
  const auto request = [&](CueKind kind, Index begin, Index count, std::size_t mesh, std::size_t stage,
                           const std::vector<Index>* points) {
    std::vector<Index> wanted;
    for (const CueRef& cue : cues) {
      if (cue.kind != kind || cue.index < begin || cue.index >= begin + count) continue;
      wanted.push_back(points == nullptr ? rig.PointOf(mesh, cue.index - begin)
                                         : (*points)[cue.index - begin]);
    }
    if (wanted.empty()) return;
    std::sort(wanted.begin(), wanted.end());
    outputs.push_back({meshes[mesh].stages[stage].points, PointSet::Of(wanted, totals[mesh])});
  };
  Index begin = 0;
  for (std::size_t m = 0; m < meshes.size(); begin += rig.rows(m, totals[m]), ++m)
    // Inner points are not measured
    request(CueKind::kOutput, begin, rig.step(m) == nullptr ? rig.rows(m, totals[m]) : 0, m,
            meshes[m].stages.size() - 1, nullptr);
  begin = 0;
  for (const CandidateStage& stage : stages) {
    const auto count = static_cast<Index>(stage.points.size());
    request(CueKind::kStage, begin, count, stage.mesh, stage.stage, &stage.points);
    begin += count;
  }
  if (outputs.empty()) return 0.0;
  const Result<Kept> kept = KeptFor(rig, compiler, std::move(outputs), 0);
  if (!kept.ok()) return kept.status();
  return kept->cost;
}

Result<PatchLayout> PricePatches(const TrainingRig& rig, Compiler* compiler, std::span<const Index> totals) {
  std::vector<std::size_t> tiles;
  std::vector<PlacedOutput> placed;
  std::vector<RequestedOutput> outputs;
  for (std::size_t m = 0; m < totals.size(); ++m) {
    const std::span<const Index> starts =
        rig.stepped.empty() ? std::span<const Index>() : std::span(rig.stepped[m].starts);
    if (rig.step(m) != nullptr && starts.empty()) return PatchLayout();  // tiles are of other points
    const PlugRef plug = rig.target.meshes[m].stages.back().points;
    Result<std::vector<Double3>> rest = RestPoints(*rig.graph, compiler, plug);
    if (!rest.ok()) return rest.status();
    tiles.push_back(starts.empty() ? (totals[m] + kTilePoints - 1) / kTilePoints : starts.size());
    placed.push_back({std::move(*rest), starts});
    outputs.push_back({plug, {}});
  }
  PatchLayout layout = MakePatchLayout(tiles);
  if (layout.tiles == 0) return layout;
  const Result<Kept> full = KeptFor(rig, compiler, std::move(outputs), 0);
  if (!full.ok()) return full.status();
  if (!(full->cost > 0)) return PatchLayout();
  const std::vector<PatchPoints> patches = MakePatches(placed, layout.tiles);
  for (const PatchRegion& region : layout.regions) {
    const PlugRef plug = rig.target.meshes[region.output].stages.back().points;
    const PointSet of = PointSet::Of(PointsOfRegion(region, patches), totals[region.output]);
    const Result<Kept> own = KeptFor(rig, compiler, {{plug, of}}, 0);
    if (!own.ok()) return own.status();
    layout.costs.push_back(kSeldomRead * own->spread / full->spread);
  }
  return layout;
}

}  // namespace kpsa::engine
