// A light where the camera is, for rigs that have none: pictures without light are black.
#pragma once

#include "base/matrix.h"
#include "nodes/kernels/path_tracer.h"

namespace kpsa::engine {

// Its colour, so bright that what is seen has about the radiance of its albedo. `surfaces` are seen through
// worldFromScreen (nodes/illumination.h); their lights do not matter.
Double3 HeadLightColor(const PathTracer& surfaces, const Matrix4& world_from_screen);

}  // namespace kpsa::engine
