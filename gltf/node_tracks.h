// Nodes of a skinned cache as glTF animates them: translation, rotation and scale below a parent. Nothing outside gltf/
// includes this.
#pragma once

#include <vector>

#include "gltf/skinned_scene.h"

namespace kpsa::engine {

// float32 numbers, T frames; one frame where they never change.
struct NodeTrack {
  Index parent = kNoIndex;  // in the scene's nodes
  bool sheared = false;  // no parent makes it translation, rotation and scale alone: nothing else counts then
  std::vector<float> translations, rotations, scales;  // 3, 4 and 3 a frame
  bool IsIdentity() const;                             // in all frames, below the parent
};

// A node stays below its parent where that has an inverse and leaves no shear, else it hangs in the world.
// Rotations are of unit length, and each is the nearer one of its two signs to the one before.
std::vector<NodeTrack> TracksOf(const SkinnedScene& scene);

// World matrices of the frame, of those numbers.
std::vector<Matrix4> WorldsOf(const std::vector<NodeTrack>& tracks, std::size_t frame);

}  // namespace kpsa::engine
