// The few shapes that the frames of a point cache are mixtures of. Nothing outside gltf/ includes this.
#pragma once

#include <vector>

#include "files/point_cache.h"

namespace kpsa::engine {

// frames ~ rest + shapes * weights^T, V vertices (x y z each), T frames, K shapes.
struct FrameShapes {
  std::vector<float> rest;                 // 3V
  std::vector<std::vector<float>> shapes;  // K times 3V, displacements
  std::vector<float> weights;              // T x K, frame after frame, within [0, 1]; each shape's reach both
  // Of the float32 numbers above against the frames: the largest distance of a vertex, and the sum of squares
  double max_residual = 0, square_sum = 0;
};

// Singular vectors of the frames, strongest first, until no vertex is farther off than `tolerance` (metres)
// or there are `max_shapes`. Many programs clamp morph weights to [0, 1], so each shape spans all that its
// weights do, and the rest is where all are least: of the two ends that a shape has, the one that is nearer
// to the first frame. It need not look like any frame.
FrameShapes ShapesOfFrames(const PointCacheMesh& mesh, std::size_t frame_count, double tolerance,
                           int max_shapes);

// normals ~ normalized(rest + shapes * weights^T): those of the frames, fitted to their weights.
struct FrameNormals {
  std::vector<float> rest;                 // 3V, unit
  std::vector<std::vector<float>> shapes;  // K times 3V
};

// Least squares for each vertex. Only directions count, so each is scaled to what makes its rest normal a
// unit vector, as glTF wants it. Empty for a mesh without triangles.
FrameNormals NormalsOfFrames(const PointCacheMesh& mesh, const FrameShapes& shapes);

}  // namespace kpsa::engine
