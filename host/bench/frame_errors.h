// Errors of an accelerated rig frame by frame, split as the paper does (kpsa/training/error_split.h).
#pragma once

#include <string>
#include <vector>

#include "base/status.h"
#include "host/acceleration.h"
#include "host/open_rig.h"
#include "host/watch.h"

namespace kpsa::engine {

// RMS over the accelerated points, in metres and in the space of the subspace. One entry a frame; all empty
// where nothing was split.
struct FrameErrors {
  std::vector<double> times;                               // seconds
  std::vector<double> projection, cueing, storage, total;  // every frame reconstructed
  std::vector<double> soft_cache;                          // of what is emitted: 0 at a full miss
  std::vector<char> hit, miss;                             // neither: a blend
  bool empty() const { return times.empty(); }
  void Append(const FrameErrors& later);
};

double OverFrames(const std::vector<double>& errors);  // their RMS; 0 of none

// What SoftCache decided: for each frame the share of the full evaluation in the points of each subspace.
using FullWeights = std::vector<std::vector<double>>;

// Whether every subspace was trained to keep its modes, and these are of the points that come out: what SplitFrames needs.
bool HaveKeptModes(const std::vector<AppliedSubspace>& applied);

// Evaluates the times once more, on a rig loaded anew, every frame reconstructed.
Result<FrameErrors> SplitFrames(const RigOpener& opener, const RigChange& clip,
                                const AccelerationChoice& choice, const std::vector<double>& times,
                                const FullWeights& weights, const Watch& watch);

}  // namespace kpsa::engine
