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

// Of the watched ones those that clips move and no control does, as people write their plugs. No clip plays after.
Result<std::vector<std::string>> MovedByClipsAlone(const TrainingRig& rig, Compiler* compiler,
                                                   const std::vector<TrainingClip>& clips,
                                                   const std::vector<Signal>& watched);

// Takes out the matrices that change where a transform turns that carries the points rigidly (kpsa/training/carried.h): an
// ancestor of the space, or what hangs from one. No point follows them, and no guard watches what turns. No clip plays after.
Status LeaveOutCarried(const TrainingRig& rig, Compiler* compiler, const std::vector<TrainingClip>& clips,
                       const Matrix4& inverse_rest_stretch, double tolerance, std::vector<Signal>* relative);

}  // namespace kpsa::engine
