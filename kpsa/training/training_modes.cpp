#include "kpsa/training/training_modes.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "kpsa/training/mode_choice.h"
#include "kpsa/training/signal_noise.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kStillRows = 12;  // that are measured where nothing moves in the space
constexpr int kMaxLightModes = 120;     // that are looked at; noise is beyond
constexpr int kFewModes = 16;           // where tiles alone say how points move: that say what moves at all

// As many modes as new poses confirm, and noise as new poses have it.
void TruncateModes(const TrainingSetup& setup, const PoseMatrix& judges, TrainingModes* modes) {
  std::vector<CueRef> cues;
  const bool apart = setup.layout.stage_points > 0;  // from the pictures
  for (const Index point : GoldenSpread(apart ? setup.layout.stage_points : setup.layout.points,
                                        std::max<std::size_t>(setup.options.min_points, 100)))
    cues.push_back({apart ? CueKind::kStage : CueKind::kOutput, point});
  for (Index s = 0; s < setup.layout.scalars; ++s) cues.push_back({CueKind::kScalar, s});
  modes->pca = TruncatedPca(modes->pca, ChooseModeCount(modes->pca, cues, modes->noise, judges));
  for (double& residual : modes->pca.row_residual)
    residual = HonestResidual(residual, modes->pca.poses, modes->pca.mode_count());
}

// Rows of the outputs that are points as they come out of the graph.
std::vector<bool> MeasurableRows(const TrainingSetup& setup) {
  std::vector<bool> measurable;
  for (std::size_t m = 0; m < setup.totals.size(); ++m) {
    const std::size_t begin = measurable.size();
    measurable.resize(begin + setup.rig.rows(m, setup.totals[m]), setup.rig.step(m) == nullptr);
  }
  return measurable;
}

Status ChooseCues(double tolerance, const TrainingPoses& poses, const PoseMatrix& judges,
                  TrainingSetup* setup, const TrainingModes& modes, TrainingCues* to) {
  CueChoiceOptions choice;
  choice.rows = modes.still ? std::min<std::size_t>(kStillRows, setup->options.rows) : setup->options.rows;
  choice.may_choose_rows = setup->options.may_have_cues_by_tile && !modes.still && !setup->of_light();
  choice.min_points = modes.still ? 1 : setup->options.min_points;
  choice.tolerance = tolerance;
  choice.by_rms = setup->of_light();
  choice.places = setup->places;
  choice.judges = judges.poses() > 0 && !setup->options.without.miss_costs ? &judges : nullptr;
  choice.judge_kinds = poses.judge_kinds;
  if (!setup->rig.split.empty()) choice.measurable = MeasurableRows(*setup);
  KPSA_RETURN_IF_ERROR(setup->rig.set_clip(std::nullopt));
  Status priced;
  choice.points_cost = [&](std::span<const CueRef> cues) {
    const Result<double> cost = setup->CostOfPoints(cues);
    if (!cost.ok()) priced = cost.status();
    return cost.ok() ? *cost : 0;
  };
  choice.miss_cost = setup->full_cost;
  choice.violation_rate = setup->options.violation_rate;
  if (setup->of_light()) choice.max_outputs = setup->options.max_light_candidates;
  CueChoice chosen =
      setup->options.mode == EstimatorMode::kPaper
          ? CueChoice{ChoosePaperCues(modes.pca, modes.positions, modes.diagonal)}
          : kpsa::engine::ChooseCues(modes.pca, modes.positions, modes.noise, poses.poses, choice);
  KPSA_RETURN_IF_ERROR(std::move(priced));
  if (chosen.cues.empty())
    return Status::Invalid(
        "no cue can be chosen: {} numbers are too few to measure a pose by (a point takes three, and some "
        "are "
        "kept to judge by)",
        choice.rows);
  const double steps = setup->CostOfSteps();
  chosen.cost += steps;
  for (CueChoice::Other& other : chosen.cheaper) other.cost += steps, other.cost_of_hits += steps;
  to->set = MakeCueSet(modes.pca, chosen.cues, modes.noise);
  to->choice = std::move(chosen);
  return Status();
}

}  // namespace

void CentrePoses(const TrainingSetup& setup, TrainingPoses* poses, TrainingModes* modes,
                 TrainingRecord* record) {
  modes->mean = poses->poses.Mean();
  MeanShape shape = MeanShapeOf(setup.layout, modes->mean);
  modes->positions = std::move(shape.positions);
  record->diagonal = modes->diagonal = shape.diagonal;
  poses->poses.Subtract(modes->mean);
  for (PoseMatrix& learnt : poses->learnt) learnt.Subtract(modes->mean);
}

Status FindModes(const TrainingSetup& setup, const TrainingPoses& poses, bool few, TrainingModes* modes,
                 TrainingRecord* record) {
  PcaOptions pca_options;
  pca_options.seed = setup.options.seed;
  pca_options.max_modes = setup.options.mode == EstimatorMode::kPaper
                              ? static_cast<int>(setup.options.key_points / 2)
                              : setup.options.max_modes;
  if (setup.of_light()) pca_options.max_modes = std::min(pca_options.max_modes, kMaxLightModes);
  if (few) {
    pca_options.max_modes = std::min(pca_options.max_modes, kFewModes);
    pca_options.method = PcaOptions::Method::kRandomised;  // for so few without the products of all poses
  }
  Result<Pca> pca = ComputePca(poses.poses, modes->mean, pca_options);
  if (!pca.ok()) return pca.status();
  modes->pca = std::move(*pca);
  modes->still = !setup.of_light() && setup.options.mode == EstimatorMode::kMap &&
                 IsStill(modes->pca, setup.options.tolerance);
  if (modes->still) modes->pca = TruncatedPca(modes->pca, 1);
  modes->noise = NoiseOf(setup.recorder->signals(), poses.poses, modes->mean, modes->diagonal,
                         setup.options.tolerance, setup.of_light());
  record->motion_rms =
      std::sqrt(modes->pca.total_energy / static_cast<double>(poses.poses.poses() * setup.layout.points));
  return Status();
}

Status ChooseTrainingCues(double tolerance, const TrainingPoses& poses, TrainingSetup* setup,
                          TrainingModes* modes, TrainingCues* cues) {
  PoseMatrix centered(setup->layout);
  centered.Append(poses.judges);
  if (poses.judges.poses() > 0) centered.Subtract(modes->pca.mean);
  if (setup->of_light() && poses.judges.poses() > 0) TruncateModes(*setup, centered, modes);
  KPSA_RETURN_IF_ERROR(setup->Say("cues", 0.7));
  return ChooseCues(tolerance, poses, centered, setup, *modes, cues);
}

}  // namespace kpsa::engine
