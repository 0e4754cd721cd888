// What clips move and no control does: known only as these clips do it, it would be wrong, and hit, where another clip parts
// what they move together (two brows that are always alike). It is posed as the controls are. Internal to training.
#pragma once

#include <vector>

#include "kpsa/training/trainer.h"

namespace kpsa::engine {

// The rig with those of TrainingRig::by_clips among its controls that the points depend on. No clip plays after.
Result<TrainingRig> WithClipControls(const TrainingRig& rig, const std::vector<TrainingClip>& clips);

}  // namespace kpsa::engine
