// Which deformers a clip hardly needs: what of the full cost makes less than a tolerance.
//
// A speedup over a stack says little where much of the stack stands still. Every deformer is switched off by
// itself (envelope 0), and the largest distance that the final points then have from where they were is its
// difference. Then all are tried together, the least one first: each stays off while the difference of those
// that are off keeps within the tolerance. What need not be evaluated without these is what they cost.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "base/status.h"
#include "host/open_rig.h"
#include "host/watch.h"

namespace kpsa::engine {

struct IdleDeformers {
  struct Deformer {
    std::string name, type;
    double difference = 0;  // alone, metres; infinity where points are not finite without it
    bool off = false;       // among those that are off together
  };
  std::vector<Deformer> deformers;  // the least difference first; none: not measured
  std::size_t frames = 0;
  double tolerance = 0, difference = 0;  // of those that are off together
  double ms_per_frame = 0, share = 0;    // of the full evaluation, that they cost
  bool measured() const { return !deformers.empty(); }
  std::vector<std::string> Off() const;  // names
};

// On an even spread of the frames of these clips ("": the one that the opener chooses). `full_ms`: what the
// nodes of the full evaluation take a frame, by name. Deformers whose envelope something drives stay on;
// stacks with nodes that need their previous frame are not measured.
Result<IdleDeformers> MeasureIdle(const RigOpener& opener, const std::vector<std::string>& clips,
                                  double tolerance, const std::map<std::string, double>& full_ms,
                                  const Watch& watch);

}  // namespace kpsa::engine
