// What both kinds of skin take from their joints: world_from_joint * joint_from_bind, moved by an offset.
#pragma once

#include <span>
#include <vector>

#include "base/matrix.h"

namespace kpsa::engine {

// The joints now. Only those that a kernel names and the first are read; last rows are taken as (0, 0, 0, 1).
struct SkinJoints {
  std::span<const Matrix4* const> world;  // of every joint
  Double3 offset = {};                    // moves all of them
};

// Bound to the joints that some points need.
class SkinPalette {
 public:
  SkinPalette() = default;
  // joint_from_bind: of every joint; empty: identities.
  SkinPalette(std::span<const Index> joints, std::span<const Matrix4> joint_from_bind, Index joint_count);

  std::span<const Index> joints() const { return joints_; }
  // What is blended is relative to the place of the first joint, in floats, so that numbers are small wherever
  // the character stands. `columns`: of each of joints(), x y z and a spare lane, 64-byte aligned.
  void Run(const SkinJoints& joints, float origin[3], float* columns) const noexcept;
  void Run(const SkinJoints& joints, float origin[3], double* columns) const noexcept;

 private:
  std::vector<Index> joints_;
  std::vector<double> binds_;  // columns x y z of joint_from_bind, of the first of all and of each of joints_
  Index joint_count_ = 0;
};

}  // namespace kpsa::engine
