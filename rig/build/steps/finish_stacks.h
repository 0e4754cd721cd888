// A step of rig_builder.cpp. Weights of what the stacks of points added, and a note of deformers in no stack.
// Reads: geometries of the nodes. Writes: weights in the graph, notes.
#pragma once

#include <string>
#include <vector>

#include "rig/build/steps/set_weights.h"

namespace kpsa::engine {

void FinishStacks(WeightSetter* setter, const Graph& graph, MadeNodes* nodes,
                  std::vector<std::string>* notes);

}  // namespace kpsa::engine
