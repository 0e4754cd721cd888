// A profiled evaluation of some frames.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "host/rig_frames.h"

namespace kpsa::engine {

struct FrameSpan {
  std::uint64_t begin_ns = 0, end_ns = 0;
};

// What was measured.
struct Measured {
  std::vector<FrameSpan> frames;
  double wall_ns = 0, node_ns = 0, above_ns = 0;  // all frames; above: steps without points
  double between_ns() const { return std::max(0.0, wall_ns - node_ns); }
  // Nothing that skips points can be faster than what is above them, and what lies between the nodes.
  double ceiling() const { return wall_ns / std::max(1.0, above_ns + between_ns()); }
};

// Every frame on one warm evaluator; a single frame is evaluated anew twenty times. Errors: the first frame
// that fails.
Result<Measured> Measure(const Rig& rig, const std::shared_ptr<const Plan>& plan,
                         const std::vector<double>& times, bool parallel, const Watch& watch,
                         Profile* profile);

}  // namespace kpsa::engine
