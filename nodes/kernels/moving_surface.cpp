#include "nodes/kernels/moving_surface.h"

namespace kpsa::engine {

std::unique_ptr<TriangleTree> MovingSurface::Shared::Make() const {
  return std::make_unique<TriangleTree>(rest.view(), triangles);
}

MovingSurface::MovingSurface(ConstPointsView rest, std::span<const Index> triangles)
    : shared_(std::make_shared<Shared>()) {
  shared_->rest = PointBuffer(rest.count);
  CopyPoints(rest, shared_->rest.view());
  shared_->triangles.assign(triangles.begin(), triangles.end());
  shared_->spares.Give(shared_->Make());
}

MovingSurface::Lease MovingSurface::At(ConstPointsView points) const {
  std::unique_ptr<TriangleTree> tree = shared_->spares.Take();
  if (tree == nullptr) tree = shared_->Make();
  tree->Move(points);
  return {&shared_->spares, std::move(tree)};
}

}  // namespace kpsa::engine
