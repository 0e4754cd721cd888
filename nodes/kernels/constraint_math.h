// What constraints and IK share: turns between directions, frames that aim, weighted means of rotations.
// Double, pure, no allocation, any thread. Directions need not be of unit length unless a name says so.
#pragma once

#include <cstdint>

#include "base/matrix.h"

namespace kpsa::engine {

Double3 Rotate(Quaternion unit, Double3 v);
Quaternion AxisAngle(Double3 unit_axis, double radians);
// `v` of unit length; false, and *unit untouched, where it has no direction (shorter than `least`, or not
// finite).
bool Direction(Double3 v, double least, Double3* unit);
// Some direction perpendicular to `unit`, the one nearest to `wish` where that says anything.
Double3 Perpendicular(Double3 unit, Double3 wish);

// The smallest turn that takes one unit direction to another. Opposite ones turn about the perpendicular
// nearest to `wish`.
Quaternion ShortestArc(Double3 from_unit, Double3 to_unit, Double3 wish);

// The turn that takes `aim_axis` to `direction`, and `up_axis` as near to `up` as it gets then. False, and
// *turn untouched, where either pair is parallel or has no direction.
bool AimRotation(Double3 aim_axis, Double3 up_axis, Double3 direction, Double3 up, Quaternion* turn);

// Signed angle about `unit_axis` from one direction to another, both seen along the axis, in (-pi, pi]; false
// where one of them lies on it.
bool AngleAbout(Double3 unit_axis, Double3 from, Double3 to, double* radians);

// A weighted mean of rotations that come one by one. kShortest: spherical, each on the shortest way from the
// mean of those before it; kAverage: the normalised sum of the quaternions.
class RotationMean {
 public:
  enum class Mode : std::uint8_t { kShortest, kAverage };
  explicit RotationMean(Mode mode) : mode_(mode) {}
  void Add(Quaternion unit, double weight);  // weight >= 0
  Quaternion Get() const;                    // the identity where all weights were 0

 private:
  Mode mode_;
  double total_ = 0;
  Quaternion mean_;
};

}  // namespace kpsa::engine
