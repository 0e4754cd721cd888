// Where the entries of a transform's matrix end that several controls turn at once: rotateX and rotateZ at their ends give
// values that neither alone has, and samples seldom have both. Internal to training.
#pragma once

#include <span>
#include <vector>

#include "kpsa/training/pose_recorder.h"
#include "kpsa/training/trained_ranges.h"

namespace kpsa::engine {

// Poses with the controls of every transform at places all over their ranges, corners among them, everything else at rest.
// They are of use transform by transform: nobody bends all joints at once. None without such controls.
std::vector<SampledPose> PlacesOfTransforms(const TrainingRig& rig);

// Widens the ranges of the entries of these transforms' local matrices, and no others, by those poses. No clip plays after.
Status WidenByTransforms(const TrainingRig& rig, std::span<const Signal> guards, const PoseLayout& layout,
                         PoseRecorder* recorder, RangeFinder* ranges);

}  // namespace kpsa::engine
