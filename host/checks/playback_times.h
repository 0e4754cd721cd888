// What frames of clips cost, fully and by a subspace, in plans like those of kpsa bench: time alone varies,
// so that what no clip moves is left out, and everything that is shown is computed. Times are those of the
// program's work (host/bench/frame_times.h), but for light.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "base/status.h"
#include "graph/compiler.h"
#include "host/open_rig.h"
#include "host/watch.h"
#include "kpsa/subspace.h"
#include "kpsa/training/trainer.h"

namespace kpsa::engine {

// Consecutive frames [first, end) of a clip. The first leads in: what it changes is not what playback does.
struct PlaybackBlock {
  std::size_t clip = 0, first = 0, end = 0;
  bool operator==(const PlaybackBlock&) const = default;
};
// At most `count` blocks of `frames` besides the first one, spread evenly over all frames of the clips, in
// their order. Clips of one frame have none.
std::vector<PlaybackBlock> PlaybackBlocks(const std::vector<TrainingClip>& clips, std::size_t count,
                                          std::size_t frames);

struct PlaybackPlans {
  std::shared_ptr<const Plan> full, accelerated;
  Index full_weight = 0;  // output of `accelerated`
};
// Of the clip that plays. The rig's graph is rewritten.
Result<PlaybackPlans> MakePlaybackPlans(Rig* rig, const AccelerateEntry& entry,
                                        const std::shared_ptr<const Subspace>& subspace, double tolerance);

struct PlaybackTimes {
  std::size_t frames = 0, hits = 0;
  double full_ms = 0, hit_ms = 0;  // of a frame, means
};
// The rig is loaded anew for each clip that is timed. Hits are those at the subspace's
// tolerance; where there is none, frames that are reconstructed at any error. Without clips that move
// anything, nothing is timed.
Result<PlaybackTimes> TimePlayback(const RigOpener& opener, const AccelerateEntry& entry,
                                   const std::shared_ptr<const Subspace>& subspace,
                                   const std::vector<TrainingClip>& clips, const Watch& watch);

}  // namespace kpsa::engine
