// The keys of one sampler of a clip, as the kernels want them.
#pragma once

#include <vector>

#include "base/status.h"
#include "graph/geometry.h"
#include "nodes/kernels/sampler.h"

namespace kpsa::engine {

struct Keys {
  std::vector<float> times, values;
  SamplerKeys view;  // of these; moving a Keys keeps it valid
  bool empty() const { return times.empty(); }
};

// No keys where the sampler has none. `what` ("rotation") begins the message about invalid ones.
Result<Keys> MakeKeys(const AnimationSampler& sampler, const char* what);

}  // namespace kpsa::engine
