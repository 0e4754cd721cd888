// What the frames of clips cost, fully evaluated, where there is nothing to compare them with (else host/bench).
#pragma once

#include <string>
#include <vector>

#include "base/status.h"
#include "host/bench/bench_result.h"
#include "host/open_rig.h"
#include "host/watch.h"

namespace kpsa::engine {

struct FullTimes {
  std::vector<std::vector<double>> frame_us;  // [clips][frames] medians over the runs
  std::vector<BenchNode> nodes;               // means of all frames, what takes longest first
  bool cpu_times = false;                     // by the work of the thread; else as long as they lasted
  double MeanMs() const;                      // of all frames; 0 of none
};

// Every frame of the clips ("": the one that the opener chooses) so many times, as a bench times them. Clips in
// which nothing moves cost nothing. The watch counts frames.
Result<FullTimes> TimeFull(const RigOpener& opener, const std::vector<std::string>& clips, int runs,
                           int threads, const Watch& watch);

}  // namespace kpsa::engine
