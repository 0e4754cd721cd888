// What the picture-taking nodes share.
#pragma once

#include "base/matrix.h"
#include "nodes/kernels/path_tracer.h"

namespace kpsa::engine {

// The ray through the middle of pixel `pixel` (row by row from the top left) of a picture; see
// camera.worldFromScreen.
inline void PixelRay(const Matrix4& world_from_screen, Index pixel, Index width, Index height,
                     Double3* origin, Double3* direction) {
  const double x = 2 * (pixel % width + 0.5) / width - 1, y = 1 - 2 * (pixel / width + 0.5) / height;
  *origin = TransformPoint(world_from_screen, {});
  *direction = TransformVector(world_from_screen, {x, y, -1});
}

}  // namespace kpsa::engine
