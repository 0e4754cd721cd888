// A step of rig_builder.cpp. `head_mesh_skinCluster.blendWeights: "w.json#dq"`.
// Reads: keys of the character's own deformers, weight files. Writes: blend weights in the graph; through `maps`
// the files and weights that the rig names.
#pragma once

#include "rig/build/weight_maps.h"

namespace kpsa::engine {

void SetBlendWeights(const BuildInput& in, const OwnDeformers& own, WeightMaps* maps, Graph* graph);

}  // namespace kpsa::engine
