// What a subspace says of a cue: its plug, or the mesh, stage and point. Internal to training.
#pragma once

#include <span>

#include "kpsa/cue_selection.h"
#include "kpsa/pose_recorder.h"
#include "kpsa/subspace.h"

namespace kpsa {

// totals: points of each mesh of the target, whole.
CueDescription DescribeCue(const TrainingRig& rig, const PoseRecorder& recorder,
                           std::span<const Index> totals, CueRef cue);

}  // namespace kpsa
