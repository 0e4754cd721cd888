// The signals that a rig's poses are known by, whichever clip plays: guards watch them, and cues may be
// chosen from them. Internal to training.
#pragma once

#include <vector>

#include "kpsa/signals.h"
#include "kpsa/training/trainer.h"

namespace kpsa::engine {

struct TrainingSignals {
  std::vector<Signal> watched;   // by name
  std::vector<Signal> relative;  // by name: matrices relative to the space, which only measure
};
// Under the controls, and under each clip. with_relative: whether those are looked for. No clip plays after.
Result<TrainingSignals> FindTrainingSignals(const TrainingRig& rig, Compiler* compiler,
                                            const std::vector<TrainingClip>& clips, bool with_relative);

}  // namespace kpsa::engine
