// New poses of a rig that are like those that training calibrates with: it draws them in the same way.
#pragma once

#include <string>
#include <vector>

#include "kpsa/training/trainer.h"
#include "rig/build/rig_builder.h"

namespace kpsa::engine {

// `groups`: mix controls that act together as well, as training on samples does; costs two poses a control.
Result<std::vector<SampledPose>> DrawNewPoses(const TrainingRig& training, Compiler* compiler,
                                              const std::vector<TrainingClip>& clips, bool groups,
                                              std::size_t count, std::uint64_t seed);

// When in its clip a pose is; 0 without one.
double TimeOf(const SampledPose& pose, const std::vector<TrainingClip>& clips);
// "wave at 0.53 s, jaw.rotateX -22, smile 0.9": the clip, and the three controls that are farthest from rest.
std::string PoseText(const Rig& rig, const TrainingRig& training, const std::vector<TrainingClip>& clips,
                     const SampledPose& pose);

}  // namespace kpsa::engine
