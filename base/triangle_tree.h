// Where a triangle mesh is nearest to a place, and where a line meets it.
//
// Embree (base/embree.h) says which triangles come into question; its boxes are floats with a margin. What
// counts is plain double arithmetic over the float points, every query is answered on its own, and equally
// near triangles are told apart by their number (the lower one wins): answers depend on nothing but the
// points. The structure is built once, of the points at rest, and its boxes follow points that move.
// Points that are not finite take no part: of a triangle with such a corner what is near is the edge between
// the others, and lines miss it; a query that is not finite finds nothing. None of them costs the others
// anything. Coordinates beyond 1e18 are found slowly; lines from 1e12 times as far as what they meet may miss
// it. Nearest place on a triangle: C. Ericson, Real-Time
// Collision Detection (2005), 5.1.5; lines: Moeller and Trumbore (1997).
#pragma once

#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "base/points.h"
#include "base/types.h"

namespace kpsa::engine {

// A place on a mesh: sum of weights[k] * corner k of the triangle.
struct SurfacePoint {
  Index triangle = kNoIndex;  // kNoIndex: there is none, and the other members mean nothing
  double weights[3] = {0, 0, 0};
  Double3 point;
  double squared = std::numeric_limits<double>::infinity();  // distance from the query, squared
};

// Of one triangle. A place on an edge has the same bits whichever of its triangles is asked. Triangles
// without area are the segment, or the point, that they are.
SurfacePoint ClosestOnTriangle(ConstPointsView points, const Index corners[3], Double3 place);

// Where a line meets a triangle: at origin + t * direction.
struct LineHit {
  Index triangle = kNoIndex;
  double weights[3] = {0, 0, 0};
  double t = std::numeric_limits<double>::infinity();
};

// Owns a copy of the points. Movable; queries may run on any threads at once, but not while it moves.
class TriangleTree {
 public:
  TriangleTree();  // no triangles
  // triangles: 3 indices below points.count each (checked).
  TriangleTree(ConstPointsView points, std::span<const Index> triangles);
  TriangleTree(TriangleTree&&) noexcept;
  TriangleTree& operator=(TriangleTree&&) noexcept;
  ~TriangleTree();

  std::span<const Index> triangles() const;
  ConstPointsView points() const;  // where they are now
  // As many points as there were. Costs a comparison where they are the same; allocates nothing of its own.
  void Move(ConstPointsView points);

  // The nearest place within the distance. near: a triangle that may be near, as that of a place beside it: the same is found,
  // and sooner; kNoIndex: none is known.
  SurfacePoint Closest(Double3 place, double max_distance = std::numeric_limits<double>::infinity(),
                       Index near = kNoIndex) const;
  // The place on the triangle of the lowest number that has one within the distance: for short distances.
  SurfacePoint Lowest(Double3 place, double max_distance) const;
  // The nearest `count` triangles within the distance, each with its nearest place: near ones first.
  void ClosestSeveral(Double3 place, std::size_t count, double max_distance,
                      std::vector<SurfacePoint>* found) const;
  // The hit with the least t >= 0. Lines through an edge hit one of its triangles.
  LineHit FirstHit(Double3 origin, Double3 direction) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;  // null without triangles
};

}  // namespace kpsa::engine
