// Draws points towards a place: all the way at the place itself, less and less up to a radius from it.
#pragma once

#include <vector>

#include "base/falloff_shapes.h"
#include "base/points.h"
#include "nodes/kernels/parallel_hook.h"

namespace kpsa::engine {

class MagnetKernel {
 public:
  struct Inputs {
    Double3 place;      // in the space of the points
    double radius = 0;  // in that space's unit; 0: no point moves
    double strength = 1;
  };
  // weights: of each point that Run is given, 0 to 1; empty: 1 everywhere.
  MagnetKernel(FalloffFade fade, std::vector<float> weights);
  // `out` may be `in`. A point that has no weight, or is beyond the radius, keeps its bits. Any thread.
  void Run(const Inputs& inputs, ConstPointsView in, PointsView out, const Parallel* parallel) const;

 private:
  FalloffFade fade_;
  std::vector<float> weights_;
};

}  // namespace kpsa::engine
