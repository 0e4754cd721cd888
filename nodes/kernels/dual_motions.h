// Inside dual quaternion skinning only: joints as unit dual quaternions, four joints at a time.
#pragma once

#include <cstddef>

#include "base/types.h"

namespace kpsa::engine {

inline constexpr std::size_t kMotionFloats = 8;  // rotation x y z w, dual part x y z w
inline constexpr std::size_t kStretchFloats =
    16;  // columns x y z 0, but for the last: whether the joint stretches
inline constexpr std::size_t kJointGroup = 4;

// Joints whose matrices turn and move only; of others the result means nothing.
struct JointMotions {
  std::size_t count;
  const double* columns;  // of each joint, relative to the run's origin (skin_palette.h)
  const double* centers;  // rows x y z of count, rounded up to whole groups
};
// `motions` has room for whole groups of joints. Writes the last number of every joint's stretch; whether one of
// them is not 0.
bool FindMotions(const JointMotions& joints, float* motions, float* stretches) noexcept;

// Two joints, the second one's motion to be blended with the sign that brings it nearest to the first one's.
struct MotionPair {
  Index pivot, joint;
};
// Motions of the second ones, of that sign.
void TurnMotions(const MotionPair* pairs, std::size_t count, const float* motions, float* turned) noexcept;

}  // namespace kpsa::engine
