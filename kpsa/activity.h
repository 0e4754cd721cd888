// How much of a rig is out of rest at once. A range speaks of one signal, and a score of what was measured; tiles that
// each hold what a few joints do do not tell that thirty are far out. Of each signal the largest share of what its
// entries reached in training, squared (once a matrix: a joint that turns moves nine entries), and of all signals the sum.
// Where poses with many controls far out would hit and be wrong, a subspace has a limit, which no pose passes that frames
// are like (kpsa/training/calibrate_subspace.cpp).
#pragma once

#include <algorithm>
#include <cmath>
#include <span>

#include "kpsa/soft_cache.h"

namespace kpsa::engine {

inline constexpr double kActivityRamp = 0.1;  // of the limit: beyond it the full evaluation is alone

// The square of an entry's share of its reach; 0 where it has none. Not a number is left to the guard.
inline double ActivityOf(double value, double rest, double per_reach) {
  const double share = (value - rest) * per_reach;
  return share * share;
}

// The share of the full evaluation that an activity asks for.
inline double ActivityWeight(double limit, double activity) {
  return activity <= limit ? 0 : GuardWeight(0, limit, kActivityRamp * limit, activity);
}

// Of the entries of signals, one after the other, and their ranges (TrainedRange::rest and reach).
// entries_of: [signals] how many each has.
double Activity(std::span<const TrainedRange> ranges, std::span<const std::size_t> entries_of,
                std::span<const float> entries);

}  // namespace kpsa::engine
