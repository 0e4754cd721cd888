// A step of rig_builder.cpp. `head_mesh_skinCluster.influences: "w/skin.json"`: before anything looks at who moves
// what.
// Reads: keys of the character's own deformers, weight files. Writes: the influences of its skins, in the scene and in
// the graph; through `maps` the files and weights that the rig names.
#pragma once

#include "rig/build/weight_maps.h"

namespace kpsa::engine {

void SetInfluences(const BuildInput& in, const OwnDeformers& own, WeightMaps* maps, CharacterGraph* scene,
                   Graph* graph);

}  // namespace kpsa::engine
