// The surface of a mesh that moves, for evaluations that search it.
#pragma once

#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "base/points.h"
#include "base/spares.h"
#include "base/triangle_tree.h"
#include "base/types.h"

namespace kpsa::engine {

// Trees over the rest points; an evaluation borrows one and moves it. Copies share them. Thread-safe.
class MovingSurface {
 public:
  // triangles: 3 indices below rest.count each (checked).
  MovingSurface(ConstPointsView rest, std::span<const Index> triangles);

  std::size_t point_count() const { return shared_->rest.count(); }

  // A tree, until the destructor gives it back; not to outlive the surface.
  class Lease {
   public:
    Lease(Spares<TriangleTree>* spares, std::unique_ptr<TriangleTree> tree)
        : spares_(spares), tree_(std::move(tree)) {}
    Lease(Lease&&) noexcept = default;
    Lease& operator=(Lease&&) = delete;
    ~Lease() {
      if (tree_ != nullptr) spares_->Give(std::move(tree_));
    }
    const TriangleTree& operator*() const { return *tree_; }
    const TriangleTree* operator->() const { return tree_.get(); }

   private:
    Spares<TriangleTree>* spares_;
    std::unique_ptr<TriangleTree> tree_;
  };
  // The surface where the points, as many as at rest, are now. Allocates only where more evaluations are
  // under way at once than ever before.
  Lease At(ConstPointsView points) const;

 private:
  struct Shared {
    PointBuffer rest;
    std::vector<Index> triangles;
    Spares<TriangleTree> spares;
    std::unique_ptr<TriangleTree> Make() const;
  };
  std::shared_ptr<Shared> shared_;
};

}  // namespace kpsa::engine
