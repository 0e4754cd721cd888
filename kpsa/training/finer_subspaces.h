// Calibrates a subspace, and others where it misses much. Internal to training.
#pragma once

#include "kpsa/training/calibrate_subspace.h"
#include "kpsa/training/subspace_candidates.h"
#include "kpsa/training/trained_ranges.h"

namespace kpsa::engine {

// Refers to its parts.
struct CandidateCalibrator {
  SubspaceCandidates* candidates;
  const RangeFinder& ranges;  // of the poses; calibration has its own margins beyond
  CalibrationSize size;

  // By the cues and with the patches of the candidates. Also says what a frame is expected to cost, but points
  // (SubspaceCandidates::cost).
  Status Calibrate(Subspace* subspace) const;
  // What misses is known from here on, and counts more than bytes: tiles stored finely, then cues as for half the
  // tolerance, which measure more of the points that are farthest off. The cheapest stays.
  Status TryFiner(Subspace* subspace) const;
};

}  // namespace kpsa::engine
