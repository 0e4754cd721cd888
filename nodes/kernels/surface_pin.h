// A frame on a triangle: where a uv coordinate, or a place in the triangle, is on a surface, and how the
// surface lies there. What uvPin and follicle are made of. Double arithmetic, pure, any thread.
#pragma once

#include <span>
#include <vector>

#include "base/points.h"
#include "base/triangle_tree.h"
#include "base/types.h"

namespace kpsa::engine {

// A place in a triangle: sum of weights[k] * corner k.
struct TrianglePlace {
  Index triangle = kNoIndex;  // kNoIndex: there is none
  double weights[3] = {0, 0, 0};
};

// Where coordinates are on a surface.
class UvMap {
 public:
  // uvs: u v of the corners, 6 numbers a triangle; triangles with a coordinate that is not finite take no
  // part.
  explicit UvMap(std::span<const float> uvs);
  // Of several triangles that hold (u, v) the lowest counts; where none does, the place whose coordinate is
  // nearest. A triangle whose coordinates have no area is the segment that they are.
  TrianglePlace Find(double u, double v) const;

 private:
  std::vector<Index> numbers_;  // of the tree's triangles: of equal ones (stacked shells) the first
  TriangleTree tree_;           // over (u, v, 0), three a triangle
};

// The direction of growing u along a triangle: along[0] (p1 - p0) + along[1] (p2 - p0). (1, 0) where the
// coordinates, six numbers (or none), do not tell.
struct UvDirection {
  double along[2] = {1, 0};
};
UvDirection DirectionOfU(std::span<const float> triangle_uvs);

// The frame of a place of a triangle: orthonormal, right-handed (tangent x binormal = normal). The normal is
// the triangle's, on the side from which its corners are counter-clockwise; the tangent is the direction in
// the surface. A triangle without area, or not finite, has the axes x, y, z for tangent, binormal, normal.
struct SurfaceFrame {
  Double3 origin;
  Double3 tangent{1, 0, 0}, binormal{0, 1, 0}, normal{0, 0, 1};
};
SurfaceFrame FrameOnTriangle(const Double3 corners[3], const double weights[3], const UvDirection& direction);

// Which axis of a matrix is which direction: 0 to 2 for x, y, z, 3 to 5 for their opposites.
enum class PinAxis : std::uint8_t { kX, kY, kZ, kMinusX, kMinusY, kMinusZ };
struct PinAxes {
  PinAxis normal = PinAxis::kY, tangent = PinAxis::kX;
  static int Component(PinAxis axis) { return static_cast<int>(axis) % 3; }
  static double Sign(PinAxis axis) { return static_cast<int>(axis) < 3 ? 1 : -1; }
  bool Differ() const { return Component(normal) != Component(tangent); }
};
// The third axis makes it right-handed. The axes must differ.
Matrix4 PinMatrix(const SurfaceFrame& frame, const PinAxes& axes);

}  // namespace kpsa::engine
