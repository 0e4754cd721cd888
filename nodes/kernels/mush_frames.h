// The second half of deltaMush (delta_mush.h): frames from the rings of smoothed points, and the rest shape's detail
// turned with them.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/points.h"
#include "nodes/kernels/parallel_hook.h"
#include "nodes/kernels/topology.h"

namespace kpsa::engine {

struct MushFinish;

// Smoothed points are xyzw minus a pivot, by local number. `in` holds the points as they came in, of which the outputs
// that are mixed or let through are read.
class MushFrames {
 public:
  struct Outputs {
    std::span<const Index> points;  // of the mesh, ascending
    std::vector<Index> in;          // output -> entry of `in`; empty if the same
    std::vector<float> masks;       // weights; one of 0 comes out as it came in; empty if all 1
  };
  struct Inputs {
    float envelope, displacement;
    float pivot[3];
  };

  MushFrames() = default;  // of no points
  // local_of: [mesh points] local numbers of the outputs that change, and of their rings. rest, smoothed and pivot: what
  // Run gets at rest; these are not read if nothing changes.
  MushFrames(const Topology& topology, Outputs outputs, std::span<const Index> local_of, ConstPointsView rest,
             const float* smoothed, const float* pivot);

  std::size_t point_count() const { return count_; }
  bool changes() const { return !out_local_.empty(); }  // any of the outputs
  // `in` may be `out` where the outputs are all of it.
  void Run(const Inputs& inputs, const float* smoothed, ConstPointsView in, PointsView out,
           const Parallel* parallel = nullptr) const noexcept;
  void Pass(ConstPointsView in, PointsView out) const noexcept;  // all outputs as they came in

 private:
  bool Changes(std::size_t output) const { return masks_.size() == 0 || masks_.data()[output] != 0; }
  void SortLanes(const Topology& topology, std::span<const Index> points);
  // The ring of a point, and its weights for tangents that are orthonormal at rest.
  void AddRing(std::span<const Index> ring, std::span<const Index> local_of, const float* smoothed,
               const float* center);
  MushFinish FinishOf(const Inputs& inputs, const float* smoothed, float* detail) const noexcept;

  std::size_t count_ = 0;
  std::vector<Index> out_in_;
  std::vector<std::uint8_t>
      lanes_;                     // outputs in blocks, sorted by their number of neighbours: place in block
  std::vector<Index> out_local_;  // beside lanes_: 4 * local number
  std::vector<Index> frame_offsets_, frame_neighbors_;  // beside lanes_; empty rows where the detail is 0
  std::vector<float> frame_weights_;                    // a, b of each frame neighbour
  AlignedFloats detail_;                                // 3 rows, padded
  AlignedFloats masks_;                                 // padded; empty if all 1
};

}  // namespace kpsa::engine
