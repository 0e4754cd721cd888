// What a frame of an accelerate entry's stack costs before anything is trained, and what acceleration could
// save of it at most: its steps with points, less what measuring and reconstructing take at least.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "base/status.h"
#include "host/open_rig.h"
#include "host/watch.h"
#include "kpsa/training/trainer.h"

namespace kpsa::engine {

// Nanoseconds a frame.
struct FrameCost {
  double frame = 0;  // all of it
  double stack = 0;  // steps with points
  double least = 0;  // of measuring and reconstructing
  double saving() const;
  double bound() const;  // how many times as fast it could become
  bool little() const;   // could be saved
};

struct StackCost {
  std::size_t points = 0;  // accelerated
  FrameCost stated;        // by what the node types say of themselves: the same on every machine
  FrameCost timed;         // CPU time; all 0 where stated is not little
  std::vector<std::pair<std::string, double>> deformers;  // timed, nanoseconds, dearest first
  // What node types say is rough, and plugins may say nothing: where it is little, the clock must agree.
  bool worth_it() const { return !stated.little() || !timed.little(); }
};

// `open` came from the opener, and is loaded anew where it has to be timed (on frames of the first clip).
// Errors: what the entry accelerates does not compile or fails.
Result<StackCost> MeasureStack(const OpenRig& open, const RigOpener& opener, const AccelerateEntry& entry,
                               const std::vector<TrainingClip>& clips, const Watch& watch);

}  // namespace kpsa::engine
