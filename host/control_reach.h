// How far each control moves each point.
#pragma once

#include <cstddef>
#include <vector>

#include "base/status.h"
#include "host/watch.h"
#include "rig/build/rig_builder.h"

namespace kpsa::engine {

struct ControlReach {
  double largest = 0;              // metres; 0: it moves nothing that is shown
  std::vector<float> of_vertices;  // [V] metres (V: host/clip_record.h), or empty where it moves nothing
};

// Of every control of the rig, which is at rest (no clip plays): the largest distance of a vertex from rest when the
// control alone goes to either end of its range; two full evaluations each. A control that something drives moves
// nothing, nor does a state that cannot be evaluated. The watch counts controls.
Result<std::vector<ControlReach>> ReachOfControls(const Rig& rest, const Watch& watch);

}  // namespace kpsa::engine
