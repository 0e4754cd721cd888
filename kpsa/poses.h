// Training poses: which control values to evaluate. Seeded and independent of the machine.
#pragma once

#include <cstdint>
#include <vector>

#include "graph/graph.h"

namespace kpsa {

struct ControlRange {
  PlugRef plug;
  double min = 0, max = 0, rest = 0;
  bool by_clip = false;  // a clip drives it while it plays
  bool often = false;    // it carries the space of the points: half of the mixtures move it
};

// Control values of one pose (by control), and where in the training clips it plays: clip < 0 is the rest pose.
struct SampledPose {
  std::vector<double> values;
  int clip = -1;
  double phase = 0;  // 0..1 of the clip
};

// `count` poses: a quarter of single controls and pairs at or near their ends, the others mixtures of several controls
// at random values; every second mixture is laid over a random frame of a random clip (if there are clips).
std::vector<SampledPose> SamplePoses(const std::vector<ControlRange>& controls, std::size_t clips, std::size_t count, std::uint64_t seed);

}  // namespace kpsa
