// Node types for tests of the engine: arithmetic, points with local and ring demand, lazy selection, failure.
#pragma once

#include "graph/node_registry.h"

namespace kpsa {

// add (a, b -> out), scale3 (input double3, factor -> out), pick3 (x of a double3 -> out), sum (input[i] -> out),
// select (which, a lazy, b lazy -> out), floor (input -> out), fail (input -> out; fails where input < 0),
// source (count S -> points i * step), move (points, offset -> points + offset, in place),
// smooth (points on a ring, rings S -> mean of neighbours within `rings`), measure (points -> sum of x),
// cached (cue points [S: cue list], full points lazy, threshold -> points: where the cues' sum of x stays below
// threshold, all points are the mean cue; otherwise the full points).
void AddToyNodes(NodeRegistry& registry);

}  // namespace kpsa
