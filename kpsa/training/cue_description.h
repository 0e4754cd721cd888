// What a subspace says of a cue: its plug, or the mesh, stage and point. Internal to training.
#pragma once

#include <span>

#include "kpsa/subspace.h"
#include "kpsa/training/cue_selection.h"
#include "kpsa/training/pose_recorder.h"

namespace kpsa::engine {

// totals: points of each mesh of the target, whole.
CueDescription DescribeCue(const TrainingRig& rig, const PoseRecorder& recorder,
                           std::span<const Index> totals, CueRef cue);

}  // namespace kpsa::engine
