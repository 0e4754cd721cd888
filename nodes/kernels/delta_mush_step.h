// deltaMush in two: what smooths, and the frames that give the detail back. In between are the inner points, from which
// the frames go on by themselves: of smoothed points, and of some as they came in.
#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include "base/points.h"
#include "nodes/kernels/delta_mush.h"
#include "nodes/kernels/mush_frames.h"
#include "nodes/kernels/parallel_hook.h"
#include "nodes/kernels/topology.h"

namespace kpsa::engine {

// Inner point i below points() is mesh point i: smoothed where a frame reads it (what does not smooth is as it came
// in), as it came in elsewhere. After them, what has no row yet: points as they came in which an output is mixed with,
// or is. Immutable, any thread.
class DeltaMushStep {
 public:
  struct Constants {
    double envelope = 1, displacement = 1;
    std::vector<float> weights;  // of all points; empty: 1
  };
  // Some of the outputs. Of Run, the bits of a point do not depend on which others there are.
  class Part {
   public:
    const std::vector<Index>& inner() const { return inner_; }  // that Run reads, ascending
    std::size_t ScratchFloats() const { return 4 * PaddedCount(local_count_); }
    // inner: a view of all of them. No pivot: edges are differences of what is read, and what is added to a smoothed
    // point is small.
    void Run(ConstPointsView inner, PointsView out, std::span<float> scratch,
             const Parallel* parallel = nullptr) const noexcept;

   private:
    friend class DeltaMushStep;
    MushFrames frames_;
    MushFrames::Inputs inputs_ = {};
    std::size_t local_count_ = 0;
    std::vector<Index> inner_, source_;  // source_: local number -> inner point; empty if the same
  };

  // rest: points of the whole mesh. settings must be valid; the topology must outlive the step.
  DeltaMushStep(const Topology& topology, ConstPointsView rest, const DeltaMushSettings& settings,
                Constants constants);

  bool changes() const { return changes_; }  // any point
  std::size_t points() const { return in_rows_.size(); }
  std::size_t inner_points() const { return points() + extra_.size(); }
  Index PointOf(Index inner) const { return inner < points() ? inner : extra_[inner - points()]; }
  void Inner(ConstPointsView in, PointsView inner) const;               // two buffers
  Part Bind(std::span<const Index> out_points) const;                   // sorted
  std::vector<Index> InnerOf(std::span<const Index> out_points) const;  // Bind(out_points).inner()

 private:
  bool Changes(Index point) const { return masks_[point] != 0; }

  // Smooths all points, which few bindings need: made when it is first asked for.
  struct Whole {
    std::once_flag made;
    std::optional<DeltaMushKernel> smoothing;
    PointBuffer rest;  // inner points of the rest shape
  };
  const Whole& whole() const;
  void Inner(const DeltaMushKernel& smoothing, ConstPointsView in, PointsView inner) const;
  ConstPointsView rest() const { return {rest_.view().x, rest_.view().y, rest_.view().z, points()}; }
  // What the frames of outputs read: themselves and their neighbours, where anything changes.
  std::vector<bool> ReadByFrames(std::span<const Index> out_points) const;
  // Inner points of the rest shape, at least those of the list, sorted.
  PointBuffer InnerRest(std::span<const Index> of) const;

  const Topology* topology_;
  DeltaMushSettings settings_;
  std::unique_ptr<Whole> whole_;
  float envelope_, displacement_;
  bool changes_ = false;
  // [points()]
  std::vector<float> masks_;            // 0 where nothing changes
  std::vector<Index> in_rows_;          // the row of a point as it came in; any where no output reads that
  std::vector<std::uint8_t> smoothed_;  // whether row i is smoothed
  // [inner_points()], and of the rows after points()
  PointBuffer rest_;          // as they come in
  std::vector<Index> extra_;  // whose they are
};

}  // namespace kpsa::engine
