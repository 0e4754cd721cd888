// Linear blend skinning: p' = sum_j w_j M_j p (glTF 2.0, 3.7.3.3; Maya's skinCluster, classic linear).
#pragma once

#include <span>
#include <vector>

#include "base/matrix.h"
#include "base/points.h"
#include "base/status.h"
#include "nodes/kernels/parallel_hook.h"
#include "nodes/kernels/skin_palette.h"

namespace kpsa::engine {

// The influences of a whole mesh, any number a point; zero weights are skipped, joints may repeat.
// Mesh point p is moved by joints[i] with weights[i], i in [offsets[p], offsets[p + 1]).
struct SkinWeights {
  std::span<const Index> offsets;  // points + 1
  std::span<const Index> joints;
  std::span<const float> weights;
  Index joint_count = 0;
  std::span<const Matrix4> joint_from_bind = {};  // of every joint; empty: identities
  std::size_t point_count() const { return offsets.size() - 1; }
  // Names the first bad point: offsets that do not ascend, a joint out of range, a weight not finite, more
  // than 4096 influences.
  Status Validate() const;
};

// A local kernel. Weights are used as they are, not normalised; a sum within 1e-5 of 1 counts as 1, which
// keeps the shape of a character that stands 1,000 m away up to the spacing of float there. A point without
// influences stays where it is.
class SkinKernel {
 public:
  struct Inputs {
    SkinJoints joints;
    double envelope = 1;
  };

  // `weights` must be valid. point_weights: see weights.h.
  SkinKernel(const SkinWeights& weights, std::span<const Index> out_points,
             std::span<const float> point_weights = {});

  std::size_t point_count() const { return count_; }
  // The joints that the output points need, ascending: no other matrix but the first is read.
  std::span<const Index> joints() const { return palette_.joints(); }
  std::size_t ScratchFloats() const { return 16 * joints().size(); }
  // in: bind-space points, out: world-space points; may be the same.
  void Run(const Inputs& inputs, ConstPointsView in, PointsView out, std::span<float> scratch,
           const Parallel* parallel = nullptr) const noexcept;

  // Points that are worked on together; within a block they are grouped by their number of influences.
  static constexpr std::size_t kBlock = 128;
  struct Group {
    std::uint16_t influences;  // number of influences of each point of the group
    std::uint16_t count;       // points
  };

 private:
  std::size_t count_ = 0;
  SkinPalette palette_;
  std::vector<Group> groups_;         // all blocks in a row
  std::vector<Index> block_groups_;   // first group of each block, and the end
  std::vector<Index> block_entries_;  // first entry of each block
  std::vector<std::uint16_t> lanes_;  // place in its block of each point, in order of the groups
  std::vector<Index> entry_joints_;   // per influence: 16 * place in joints()
  std::vector<float> entry_weights_;
  AlignedFloats sums_;   // sum of weights minus 1, per point
  AlignedFloats masks_;  // point weights, empty if all 1
};

}  // namespace kpsa::engine
