// How well nodes, skins and morph targets, as a .glb has them, give the frames of a cache. Nothing outside gltf/
// includes this.
#pragma once

#include <vector>

#include "files/point_cache.h"
#include "gltf/node_tracks.h"
#include "gltf/skinned_scene.h"

namespace kpsa::engine {

// Of the float32 numbers that are written against the frames: the largest distance of a vertex, the sum of squares.
struct SkinResidual {
  double max = 0, square_sum = 0;
};
// Of all frames, on all threads; the same on any number of them.
SkinResidual ResidualOf(const PointCacheMesh& mesh, const CacheSkin& skin,
                        const std::vector<NodeTrack>& tracks);

// The node that moves the mesh and has no track; null where all have one.
const CacheNode* ShearedNode(const SkinnedScene& scene, const CacheSkin& skin,
                             const std::vector<NodeTrack>& tracks);

}  // namespace kpsa::engine
