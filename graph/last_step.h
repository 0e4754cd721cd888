// The last step of a node that deforms points, taken apart from what comes before it: out = step(inner), where the
// inner points follow from the points that come in. A node that reconstructs points from few values (kpsa/kpsa_node.h)
// may reconstruct the inner ones and run the step itself, where these are smoother than what comes out: of a deltaMush
// they are the smoothed points, and the step turns the detail with their frames.
//
// Moving and turning the points that come in does the same to the inner points and to those that come out; scaling them
// uniformly, to the inner points: the step is to be run where what carries the points is as large as at rest. What the
// node has besides points (envelope, displacement) is baked in, as it is at rest; it is the caller's to know that it
// does not vary. Immutable, any thread.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "base/points.h"
#include "base/types.h"
#include "graph/point_set.h"

namespace kpsa::engine {

class LastStep {
 public:
  // The step for some of the points that come out.
  class Bound {
   public:
    virtual ~Bound() = default;
    virtual const std::vector<Index>& inner() const = 0;  // what Run reads, ascending
    virtual std::size_t scratch_floats() const = 0;
    // inner: views of all inner points, of which only those of inner() are read; out: the points of the set. Scratch
    // is aligned to 64 bytes. Allocates nothing.
    virtual void Run(ConstPointsView inner, PointsView out, std::span<float> scratch) const noexcept = 0;
  };

  virtual ~LastStep() = default;
  virtual std::size_t points() const = 0;  // that come in, and out: of the whole mesh
  // At least as many. Of what a node gives, inner point i < points() belongs to point i.
  virtual std::size_t inner_points() const = 0;
  virtual Index PointOf(Index inner) const = 0;  // that an inner point belongs to
  virtual float cost_ns() const = 0;             // of a Run for all points
  // in: all points that come into the node. May allocate.
  virtual void Inner(ConstPointsView in, PointsView inner) const = 0;
  virtual std::unique_ptr<const Bound> Bind(const PointSet& out) const = 0;
  // Bind(out)->inner(), ascending; it may cost less.
  virtual std::vector<Index> InnerOf(const PointSet& out) const { return Bind(out)->inner(); }
};

}  // namespace kpsa::engine
