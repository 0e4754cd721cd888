// Misses that are posed, as poses to train on.
#pragma once

#include <vector>

#include "base/status.h"
#include "kpsa/miss.h"
#include "kpsa/training/poses.h"

namespace kpsa::engine {

struct TrainingClip;
struct TrainingRig;

// Posed misses as samples of the controls: each, and what lies between it and the pose without its controls,
// which is as new. Their clips are among `clips`. Errors: a control that the rig lacks.
Result<std::vector<SampledPose>> SamplesOf(const std::vector<Miss>& misses, const TrainingRig& rig,
                                           const std::vector<TrainingClip>& clips);

}  // namespace kpsa::engine
