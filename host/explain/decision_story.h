// What SoftCache decided on one frame, for every accelerated entry of a rig, and why.
#pragma once

#include <string>
#include <vector>

#include "base/status.h"
#include "host/verdicts.h"
#include "host/watch.h"
#include "kpsa/calibration.h"

namespace kpsa::engine {

struct DecisionStory {
  // A guard beyond what was trained.
  struct Outside {
    std::string plug;                  // "jaw.matrix/3" (graph: kpsa/signals.h), "cage.weight"
    double value = 0, lo = 0, hi = 0;  // metres, radians, or numbers
  };
  struct Entry {
    FrameDecision decision;
    std::string path;  // of the subspace
    std::string units;
    double tolerance = 0;
    Calibration calibration;
    std::vector<Outside> outside;  // one a guard, the farthest first
  };
  int frame = 0;
  std::string clip;  // "" at rest
  std::vector<Entry> entries;
};

// Puts the subspaces in place and evaluates the frame (and those before it where a node needs its past).
Result<DecisionStory> TellOfDecisions(Rig* rig, const AccelerationChoice& choice, int frame,
                                      const Watch& watch);

}  // namespace kpsa::engine
