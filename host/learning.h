// Teaching a subspace what it misses in clips of its rig.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/status.h"
#include "host/open_rig.h"
#include "host/watch.h"
#include "kpsa/subspace.h"
#include "kpsa/training/learner.h"

namespace kpsa::engine {

// What a subspace makes of the frames of a clip.
struct ClipTrial {
  std::vector<Miss> missed;  // blends among them
  std::size_t hits = 0, blends = 0, misses = 0;
  std::string reason;  // the most frequent one
};
// `subspace`: its file. Errors: those of the rig, of the file, and of frames that fail.
Result<ClipTrial> TryClip(const RigOpener& opener, const std::string& clip, const std::string& subspace,
                          const Watch& watch);

// Of tiles that learn by themselves: how many there are, and how many learnt nothing.
struct TileCounts {
  std::size_t all = 0, kept = 0;
};

struct LearnOptions {
  std::optional<std::string> entry;  // of the rig's accelerate section, where it has several
  std::vector<std::string> clips;    // of the rig
  std::string subspace;              // the file of what learns
  // What is being done, and the share of it; false ends it. On a thread of the learner; may be null.
  std::function<bool(const char* what, double share)> progress;
  Watch watch;  // its progress is of no use here
};
struct LearnResult {
  struct Clip {
    std::string name;
    ClipTrial before, after;  // after: what TryClip says of the new file
  };
  std::shared_ptr<const Subspace> subspace;  // null: there was nothing new
  std::size_t frames = 0;                    // learnt
  TileCounts tiles;
  std::vector<Clip> clips;
};

// Evaluates the clips accelerated and trains once more, with the frames that are no hits. `old` was read from
// options.subspace. Nothing is written.
Result<LearnResult> LearnMisses(const RigOpener& opener, const std::shared_ptr<const Subspace>& old,
                                const LearnOptions& options);

}  // namespace kpsa::engine
