#include "kpsa/training/score_choice.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "kpsa/training/quantile.h"

namespace kpsa::engine {
namespace {

constexpr double kEqualAt = 0.99;  // of the judges: where the two parts are made equal
constexpr double kRatios[] = {0.125, 0.25, 0.5, 1, 2, 4, 8};  // of the doubt to SoftCache's own
constexpr double kAround[] = {0.5, 0.7, 1, 1.4};  // tolerances: where all poses hit, finer ones tell
// In hits, that another mix has to bring: chance brings some. SoftCache's own is known to hold on clips.
constexpr double kGain = 0.01, kGainOverOwn = 0.05;

}  // namespace

ScoreMix DoubtAlone(std::span<const ScoreJudge> judges) {
  std::vector<double> doubts;
  for (const ScoreJudge& judge : judges) doubts.push_back(judge.pose.doubt);
  const double doubt = doubts.empty() ? 0 : Quantile(doubts, kEqualAt);
  return {0, doubt > 0 && std::isfinite(1 / doubt) ? 1 / doubt : 1};
}

void JudgeBy(const PatchLayout& patches, std::vector<ScoreJudge>* judges) {
  if (patches.tiles > 0 && !patches.blends_only) return;
  std::ranges::transform(*judges, judges->begin(), patches.tiles == 0 ? WithoutPatches : WithGuardsOfAll);
}

double ShareOfFull(const ScoreJudge& judge, const ScoreMix& mix, const SoftCacheThreshold& threshold,
                   const PatchLayout& patches) {
  const JudgedPose& pose = judge.pose;
  const double score = mix.Of(pose.measured, pose.doubt);
  if (judge.guard >= 1 || std::isnan(score) || !(threshold.tau > 0)) return 1;
  const std::vector<float>& guards = judge.guards_of_patches;
  if (judge.guard == 0 && guards.empty() && FullWeight(score, threshold) == 0) return 0;
  if (pose.patches.empty()) return 1;
  PatchChoice choice;
  for (std::size_t p = 0; p < pose.patches.size(); ++p) {
    choice.weights[p] = static_cast<float>(FullWeight(
        patches.blends_only ? PatchScoreInBlend(mix.doubt * pose.patches[p].score, score, threshold)
                            : mix.Of(pose.measured, PatchDoubt(patches, pose.patches[p].score, pose.doubt)),
        threshold));
    if (!guards.empty()) choice.weights[p] = std::max(choice.weights[p], guards[p]);
  }
  ChooseRegions(patches, judge.guard, &choice);
  return choice.cost;
}

ScoreMix ChooseScore(std::span<const ScoreJudge> judges, double tolerance, double violation_rate,
                     double blend_start, const ScoreCosts& costs) {
  std::vector<double> measured, doubts;
  for (const ScoreJudge& judge : judges) {
    measured.push_back(judge.pose.measured);
    doubts.push_back(judge.pose.doubt);
  }
  if (judges.empty()) return {};
  const double unit = Quantile(measured, kEqualAt), doubt = Quantile(doubts, kEqualAt);
  if (!(unit > 0) || !(doubt > 0) || !std::isfinite(unit) || !std::isfinite(doubt)) return {};
  // What is spared of a full evaluation, all kinds alike, less what the score costs
  const auto worth = [&](const ScoreMix& mix) {
    double sum = 0;
    for (const double around : kAround) {
      std::vector<CalibrationPair> pairs;
      for (const ScoreJudge& judge : judges)
        pairs.push_back(PairOf(judge.pose, mix, {}, judge.guard, judge.kind));
      const Calibration found = Calibrate(pairs, around * tolerance, violation_rate, blend_start);
      std::map<int, double> weights;
      for (const Calibration::Kind& kind : found.kinds)
        weights[kind.kind] = 1 / static_cast<double>(kind.poses * found.kinds.size());
      for (const ScoreJudge& judge : judges)
        sum += weights[judge.kind] * (1 - ShareOfFull(judge, mix, found.threshold, {}));
    }
    return sum / static_cast<double>(std::size(kAround)) - (mix.measured > 0 ? costs.measured : 0) -
           (mix.doubt > 0 ? costs.doubt : 0);
  };
  ScoreMix best;
  double most = worth(best);
  const auto try_mix = [&](const ScoreMix& mix) {
    const double found = worth(mix);
    if (found >= most + (best == ScoreMix() ? kGainOverOwn : kGain)) best = mix, most = found;
  };
  try_mix({0, 1 / doubt});
  for (const double ratio : kRatios) try_mix({1, ratio * unit / doubt});
  return best;
}

}  // namespace kpsa::engine
