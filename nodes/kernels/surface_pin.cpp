#include "nodes/kernels/surface_pin.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <vector>

namespace kpsa::engine {
namespace {

constexpr double kInUvTriangle = 1e-9;  // of a coordinate: nearer ones are in the triangle

}  // namespace

UvMap::UvMap(std::span<const float> uvs) {
  using Corners = std::array<float, 6>;
  std::set<Corners> known;
  std::vector<float> places;
  std::vector<Index> triangles;
  for (std::size_t t = 0; t < uvs.size() / 6; ++t) {
    Corners uv;
    std::copy_n(uvs.begin() + 6 * static_cast<std::ptrdiff_t>(t), 6, uv.begin());
    const bool finite = std::all_of(uv.begin(), uv.end(), [](float x) { return std::isfinite(x); });
    if (!finite || !known.insert(uv).second) continue;
    numbers_.push_back(static_cast<Index>(t));
    for (std::size_t k = 0; k < 3; ++k) {
      triangles.push_back(static_cast<Index>(triangles.size()));
      places.insert(places.end(), {uv[2 * k], uv[2 * k + 1], 0});
    }
  }
  const PointBuffer buffer = PointBuffer::FromInterleaved(places);
  tree_ = TriangleTree(buffer.view(), triangles);
}

TrianglePlace UvMap::Find(double u, double v) const {
  SurfacePoint found = tree_.Lowest({u, v, 0}, kInUvTriangle);
  if (found.triangle == kNoIndex) found = tree_.Closest({u, v, 0});
  TrianglePlace place;
  if (found.triangle == kNoIndex) return place;
  place.triangle = numbers_[found.triangle];
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
  const int n = PinAxes::Component(axes.normal), t = PinAxes::Component(axes.tangent), third = 3 - n - t;
  columns[n] = frame.normal * PinAxes::Sign(axes.normal);
  columns[t] = frame.tangent * PinAxes::Sign(axes.tangent);
  columns[third] = Cross(columns[(third + 1) % 3], columns[(third + 2) % 3]);
  Matrix4 m;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) m(row, column) = columns[column][row];
    m(row, 3) = frame.origin[row];
  }
  return m;
}

}  // namespace kpsa::engine
