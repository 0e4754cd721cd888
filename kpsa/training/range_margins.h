// How far beyond the ranges of their controls joints may go: as far as the subspace still holds there. Clips
// go a little farther than those that were trained on, most of them with few joints at a time, and what
// leaves a range is nearly always right. Internal to training.
#pragma once

#include <functional>
#include <span>

#include "kpsa/training/calibrate_subspace.h"

namespace kpsa::engine {

struct RangeMargins {
  std::vector<double> of_controls;          // of the sampler's, in their ranges: calibration looks beyond
  std::vector<std::vector<float>> entries;  // of the signals, by pose: what ranges are to hold
  bool told_by_doubts = false;              // needs a score that knows these
};
struct FoundMargins {
  std::vector<RangeMargins> sets;  // each wider than the one before it; the first is none
  // Where there are more sets than that: poses with one joint a little beyond its range, as clips have them
  std::vector<ScoreJudge> outside;
  std::vector<std::vector<float>> entries;  // of the signals in these
};
// Tries each joint (the controls of a node together, a weight by itself) a third and a sixth of its range
// beyond its ends, in sampled poses. The second set takes a margin where all of these keep the tolerance, or
// err hardly more than at the ends; the third asks this only of poses whose tiles doubt them no more than
// those at the ends: the others miss by themselves, if the threshold stays.
Result<FoundMargins> FindMargins(const Calibrator& of, const CalibrationWork& work, const CueSet& cues,
                                 const Subspace& subspace);

// Which of such sets it is in the end: `chosen`, or a narrower one. Sets are chosen on other poses than those that
// calibrate; where these are wrong a little too often beyond the ranges, a threshold that leaves a few of them out takes
// many right ones with them, and as many of a clip's. missed: calibrates with a set, and says what share of the poses
// within the ranges misses then; asked of `chosen` first, then of the next narrower one as long as more miss than expected.
// A narrower one is taken where a frame is clearly cheaper with it. Errors: those of `missed`.
struct ExpectedOfMargins {
  double misses = 0;  // share of the poses within the ranges
  double cost = 0;    // of a frame, with these; in full evaluations
};
Result<std::size_t> NarrowByCalibration(std::size_t chosen, std::span<const ExpectedOfMargins> expected,
                                        const std::function<Result<double>(std::size_t)>& missed);

}  // namespace kpsa::engine
