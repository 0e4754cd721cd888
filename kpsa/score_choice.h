// Which score tells poses beyond the tolerance best: SoftCache's own, which knows how unlike the trained
// poses a measurement is, or the doubt of the tiles, which knows how far the shape bends (KPSA.md 2.13), or
// both.
#pragma once

#include <span>
#include <vector>

#include "kpsa/pose_judge.h"

namespace kpsa {

// A pose that was neither trained on nor is calibrated with.
struct ScoreJudge {
  JudgedPose pose;
  double guard = 0;  // as CalibrationPair's
  int kind = 0;      // PoseKind
};

// Of the mixes under which, at the tolerance and some around it, the most sampled poses hit: the one that
// costs least. Without doubts: SoftCache's own.
ScoreMix ChooseScore(std::span<const ScoreJudge> judges, double tolerance, double violation_rate,
                     double blend_start);

}  // namespace kpsa
