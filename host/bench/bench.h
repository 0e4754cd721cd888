// Full against accelerated evaluation of the same frames, in one process; with one subspace or with several.
//
// For every clip: one pass compares the points (and warms all sides up), some runs are timed, one pass is
// profiled. The sides take turns by blocks of frames, so that whatever else the machine does hits all of
// them. A frame's time is the median over the runs (host/bench/frame_times.h); a clip's is the mean over its frames.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/status.h"
#include "host/acceleration.h"
#include "host/bench/bench_result.h"
#include "host/open_rig.h"
#include "host/watch.h"

namespace kpsa::engine {

struct BenchOptions {
  int runs = 5;
  int threads = 1;                              // more: all sides evaluate steps and wide kernels in parallel
  double speedup = 0;                           // for ToleranceTable::reached; 0: none
  std::optional<std::string> reference, rival;  // variants; a rival only with a reference
};

// Every frame of the clips ("": the one that the opener chooses), or its times. The rig is loaded anew for each
// clip and side. One result a side. The watch counts frames, evaluated once or timed.
Result<std::vector<BenchResult>> RunBench(const RigOpener& opener,
                                          const std::vector<AccelerationChoice>& sides,
                                          const std::vector<std::string>& clips, const BenchOptions& options,
                                          const Watch& watch);

}  // namespace kpsa::engine
