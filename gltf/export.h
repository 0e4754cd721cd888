// An animated point cache as .glb for viewers: not one morph target a frame, but the few shapes that the
// frames are mixtures of, with a weight track.
#pragma once

#include <string>
#include <vector>

#include "base/status.h"
#include "files/point_cache.h"

namespace kpsa::engine {

struct MorphGlbOptions {
  // Shapes are added until no vertex of no frame is farther off than this share of the meshes' common
  // diagonal...
  double tolerance = 1e-4;
  // ... or this many were taken.
  int max_targets = 64;
  bool force = false;
};

// What viewers will see, against the cache: distances in metres, over all vertices of all frames of all
// meshes, of the float32 numbers that were written.
struct MorphGlbReport {
  std::vector<int> targets;  // of each mesh
  double max_residual = 0;
  double rms_residual = 0;
  double diagonal = 0;  // of the box around all positions
};

// One node and mesh for each mesh of the cache: POSITION and targets as gltf/frame_shapes.h says (a single
// frame gets no animation), weights within [0, 1], to which many programs clamp them, one LINEAR weights
// channel each. A primitive for each part, with what the cache knows of its material and texture coordinates,
// and normals that are fitted to the same weights. glTF time starts at 0: times are shifted by the first where
// that is negative. An error for times that do not ascend and for
// more than 4 GB.
Result<MorphGlbReport> WriteMorphGlb(const std::string& path, const PointCache& cache,
                                     const MorphGlbOptions& options);

}  // namespace kpsa::engine
