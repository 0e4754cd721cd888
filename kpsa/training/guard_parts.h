// Which patches a guard speaks of: those whose points, or whose cues, need what it watches. Elsewhere a pose
// beyond its range is as good as any. Internal to training.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kpsa/subspace.h"
#include "kpsa/training/trainer.h"

namespace kpsa::engine {

// By guard, the first `guards` of the signals: a bit by patch of the subspace (TrainedRange::patches), by
// what the compiler keeps for the points of each patch and for all that its tiles measure, under the controls
// and under each clip. What it keeps for none of them, or for more than a quarter, is of all patches.
// signals: all that cues are named by. The subspace has patches, and describes its cues.
Result<std::vector<std::uint64_t>> FindGuardedPatches(const TrainingRig& rig, Compiler* compiler,
                                                      const std::vector<TrainingClip>& clips,
                                                      std::span<const Signal> signals, std::size_t guards,
                                                      const Subspace& subspace);

}  // namespace kpsa::engine
