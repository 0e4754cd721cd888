// The connectivity of a mesh of welded points: who neighbours whom, which triangles touch a point, what is
// border. Immutable after Build; every accessor may be called from any thread.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/points.h"
#include "base/status.h"

namespace kpsa::engine {

class Topology {
 public:
  Topology() = default;  // no points

  // `triangles` holds 3 point indices a triangle. Errors: a length that is no multiple of 3, an index that is
  // not below point_count, more points or indices than 2^31. Triangles that name a point twice (welding makes
  // them) keep their place in triangles(), connect their distinct points and count for nothing else.
  static Result<Topology> Build(std::size_t point_count, std::span<const Index> triangles);

  std::size_t point_count() const { return border_.size(); }
  std::size_t triangle_count() const { return triangles_.size() / 3; }
  std::span<const Index> triangles() const { return triangles_; }
  // Neighbours of each point along edges, ascending, without the point itself.
  CsrView<Index> neighbors() const { return {neighbor_offsets_, neighbors_}; }
  // Triangles around each point, ascending; triangles without area by naming a point twice are left out.
  CsrView<Index> point_triangles() const { return {triangle_offsets_, point_triangles_}; }
  // True for the ends of edges that belong to exactly one triangle.
  bool is_border(Index point) const { return border_[point] != 0; }

  // The points within `rings` edges of `points`; sorted, without repetition. `points` need not be sorted.
  // Cost: proportional to the result and its edges, plus one byte a mesh point.
  std::vector<Index> Dilate(std::span<const Index> points, int rings) const;
  // As Dilate, and the ring of each point of the result (0 for `points` themselves).
  std::vector<Index> Dilate(std::span<const Index> points, int rings, std::vector<int>* ring_of) const;
  // The connected component of each point; components are numbered by their lowest point.
  std::vector<Index> Components(Index* count) const;

 private:
  std::vector<Index> triangles_;
  std::vector<Index> neighbor_offsets_ = {0}, neighbors_;
  std::vector<Index> triangle_offsets_ = {0}, point_triangles_;
  std::vector<std::uint8_t> border_;
};

}  // namespace kpsa::engine
