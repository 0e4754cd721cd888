// Points on the surface of a part, by surface nets: a vertex in every cell of a grid that the surface passes.
#pragma once

#include <vector>

#include "bench/untouched_design.h"

namespace kpsa::engine::untouched {

struct Surface {
  std::vector<Double3> points;
  std::vector<std::array<Index, 4>> quads;  // anticlockwise from outside
  std::vector<std::vector<Index>> Neighbours() const;
};

// About so many points: within a few per cent, unless that is less than what the shape needs at all.
Surface MakeSurface(const Part& part, std::size_t points);

}  // namespace kpsa::engine::untouched
