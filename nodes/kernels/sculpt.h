// sculpt: a sphere pushes points out of itself (Maya's sculpt deformer: flip, project, stretch).
//
// In units of the sphere, r the distance from its centre, d the dropoff distance, a point goes
//   flip:    outward along its radius, to 1; with a linear dropoff to 1 + (r / (1 + d)) d, which spreads the
//            points inside over the shell [1, 1 + d] and ends at 1 + d
//   project: to 1 along its radius, from inside and outside, as far as |r - 1| < d; linear dropoff: times
//            1 - |r - 1| / d
//   stretch: along the direction from the stretch origin to the centre, until it leaves the sphere; points
//            outside within d go as far as the surface point below them, linear dropoff: times
//            1 - (r - 1) / d
// and never farther than the maximum displacement. At the very centre there is no direction: the point stays
// (flip, project). Floats, about the centre: a point is off by some 2^-23 of its distance from there and of its move
// (tests/nodes/sculpt_test.cpp maps in double).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "base/matrix.h"
#include "base/points.h"
#include "nodes/kernels/parallel_hook.h"

namespace kpsa::engine {

enum class SculptMode : std::uint8_t { kFlip, kProject, kStretch };
enum class SculptDropoff : std::uint8_t { kNone, kLinear };

struct SculptShape {
  SculptMode mode = SculptMode::kFlip;
  SculptDropoff dropoff = SculptDropoff::kLinear;
  double dropoff_distance = 0;  // in radii of the sphere, as is the next; 0: none
  double max_displacement = 0;
  Double3 stretch;  // kStretch: direction, unit length; 0: points stay
};

// A local kernel.
class SculptKernel {
 public:
  struct Inputs {
    SculptShape shape;
    const Matrix4& stage_from_handle;  // from the space in which the sphere is about the origin
    double radius = 1;                 // there
    double envelope = 1;
  };
  SculptKernel(std::span<const Index> out_points, std::span<const float> point_weights = {});
  std::size_t point_count() const { return count_; }
  // Where the sphere is flat, nothing moves.
  void Run(const Inputs& inputs, ConstPointsView in, PointsView out,
           const Parallel* parallel = nullptr) const noexcept;

 private:
  std::size_t count_ = 0;
  AlignedFloats weights_;
};

}  // namespace kpsa::engine
