// The naive twin of deltaMush: plain loops in double.
#pragma once

#include <cmath>
#include <vector>

#include "base/matrix.h"
#include "nodes/kernels/delta_mush.h"
#include "tests/nodes/kernel_support.h"

namespace kpsa::engine::delta_mush_twin {

using Points = std::vector<Double3>;

inline PointBuffer ToFloat(const Points& points) {
  PointBuffer buffer(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    buffer.view().x[i] = static_cast<float>(points[i].x);
    buffer.view().y[i] = static_cast<float>(points[i].y);
    buffer.view().z[i] = static_cast<float>(points[i].z);
  }
  return buffer;
}

inline bool Pinned(const Topology& topology, const DeltaMushSettings& settings, Index p) {
  return topology.neighbors().row(p).size() < 2 || (settings.pin_borders && topology.is_border(p));
}

inline Points SmoothTwin(const Topology& topology, const DeltaMushSettings& settings, const Points& rest,
                         Points points) {
  for (int iteration = 0; iteration < settings.iterations; ++iteration) {
    Points next = points;
    for (Index p = 0; p < points.size(); ++p) {
      if (Pinned(topology, settings, p)) continue;
      const auto ring = topology.neighbors().row(p);
      double inverse_lengths = 0;
      for (Index q : ring) inverse_lengths += 1 / Length(rest[q] - rest[p]);
      Double3 mean;
      for (Index q : ring) {
        const double by_length = 1 / Length(rest[q] - rest[p]) / inverse_lengths;
        mean = mean + points[q] * ((1 - settings.distance_weight) / static_cast<double>(ring.size()) +
                                   settings.distance_weight * by_length);
      }
      next[p] = points[p] * (1 - settings.step) + mean * settings.step;
    }
    points = next;
  }
  return points;
}

// The rotation nearest to m: Newton's iteration of the polar decomposition.
inline Matrix4 Polar(Matrix4 m) {
  for (int step = 0; step < 60; ++step) {
    const Matrix4 inverse = InverseOrIdentity(m);
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) m(r, c) = 0.5 * (m(r, c) + inverse(c, r));
    }
  }
  return m;
}

// How the ring around p turned from `rest` to `now`: the least-squares map of its plane, made a rotation. The
// plane is found by inverse iteration, its normal being the direction of least spread.
inline Matrix4 RingRotation(const Topology& topology, const Points& rest, const Points& now, Index p) {
  const auto ring = topology.neighbors().row(p);
  Matrix4 spread, map;
  for (int i = 0; i < 3; ++i) spread(i, i) = map(i, i) = 0;
  for (Index q : ring) {
    const Double3 a = rest[q] - rest[p], b = now[q] - now[p];
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) spread(r, c) += a[r] * a[c], map(r, c) += b[r] * a[c];
    }
  }
  Matrix4 shifted = spread;
  const double size = spread(0, 0) + spread(1, 1) + spread(2, 2);
  for (int i = 0; i < 3; ++i) shifted(i, i) += 1e-9 * size;
  const Matrix4 inverse = InverseOrIdentity(shifted);
  Double3 normal{0.3, 0.5, 0.8};
  for (int step = 0; step < 200; ++step) {
    normal = TransformVector(inverse, normal);
    normal = normal * (1 / Length(normal));
  }
  // Fill the missing direction: spread along the normal is replaced, so that the map takes normal to new
  // normal
  Matrix4 filled = spread;
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c)
      filled(r, c) -= Dot(normal, TransformVector(spread, normal)) * normal[r] * normal[c];
  }
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) filled(r, c) += size * normal[r] * normal[c];
  }
  // map on the plane: (sum b a^T) (filled)^-1; images of two directions of the plane give the new normal
  const Matrix4 plane = map * InverseOrIdentity(filled);
  const Double3 u = Cross(normal, std::fabs(normal.x) < 0.7 ? Double3{1, 0, 0} : Double3{0, 1, 0});
  const Double3 v = Cross(normal, u);
  const Double3 t = TransformVector(plane, u) * (1 / Length(u)),
                b = TransformVector(plane, v) * (1 / Length(v));
  const Double3 n = Cross(t, b) * (1 / Length(Cross(t, b)));
  const Double3 from[3] = {u * (1 / Length(u)), v * (1 / Length(v)), normal}, to[3] = {t, b, n};
  Matrix4 turn;
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) {
      turn(r, c) = 0;
      for (int k = 0; k < 3; ++k) turn(r, c) += to[k][r] * from[k][c];
    }
  }
  return Polar(turn);
}

inline Points MushTwin(const Topology& topology, const DeltaMushSettings& settings, const Points& rest,
                       const Points& points, double envelope, double displacement) {
  const Points rest_smooth = SmoothTwin(topology, settings, rest, rest),
               smooth = SmoothTwin(topology, settings, rest, points);
  Points result = points;
  for (Index p = 0; p < points.size(); ++p) {
    if (Pinned(topology, settings, p)) continue;
    const Double3 detail =
        TransformVector(RingRotation(topology, rest_smooth, smooth, p), rest[p] - rest_smooth[p]);
    result[p] = points[p] * (1 - envelope) + (smooth[p] + detail * displacement) * envelope;
  }
  return result;
}

}  // namespace kpsa::engine::delta_mush_twin
