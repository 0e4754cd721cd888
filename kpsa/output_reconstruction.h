// Points of one output from the inputs of its tiles: those that a request wants, through the last step where the
// subspace reconstructs inner points (graph/last_step.h). Immutable, any thread; the bits of a point do not depend on
// which others are wanted, nor on the frames beside it.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "graph/last_step.h"
#include "kpsa/scratch_points.h"
#include "kpsa/subspace.h"

namespace kpsa::engine {

class OutputReconstruction {
 public:
  struct Frame {
    const float* inputs = nullptr;  // of this output's tiles, as LargestDoubt leaves them; null: they read y
    std::span<const float> y;
    const float* measured = nullptr;            // y of the cues, for mends
    const Matrix4* world_from_space = nullptr;  // null where points come out in the space
    PointsView out;                             // the wanted points
  };

  // output: its number in the subspace. step: of all its points, where it has inner points or mends; or null.
  OutputReconstruction(std::shared_ptr<const Subspace> subspace, std::size_t output, const PointSet& wanted,
                       const LastStep* step);
  std::size_t scratch_floats() const;
  // At most kBlockFrames at a time, all with inputs or none. scratch: aligned to 64 bytes. Allocates nothing.
  void Run(std::span<const Frame> frames, float* scratch) const;

 private:
  const TileMap& tiles() const { return subspace_->tiles[output_]; }
  // Points that come out of tiles: with all of these, or with those that no step is of.
  bool direct() const { return all_ && (step_ == nullptr || !direct_.empty()); }
  // Which tiles come out as points, and which others the step is of.
  void Divide(const SubspaceOutput& output, const PointSet& wanted, const LastStep& step);
  // Some tiles (none: all) of each frame, as they come out, or in the space; into what comes out, or of one, into the
  // mesh.
  void Reconstruct(std::span<const Frame> frames, std::span<const Index> some, bool in_space,
                   const PointsView* mesh, std::span<float> y) const;
  void CopyPoints(const Frame& frame, std::span<float> y, PointsView mesh) const;
  void RunStep(const Frame& frame, std::span<float> y, PointsView mesh, std::span<float> scratch) const;

  std::shared_ptr<const Subspace> subspace_;
  std::size_t output_;
  bool all_ = true;  // points are wanted
  std::vector<PointRun>
      places_;  // of these, where not all, and of tiles without inner points: where they come out
  std::vector<Index> direct_;  // these tiles; none: all, or where there is a step, none,
  std::vector<Index> starts_;  // and their first points; none: where they stand
  std::shared_ptr<const LastStep::Bound> step_;
  std::vector<Index> tiles_;           // that hold what the step reads; none: all
  std::size_t apart_ = 0;              // of its points, where others come out, too, and
  std::vector<PointRun> step_places_;  // where they do
  std::size_t padded_ = 0;             // floats of a component of all that is reconstructed, for the scratch
  BoundMends mends_;
};

}  // namespace kpsa::engine
