// Inside deltaMush only: what its files share.
#pragma once

#include <cstddef>
#include <cstdint>

#include "base/points.h"
#include "nodes/kernels/delta_mush.h"

namespace kpsa::engine {
inline constexpr std::size_t kFinishBlock = 128;

// Not pinned, and with at least two neighbours.
bool Smooths(const Topology& topology, const DeltaMushSettings& settings, Index point);

// Points with equally many neighbours.
struct MushRows {
  const Index* rows;     // neighbours and the point itself
  const float* weights;  // null if all alike; read by fours
  std::size_t neighbor_count, count;
  float step;  // of the sum over neighbours
};
struct MushFinish {
  const float* smoothed;
  const std::uint8_t* lanes;  // place in its block of each frame, sorted by the number of neighbours
  const Index *out_local, *frame_offsets, *frame_neighbors;  // by frame
  const float* frame_weights;
  const Index* out_in;  // by output; null: the same
  const float* masks;   // null: all 1
  float *detail_x, *detail_y, *detail_z;
  float envelope, displacement;
  float pivot[3];
};

// The points [begin, end) of `in` minus the pivot, as xyzw by local number, up to the padding of that; source: local
// number -> entry of `in`, null if the same.
void PackMush(ConstPointsView in, const Index* source, const float* pivot, std::size_t begin, std::size_t end,
              float* xyzw) noexcept;

// The detail of the outputs [begin, end) from their rest points, in the frames of the smoothed rest shape.
void ComputeMushDetail(const MushFinish& run, ConstPointsView rest, std::size_t begin,
                       std::size_t end) noexcept;

}  // namespace kpsa::engine
