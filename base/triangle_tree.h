// Where a triangle mesh is nearest to a place, and where a line meets it.
//
// A tree of boxes over the triangles whose shape is built once (from rest points) and whose boxes are
// refitted to other points in memory that the caller brings: nothing is allocated after the constructor.
// Arithmetic is plain double over the float points, every query is answered on its own, and equally near
// triangles are told apart by their number (the lower one wins): answers depend on nothing but the points.
// Points that are not finite take no part: of a triangle with such a corner what is near is the edge between
// the others, and lines miss it; a query that is not finite finds nothing. None of them costs the others
// anything. Nearest place on a triangle: C. Ericson, Real-Time Collision
// Detection (2005), 5.1.5; lines: Moeller and Trumbore (1997).
#pragma once

#include <limits>
#include <span>
#include <vector>

#include "base/points.h"
#include "base/types.h"

namespace kpsa {

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

class TriangleTree {
 public:
  TriangleTree() = default;  // no triangles
  // triangles: 3 indices below points.count each (checked).
  TriangleTree(ConstPointsView points, std::span<const Index> triangles);

  std::size_t triangle_count() const { return triangles_.size() / 3; }
  std::span<const Index> triangles() const { return triangles_; }
  std::size_t BoxFloats() const { return 6 * nodes_.size(); }
  // The boxes of the tree around the triangles as `points` has them; BoxFloats() floats. All queries take the
  // points and boxes that belong together.
  void Fit(ConstPointsView points, std::span<float> boxes) const;

  // The nearest place within the distance.
  SurfacePoint Closest(ConstPointsView points, std::span<const float> boxes, Double3 place,
                       double max_distance = std::numeric_limits<double>::infinity()) const;
  // The place on the triangle of the lowest number that has one within the distance.
  SurfacePoint Lowest(ConstPointsView points, std::span<const float> boxes, Double3 place,
                      double max_distance) const;
  // The nearest `count` triangles within the distance, each with its nearest place: near ones first.
  void ClosestSeveral(ConstPointsView points, std::span<const float> boxes, Double3 place, std::size_t count,
                      double max_distance, std::vector<SurfacePoint>* found) const;
  // The hit with the least t >= 0. Lines through an edge hit one of its triangles.
  LineHit FirstHit(ConstPointsView points, std::span<const float> boxes, Double3 origin,
                   Double3 direction) const;

 private:
  struct Node {
    Index first = 0, count = 0;  // of a leaf: its triangles in order_
    Index right = 0;             // of the others: the second child; the first one is the next node
    Index least = 0;             // of its triangles: the lowest number
  };
  template <typename Near, typename Visit>
  void Walk(Near near, Visit visit) const;

  std::vector<Index> triangles_, order_;
  std::vector<Node> nodes_;
};

}  // namespace kpsa
