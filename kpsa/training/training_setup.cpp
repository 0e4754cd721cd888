#include "kpsa/training/training_setup.h"

#include <algorithm>
#include <utility>

#include "kpsa/space_frame.h"
#include "kpsa/training/calibrate_subspace.h"
#include "kpsa/training/tilts.h"
#include "kpsa/training/training_signals.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kCueProducts = 160;  // cues that are products of others

}  // namespace

TrainingSetup::TrainingSetup(const TrainingRig& of, const std::vector<TrainingClip>& all_clips,
                             const TrainOptions& train_options)
    : rig(WithTilts(of)),
      drawn(of.controls),
      clips(all_clips),
      trained_clips(all_clips.begin(), std::ranges::find_if(all_clips,
                                                            [&](const TrainingClip& clip) {
                                                              return train_options.by_tile_as_before &&
                                                                     clip.learnt;
                                                            })),
      options(train_options),
      limit(train_options.seconds) {}

Status TrainingSetup::Prepare() {
  KPSA_RETURN_IF_ERROR(rig.set_clip(std::nullopt));
  Result<std::vector<Index>> points = PointTotals(rig, &compiler);
  if (!points.ok()) return points.status();
  totals = std::move(*points);
  std::vector<CandidateStage> candidates;
  if (of_map()) {  // the paper's key points are output points
    Result<CuePlaces> cheapest = FindCuePlaces(rig, &compiler, totals, options.max_light_candidates);
    if (!cheapest.ok()) return cheapest.status();
    candidates = std::move(cheapest->stages);
    places = std::move(cheapest->places);
    of_tiles = std::move(cheapest->of_tiles);
    full_cost = cheapest->full_cost;
  }

  const bool measures = !of_light() && of_map();
  Result<TrainingSignals> found =
      FindTrainingSignals(rig, &compiler, clips, measures && !options.without.relative_matrices);
  if (!found.ok()) return found.status();
  guards = std::move(found->watched);
  for (const PlugRef& space : rig.target.space) {
    const Result<Value> rest = compiler.Rest(*rig.graph, space);
    if (!rest.ok()) return rest.status();
    inverse_rest_stretch = InverseRestStretch(rest->get<Matrix4>());
  }
  KPSA_RETURN_IF_ERROR(
      LeaveOutCarried(rig, &compiler, clips, inverse_rest_stretch, options.tolerance, &found->relative));
  std::vector<Signal> signals = guards;
  signals.insert(signals.end(), found->relative.begin(), found->relative.end());
  recorder = std::make_unique<PoseRecorder>(rig, &compiler, std::move(candidates), std::move(signals),
                                            inverse_rest_stretch, options.tolerance);
  if (!rig.some.empty()) {
    std::vector<PointSet> some;
    for (std::size_t m = 0; m < totals.size(); ++m) some.push_back(PointSet::Of(rig.some[m], totals[m]));
    recorder->Only(std::move(some));
    recorder->KeepOrigins();
  }
  const bool products =
      measures && !options.without.cue_products && rig.stepped.empty();  // tiles have their own
  Result<PoseLayout> found_layout = recorder->Layout(products ? kCueProducts : 0);
  if (!found_layout.ok()) return found_layout.status();
  layout = *found_layout;
  sampler = std::make_shared<TrainingSampler>(rig, drawn, clips, options, recorder.get(), layout);
  trained_sampler = sampler;
  if (options.by_tile_as_before)
    trained_sampler =
        std::make_shared<TrainingSampler>(rig, drawn, trained_clips, options, recorder.get(), layout);
  return Status();
}

Status TrainingSetup::Say(const char* what, double share) const { return SayStage(options, what, share); }

std::vector<SubspaceOutput> TrainingSetup::Outputs() const {
  std::vector<SubspaceOutput> outputs;
  for (std::size_t m = 0; m < rig.target.meshes.size(); ++m) {
    const AccelerationTarget::MeshPoints& mesh = rig.target.meshes[m];
    const LastStep* const step = rig.step(m);
    outputs.push_back({mesh.name, step == nullptr ? rig.rows(m, totals[m]) : totals[m],
                       of_light() ? "" : mesh.stages.back().name, step == nullptr ? 0 : step->inner_points(),
                       rig.stepped.empty() ? SteppedPoints() : rig.stepped[m]});
  }
  return outputs;
}

std::optional<std::pair<std::size_t, Index>> TrainingSetup::PointThatComesOut(std::size_t row) const {
  for (std::size_t m = 0; m < totals.size(); ++m) {
    const std::size_t rows = (rig.rows(m, totals[m]) + kTilePoints - 1) / kTilePoints * kTilePoints;
    if (row >= rows) {
      row -= rows;
      continue;
    }
    if (rig.stepped.empty() || rig.stepped[m].empty()) return std::pair(m, static_cast<Index>(row));
    const auto [begin, end] = rig.stepped[m].PointsOf(row / kTilePoints, totals[m]);
    const auto point = static_cast<Index>(begin + row % kTilePoints);
    if (point >= end || rig.stepped[m].Has(point)) return std::nullopt;
    return std::pair(m, point);
  }
  return std::nullopt;
}

double TrainingSetup::CostOfSteps() const {
  double ns = 0;
  for (std::size_t m = 0; m < rig.target.meshes.size(); ++m)
    ns += rig.step(m) == nullptr ? 0 : static_cast<double>(rig.step(m)->cost_ns());
  return ns;
}

Result<double> TrainingSetup::CostOfPoints(std::span<const CueRef> cues) {
  return kpsa::engine::CostOfPoints(rig, &compiler, totals, recorder->candidates(), cues);
}

}  // namespace kpsa::engine
