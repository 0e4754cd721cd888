// A step of rig_builder.cpp. Falloffs that vary: `falloff: NAME` of deformers. A falloff node measures the points as
// they come to the deformer, one element for each geometry of each deformer that names it.
// Reads: `falloff` and `falloffs`, geometries of deformers and what comes to them, so stacks of meshes and points are
// there. Writes: values and connections in the graph, geometries of falloffs that are maps;
// *uses: what is measured where.
#pragma once

#include <vector>

#include "rig/build/made_nodes.h"

namespace kpsa::engine {

struct FalloffUse {  // a geometry that a falloff node measures, as a deformer has it
  NodeId falloff, deformer;
  int element, geometry;
};

void ConnectFalloffs(const BuildInput& in, MadeNodes* nodes, std::vector<FalloffUse>* uses, Graph* graph);

}  // namespace kpsa::engine
