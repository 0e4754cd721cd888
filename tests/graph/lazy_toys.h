// Toy nodes with several lazy inputs of one owner, and what tests of them look at.
#pragma once

#include <string>

#include "graph/evaluator.h"
#include "graph/node_registry.h"

namespace kpsa::engine {

inline constexpr Index kPatchPoints = 210;

// The toys, and: patches (chosen, patch[n] lazy, all[0] lazy together -> points, those of each chosen patch:
// every n-th point, or all of `all` by bit n), pick (chosen, input[n] lazy -> sum of the chosen ones). In the
// eager twin nothing is lazy.
const NodeRegistry& LazyToys(bool lazy);

int SharedSegments(const Plan& plan);

// Of all outputs.
std::string OutputBytes(const Evaluator& evaluator);

}  // namespace kpsa::engine
