// How well scores tell the poses beyond the tolerance from all others.
#pragma once

#include <span>

#include "kpsa/training/score_choice.h"
#include "kpsa/training_record.h"

namespace kpsa::engine {

struct ScoredPose {
  double score = 0;
  bool beyond = false;
};
// The area under the ROC curve: of all pairs of a pose beyond and one within, the share in which the one beyond has the higher
// score; equal scores count half. 1: perfect, .5: as a coin would. NaN where there are no such pairs.
double AreaUnderRoc(std::span<const ScoredPose> poses);

// Of both parts of the score. An error that is not finite is beyond.
TrainingRecord::Separation SeparationOf(std::span<const ScoreJudge> judges, double tolerance);

}  // namespace kpsa::engine
