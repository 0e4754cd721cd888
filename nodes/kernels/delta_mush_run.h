// Inside deltaMush only: what its binding (delta_mush_bind.cpp) and its run (delta_mush.cpp) share.
#pragma once

#include <cstddef>
#include <cstdint>

#include "base/points.h"

namespace kpsa::engine {
inline constexpr std::size_t kFinishBlock = 128;
// Points with equally many neighbours.
struct MushRows {
  const Index* rows;     // neighbours and the point itself
  const float* weights;  // null if all alike; read by fours
  std::size_t neighbor_count, count;
  float step;  // of the sum over neighbours
};
struct MushFinish {
  const float* smoothed;
  const std::uint8_t* lanes;  // place in its block of 64 of each frame, sorted by the number of neighbours
  const Index *out_local, *frame_offsets, *frame_neighbors;  // by frame
  const float* frame_weights;
  const Index* out_in;  // by output; null: the same
  const float* masks;   // null: all 1
  float *detail_x, *detail_y, *detail_z;
  float envelope, displacement;
  float pivot[3];
};

// The detail of the outputs [begin, end) from their rest points, in the frames of the smoothed rest shape.
void ComputeMushDetail(const MushFinish& run, ConstPointsView rest, std::size_t begin,
                       std::size_t end) noexcept;

}  // namespace kpsa::engine
