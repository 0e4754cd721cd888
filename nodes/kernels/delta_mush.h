// Delta mush (Mancewicz, Derksen, Rijpkema and Wilson, DigiPro 2014): smooth the points, then give back the
// detail that the rest shape loses to the same smoothing, turned with a local frame.
//
// Smoothing: s' = s + step sum_j w_j (s_j - s), j over the neighbours in ascending order, `iterations` times.
// Frame: the least-squares tangents of the ring around a point, t = sum_j a_j (s_j - s), b = sum_j b_j (s_j -
// s) with a, b fixed at rest, orthonormal there; the rotation of their polar decomposition, and n = t x b.
// Detail: the rest point minus its smoothed place, in the frame there. Where the surface folds over (t and b
// become parallel) the detail fades before the frame turns over, so the points move continuously. At rest the
// result is the rest shape up to rounding; with 0 iterations the kernel copies.
#pragma once

#include <span>
#include <vector>

#include "base/points.h"
#include "base/status.h"
#include "nodes/kernels/mush_frames.h"
#include "nodes/kernels/parallel_hook.h"
#include "nodes/kernels/topology.h"

namespace kpsa::engine {

struct DeltaMushSettings {
  int iterations = 10;         // 0 to 1000
  double step = 0.5;           // 0 to 1: how far a point goes to its neighbours' mean
  double distance_weight = 0;  // 0 to 1; 0: all neighbours alike; 1: weighted with 1 / rest edge length
  bool pin_borders = false;    // border points keep their place
  Status Validate() const;
};

// The input points that these output points need, sorted: iterations + 1 rings, not continued through points
// that do not smooth (pinned, or with fewer than two neighbours); a point of weight 0 needs itself only.
std::vector<Index> DeltaMushDemand(const Topology& topology, const DeltaMushSettings& settings,
                                   std::span<const Index> out_points,
                                   std::span<const float> point_weights = {});

// A pivot of points: their middle.
Double3 MiddleOf(ConstPointsView points);

// A ring kernel: `in` holds the points in_points (sorted, a superset of the demand), `out` the out_points. In
// place only where in_points and out_points are the same.
class DeltaMushKernel {
 public:
  struct Inputs {
    double envelope = 1;
    double displacement = 1;  // scale of the detail that comes back; 0: only smoothed
    Double3 pivot;  // a place near the points, the same for all bindings; only precision depends on it
  };

  // rest: points of the whole mesh. settings must be valid. rest_pivot: the pivot that Run gets at rest; the
  // frames of the rest shape are then those of a Run, bit for bit. Cost: that of one Run, and of the demand.
  DeltaMushKernel(const Topology& topology, ConstPointsView rest, const DeltaMushSettings& settings,
                  std::span<const Index> out_points, std::span<const Index> in_points,
                  std::span<const float> point_weights = {}, Double3 rest_pivot = {});

  std::size_t point_count() const { return count_; }
  std::size_t ScratchFloats() const { return 2 * BufferFloats(); }
  void Run(const Inputs& inputs, ConstPointsView in, PointsView out, std::span<float> scratch,
           const Parallel* parallel = nullptr) const noexcept;
  // Point evaluations of one Run, all iterations together; the price of a binding.
  std::size_t SmoothingSteps() const;

 private:
  // Points of a level that are smoothed together, grouped by their number of neighbours.
  struct Group {
    Index neighbors;  // of each point
    Index count;
    Index first, first_weight;  // in rows_ and neighbor_weights_
    float step;                 // settings.step, or that / neighbors where these are alike
  };
  // Floats of one of the two buffers. They lie 3 KiB apart modulo 4 KiB: stores to one would otherwise hold
  // up loads from the other whose addresses look alike.
  std::size_t BufferFloats() const { return (4 * local_count_ + 1023) / 1024 * 1024 + 768; }
  void BuildRows(const Topology& topology, ConstPointsView rest, const DeltaMushSettings& settings,
                 std::span<const Index> local, std::span<const int> level, std::span<const Index> local_of);
  // Packs `in` and smooths it; the smoothed points, xyzw by local number.
  const float* Smooth(ConstPointsView in, const float* pivot, std::span<float> scratch,
                      const Parallel* parallel) const noexcept;

  std::size_t count_ = 0, in_count_ = 0, local_count_ = 0;
  int iterations_ = 0;
  // Local numbers: the smoothed part of the demand sorted by (level, mesh index); level = the number of
  // iterations from the end at which a point is last read, so that what an iteration computes is a prefix.
  std::vector<Index> source_;        // local -> entry of `in`; empty if the same
  std::vector<Index> blocks_;        // first group of each block, and the end
  std::vector<Index> block_counts_;  // [iteration]: blocks that it computes
  std::vector<Group> groups_;
  std::vector<Index> rows_;  // of each point 4 times the local numbers of its neighbours, and of itself
  std::vector<float> neighbor_weights_;  // of the neighbours; empty if all alike
  MushFrames frames_;
};

}  // namespace kpsa::engine
