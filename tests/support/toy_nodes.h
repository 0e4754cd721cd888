// Node types for tests of the engine: arithmetic, points with local and ring demand, lazy selection, failure.
#pragma once

#include "graph/node_registry.h"

namespace kpsa::engine {

// add (a, b -> out), scale3 (input double3, factor -> out; passes its input at factor 1), pick3 (x of a
// double3 -> out), sum (input[i] -> out), select (which, a lazy, b lazy -> out), floor (input -> out; in
// batches), fail (input -> out; fails where input < 0, throws at kThrows), source (count S -> points i * step), move (points,
// offset -> points + offset, in place), raise (points, by, S first -> y + by from point `first` on; touches
// no others), smooth (points on a ring, rings S -> mean of neighbours within `rings`), measure (points -> sum
// of x), cached (cue points [S: cue list], full points lazy, threshold, floor -> points: where the cues' sum
// of x stays below threshold, all points are the mean cue; otherwise the full points; fails where the mean is
// below floor), trail (input -> out; stateful: half of the way from where it was), twoWays (a -> outA, b ->
// outB), choice (selector, input[i] lazy -> out), together (wanted, input[i] lazy_together -> out, the sum or
// 0), shift (offset double3 -> out, a translation), chain (matrix[i] -> out, their product), carry (matrix,
// point -> out), carryPoints (points, matrix -> points, in place), picky (points -> points; S where: 1 fails to bind, 2 demands nonsense, 3 cannot count, 4 fails to
// compute; S factor), grid (S divisions, S mode enum, points on the grid
// -> outPoints; weight[i] with element names; size 0..10). Some claim to cost more than they do, so that
// small graphs are evaluated on several threads.
inline constexpr double kThrows = -1e6;
inline constexpr int kMostChoices = 63;  // what a choice's selector may be
void AddToyNodes(NodeRegistry& registry);
// Two of them by another name: with another opinion of which input is wanted; and one that does not own up to so many
// of the points that it touches.
void AddToySelect(NodeRegistry& registry, const char* name, const char* doc, DecideFn decide);
void AddToyRaise(NodeRegistry& registry, const char* name, const char* doc, Index forgotten);
const NodeRegistry& ToyRegistry();  // one with nothing else

// How often the block compute of "cached" ran since the last call, and over how many frames.
struct BlockComputes {
  int calls = 0, frames = 0;
};
BlockComputes TakeBlockComputes();
// How often several "floor" nodes computed together since the last call.
int TakeBatchComputes();

}  // namespace kpsa::engine
