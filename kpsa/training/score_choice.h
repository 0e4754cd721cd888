// Which score tells poses beyond the tolerance best: SoftCache's own, which knows how unlike the trained
// poses a measurement is, or the doubt of the tiles, which knows how far the shape bends, or
// both.
#pragma once

#include <algorithm>
#include <span>
#include <vector>

#include "kpsa/training/pose_judge.h"

namespace kpsa::engine {

// A pose that was neither trained on nor is calibrated with.
struct ScoreJudge {
  JudgedPose pose;
  double guard = 0;                           // as CalibrationPair's
  int kind = 0;                               // PoseKind
  std::vector<float> guards_of_patches = {};  // what guards ask for of single patches; empty: nothing
};
// Where no patch misses by itself.
inline ScoreJudge WithGuardsOfAll(ScoreJudge judge) {
  for (const float asked : judge.guards_of_patches)
    judge.guard = std::max(judge.guard, static_cast<double>(asked));
  judge.guards_of_patches.clear();
  return judge;
}
inline ScoreJudge WithoutPatches(ScoreJudge judge) {
  judge = WithGuardsOfAll(std::move(judge));
  judge.pose.patches.clear();
  return judge;
}
// As patches miss: guards speak of all points unless these miss by themselves.
void JudgeBy(const PatchLayout& patches, std::vector<ScoreJudge>* judges);

// What a pose costs of a full evaluation: nothing for a hit, 1 for a miss, or for a blend of all points; what
// its patches cost, where these miss by themselves.
double ShareOfFull(const ScoreJudge& judge, const ScoreMix& mix, const SoftCacheThreshold& threshold,
                   const PatchLayout& patches);

// The mix under which a frame is expected to cost least: that of the score, and of the poses that miss,
// all kinds alike, at the tolerance and some around it. Costs of both parts are in full evaluations. Without
// doubts: SoftCache's own.
struct ScoreCosts {
  double measured = 0, doubt = 0;
};
// The doubt alone, its 99 % quantile the unit: where there is nothing else.
ScoreMix DoubtAlone(std::span<const ScoreJudge> judges);
ScoreMix ChooseScore(std::span<const ScoreJudge> judges, double tolerance, double violation_rate,
                     double blend_start, const ScoreCosts& costs);

}  // namespace kpsa::engine
