#include "nodes/kernels/surface_pin.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/triangle_tree.h"

namespace kpsa {
namespace {

constexpr double kInUvTriangle = 1e-9;  // of a coordinate: nearer ones are in the triangle

// At least as near as the coordinates' box allows.
double BoxDistance(const float* uv, double u, double v) {
  const auto [u_low, u_high] = std::minmax({uv[0], uv[2], uv[4]});
  const auto [v_low, v_high] = std::minmax({uv[1], uv[3], uv[5]});
  const double du = std::max({u_low - u, u - u_high, 0.0}), dv = std::max({v_low - v, v - v_high, 0.0});
  return std::sqrt(du * du + dv * dv);
}

}  // namespace

TrianglePlace FindUv(std::span<const float> uvs, double u, double v) {
  TrianglePlace best;
  double nearest = std::numeric_limits<double>::infinity();
  constexpr Index kCorners[3] = {0, 1, 2};
  for (std::size_t t = 0; 6 * t + 5 < uvs.size(); ++t) {
    const float* uv = &uvs[6 * t];
    if (!std::all_of(uv, uv + 6, [](float x) { return std::isfinite(x); })) continue;
    if (BoxDistance(uv, u, v) > nearest) continue;
    const float us[3] = {uv[0], uv[2], uv[4]}, vs[3] = {uv[1], uv[3], uv[5]}, zeros[3] = {0, 0, 0};
    const SurfacePoint place = ClosestOnTriangle({us, vs, zeros, 3}, kCorners, {u, v, 0});
    const double distance = std::sqrt(place.squared);
    if (!(distance < nearest)) continue;
    nearest = distance;
    best.triangle = static_cast<Index>(t);
    std::copy_n(place.weights, 3, best.weights);
    if (nearest <= kInUvTriangle) break;
  }
  return best;
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
