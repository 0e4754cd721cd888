// An animated point cache as .glb for viewers and engines: meshes that glTF can move itself with their joints, skins
// and morph targets; of the others not one morph target a frame, but the few shapes that the frames are mixtures of,
// with a weight track.
#pragma once

#include <string>
#include <vector>

#include "base/status.h"
#include "files/point_cache.h"
#include "gltf/skinned_scene.h"

namespace kpsa::engine {

struct GlbOptions {
  // Shapes are added until no vertex of no frame is farther off than this share of the meshes' common
  // diagonal...
  double tolerance = 1e-4;
  // ... or this many were taken.
  int max_targets = 64;
  // What glTF can move itself; null: nothing. Where what would be written is farther from the frames than this share of
  // the diagonal, or a node is sheared, the mesh is written as those of which nothing is known.
  const SkinnedScene* scene = nullptr;
  double skin_tolerance = 1e-5;
  bool only_scene = false;  // a mesh that would be written otherwise is an error
  bool force = false;
};

// What viewers will see, against the cache: distances in metres, over all vertices of all frames of all
// meshes, of the float32 numbers that were written.
struct GlbReport {
  std::vector<int> targets;                  // of each mesh
  int skinned = 0;                           // meshes that glTF moves itself
  int most_joints = 0;                       // of one vertex of those
  double least_weight = 0, most_weight = 1;  // that a morph target of those has in a frame
  int morphed_targets = 0;                   // the most that one of the others has
  std::vector<std::string> reasons;  // as SkinnedScene::reasons, of what was found; empty without a scene
  double max_residual = 0;
  double rms_residual = 0;
  double diagonal = 0;  // of the box around all positions
};

// Of a mesh of the scene its nodes, skin, targets and weights, with LINEAR keys of all frames where something moves;
// what nodes and weights show without the animation is the first frame. Of another mesh one node: POSITION and targets
// as gltf/frame_shapes.h says (a single frame gets no animation), weights within [0, 1], to which many programs clamp
// them, one LINEAR weights channel, and normals that are fitted to the same weights. A primitive for each part, with
// what the cache knows of its material and texture coordinates. glTF time starts at 0: times are shifted by the first
// where that is negative. Errors: times that do not ascend, points that are not finite, more than 4 GB, and with
// only_scene (of kind kUsage) a mesh that would be written otherwise.
Result<GlbReport> WriteGlb(const std::string& path, const PointCache& cache, const GlbOptions& options);

}  // namespace kpsa::engine
