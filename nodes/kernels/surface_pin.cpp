#include "nodes/kernels/surface_pin.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace kpsa {
namespace {

constexpr double kInUvTriangle = 1e-9;  // of a coordinate: nearer ones are in the triangle

}  // namespace

UvMap::UvMap(std::span<const float> uvs) : corners_(uvs.size() / 6 * 3) {
  const PointsView corners = corners_.view();
  std::vector<Index> triangles(corners.count);
  for (std::size_t t = 0; 3 * t < corners.count; ++t) {
    const std::span<const float> uv = uvs.subspan(6 * t, 6);
    const bool finite = std::all_of(uv.begin(), uv.end(), [](float x) { return std::isfinite(x); });
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t i = 3 * t + k;
      triangles[i] = static_cast<Index>(i);
      corners.x[i] = finite ? uv[2 * k] : std::numeric_limits<float>::quiet_NaN();
      corners.y[i] = uv[2 * k + 1];
      corners.z[i] = 0;
    }
  }
  tree_ = TriangleTree(corners, triangles);
  boxes_ = AlignedFloats(tree_.BoxFloats());
  tree_.Fit(corners, boxes_.span());
}

TrianglePlace UvMap::Find(double u, double v) const {
  SurfacePoint found = tree_.Lowest(corners_.view(), boxes_.span(), {u, v, 0}, kInUvTriangle);
  if (found.triangle == kNoIndex) found = tree_.Closest(corners_.view(), boxes_.span(), {u, v, 0});
  TrianglePlace place;
  place.triangle = found.triangle;
  std::copy_n(found.weights, 3, place.weights);
  return place;
}

UvDirection DirectionOfU(std::span<const float> uv) {
  if (uv.size() < 6) return {};
  const double u1 = double{uv[2]} - uv[0], v1 = double{uv[3]} - uv[1];
  const double u2 = double{uv[4]} - uv[0], v2 = double{uv[5]} - uv[1];
  const double area = u1 * v2 - u2 * v1;
  if (!(std::fabs(area) > 0) || !std::isfinite(area)) return {};
  // Only its direction counts: what is left out is the size of the area
  const double sign = area > 0 ? 1 : -1, size = std::max(std::fabs(v1), std::fabs(v2));
  if (!(size > 0)) return {};
  return {{sign * v2 / size, -sign * v1 / size}};
}

SurfaceFrame FrameOnTriangle(const Double3 corners[3], const double weights[3],
                             const UvDirection& direction) {
  SurfaceFrame frame;
  frame.origin = corners[0] * weights[0] + corners[1] * weights[1] + corners[2] * weights[2];
  const Double3 e1 = corners[1] - corners[0], e2 = corners[2] - corners[0];
  const Double3 normal = Cross(e1, e2);
  const Double3 tangent = e1 * direction.along[0] + e2 * direction.along[1];
  const double size = Length(normal), length = Length(tangent);
  if (!(size > 0 && std::isfinite(size) && length > 0 && std::isfinite(length))) return frame;
  const Double3 n = normal * (1 / size), b = Cross(n, tangent * (1 / length));
  const double across = Length(b);
  if (!(across > 0 && std::isfinite(across))) return frame;
  frame.normal = n;
  frame.binormal = b * (1 / across);
  frame.tangent = Cross(frame.binormal, n);
  return frame;
}

Matrix4 PinMatrix(const SurfaceFrame& frame, const PinAxes& axes) {
  Double3 columns[3];
  const int n = axes.normal % 3, t = axes.tangent % 3, third = 3 - n - t;
  columns[n] = frame.normal * (axes.normal < 3 ? 1 : -1);
  columns[t] = frame.tangent * (axes.tangent < 3 ? 1 : -1);
  columns[third] = Cross(columns[(third + 1) % 3], columns[(third + 2) % 3]);
  Matrix4 m;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) m(row, column) = columns[column][row];
    m(row, 3) = frame.origin[row];
  }
  return m;
}

}  // namespace kpsa
