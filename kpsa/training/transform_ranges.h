// Where the entries of a transform's matrix end that several controls turn at once: rotateX and rotateZ at their ends give
// values that neither alone has, and samples seldom have both. Internal to training.
#pragma once

#include <span>

#include "kpsa/training/pose_recorder.h"
#include "kpsa/training/trained_ranges.h"

namespace kpsa::engine {

// Widens the ranges of the entries of local matrices by poses that have the controls of their transform, tilts included, all
// over their ranges, corners among them. No other entry is widened: nobody bends all joints at once. No clip plays after.
Status WidenByTransforms(const TrainingRig& rig, std::span<const Signal> guards, const PoseLayout& layout,
                         PoseRecorder* recorder, RangeFinder* ranges);

}  // namespace kpsa::engine
