// Dual quaternion skinning (Kavan, Collins, Zara and O'Sullivan, "Geometric skinning with approximate dual
// quaternion blending", 2008; Maya's skinCluster, dual quaternion).
//
// A joint's matrix is a stretch about the joint's own place c at bind, then a rigid motion:
//     M p = rotation (c + stretch (p - c)) + translation      (polar decomposition).
// A point takes the linear blend of the stretches, then the rigid motion of the blend of unit dual
// quaternions, made unit again. Each is blended with the sign that brings it nearest to that of the joint of
// the largest weight (the first of equals). A point with one influence follows its joint exactly, up to the
// rounding of floats; stretches below a millionth count as none. Weights are made to sum to 1.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "base/matrix.h"
#include "base/points.h"
#include "nodes/kernels/dual_motions.h"
#include "nodes/kernels/parallel_hook.h"
#include "nodes/kernels/skin.h"

namespace kpsa::engine {

// A local kernel.
class DualQuaternionKernel {
 public:
  struct Inputs {
    SkinJoints joints;
    double envelope = 1;
    ConstPointsView linear = {};  // with blend weights only: what SkinKernel gives; not the output
  };

  // `weights` must be valid. centers: of every joint, its place at bind, mesh space. point_weights: see weights.h.
  // blend_weights: one an output point, 0 takes the linear result bit for bit, 1 the dual quaternions'; empty: 1
  // everywhere.
  DualQuaternionKernel(const SkinWeights& weights, std::span<const Double3> centers,
                       std::span<const Index> out_points, std::span<const float> point_weights = {},
                       std::span<const float> blend_weights = {});

  std::size_t point_count() const { return count_; }
  // The joints that the output points need, ascending: no other matrix but the first is read.
  std::span<const Index> joints() const { return palette_.joints(); }
  std::size_t ScratchFloats() const {
    return ColumnFloats() + MotionFloats() + kStretchFloats * joints().size();
  }
  // in: bind-space points, out: world-space points; may be the same.
  void Run(const Inputs& inputs, ConstPointsView in, PointsView out, std::span<float> scratch,
           const Parallel* parallel = nullptr) const noexcept;

  static constexpr std::size_t kBlock = 128;

 private:
  // In the scratch, each a multiple of 16: columns of the joints in double, motions of joints (whole groups) and
  // pairs, stretches.
  std::size_t ColumnFloats() const { return 32 * joints().size(); }
  std::size_t PaddedJoints() const { return (joints().size() + kJointGroup - 1) / kJointGroup * kJointGroup; }
  std::size_t MotionFloats() const { return PaddedCount(kMotionFloats * (PaddedJoints() + pairs_.size())); }
  void AddEntries(std::span<const std::vector<std::pair<Index, float>>> rows);  // joint's place and weight

  std::size_t count_ = 0;
  SkinPalette palette_;
  std::vector<Double3> centers_;     // of joints()
  std::vector<double> center_rows_;  // the same as FindMotions wants them
  std::vector<MotionPair> pairs_;    // by their places in joints(); that occur, of different joints
  // Points, in blocks sorted by their number of entries; the largest weight's comes first.
  std::vector<std::uint16_t> lanes_;  // place in its block
  std::vector<Index> entry_offsets_;  // of each point, and the end
  std::vector<Index>
      entry_motions_;                // kMotionFloats times the place in joints(), or of the pair behind these
  std::vector<Index> entry_joints_;  // kStretchFloats times the place in joints()
  std::vector<float> entry_weights_;
  AlignedFloats masks_;  // point weights, empty if all 1
  AlignedFloats blend_;  // empty if all 1
};

}  // namespace kpsa::engine
