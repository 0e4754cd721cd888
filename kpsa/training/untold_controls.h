// Which controls a subspace gets wrong unnoticed: calibration promises a rate over poses of many controls, among which one
// may fail whenever it is moved. Internal to training.
#pragma once

#include <vector>

#include "kpsa/training/cue_values.h"
#include "kpsa/training/training_setup.h"

namespace kpsa::engine {

// Of the controls that no clip moves (HeldControls) those with which, each held far out at one of its ends over the clips,
// a sixth of the poses or more is accepted and beyond the tolerance. cues: the subspace's own; it has its ranges and its
// calibration.
Result<std::vector<std::size_t>> UntoldControls(TrainingSetup* setup, const CueSet& cues,
                                                const Subspace& subspace);

}  // namespace kpsa::engine
