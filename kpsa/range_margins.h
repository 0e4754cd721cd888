// How far beyond the ranges of their controls joints may go: as far as the subspace still holds there. Clips
// go a little farther than those that were trained on, most of them with few joints at a time, and what
// leaves a range is nearly always right. Internal to training.
#pragma once

#include "kpsa/calibrate_subspace.h"

namespace kpsa {

// Tries each joint (the controls of a node together, a weight by itself) a third and a sixth of its range
// beyond its ends, in sampled poses. Where they all keep the tolerance, or err hardly more than at the ends,
// `work.ranges` are widened by them. By control of the sampler, the margin that is taken: calibration looks
// beyond it.
Result<std::vector<double>> WidenByMargins(const Calibrator& of, const CalibrationWork& work,
                                           const CueSet& cues, const Subspace& subspace);

}  // namespace kpsa
