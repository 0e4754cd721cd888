// How far points move a unit of a signal: what a guard may forgive, and how steep it has to be, follows from
// it. Internal to training.
#pragma once

#include <vector>

#include "kpsa/training/trainer.h"

namespace kpsa::engine {

// For every entry of every signal, in their order: metres that the farthest accelerated point moves, in the
// space of the target, a unit of the entry; about the rest pose, where each joint is turned and shifted a
// little and each value raised, everything else at rest. Infinite where that cannot be tried (something
// drives the plug and it is no matrix); a matrix that something drives is taken to reach `diagonal`.
Result<std::vector<double>> FindReach(const TrainingRig& rig, Compiler* compiler,
                                      const std::vector<Signal>& signals, const Matrix4& inverse_rest_stretch,
                                      double diagonal);

}  // namespace kpsa::engine
