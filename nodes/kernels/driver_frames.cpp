#include "nodes/kernels/driver_frames.h"

#include <algorithm>
#include <cmath>

#include "base/check.h"
#include "nodes/kernels/weights.h"

namespace kpsa {
namespace {

constexpr std::size_t kFrameGrain = 512;

Double3 Unit(Double3 v) {
  const double length = Length(v);
  return length == 0 ? v : v * (1 / length);  // not a number stays what it is
}

Matrix4 Columns(Double3 a, Double3 b, Double3 c) {
  Matrix4 m;
  for (int row = 0; row < 3; ++row) m(row, 0) = a[row], m(row, 1) = b[row], m(row, 2) = c[row];
  return m;
}

// The rest side of a frame: duals of the edges and of the normal. False where the edges span no plane.
struct RestFrame {
  std::vector<Double3> duals;  // in the order of the neighbours
  Double3 normal_dual;
};
bool MakeRestFrame(const Topology& driver, std::span<const Double3> rest, Index point, RestFrame* frame) {
  const auto neighbors = driver.neighbors().row(point);
  Double3 normal, sums[3];
  for (const Index t : driver.point_triangles().row(point)) {
    const Index* corner = &driver.triangles()[3 * std::size_t{t}];
    normal = normal + Cross(rest[corner[1]] - rest[corner[0]], rest[corner[2]] - rest[corner[0]]);
  }
  normal = Unit(normal);
  double square = 0;
  const auto add = [&](Double3 v, double weight) {
    for (int row = 0; row < 3; ++row) sums[row] = sums[row] + v * (v[row] * weight);
  };
  for (const Index j : neighbors) {
    const Double3 edge = rest[j] - rest[point];
    add(edge, 1);
    square += Dot(edge, edge);
  }
  if (neighbors.empty() || !(square > 0)) return false;
  const double scale = square / static_cast<double>(neighbors.size());
  add(normal, scale);
  const Matrix4 m = Columns(sums[0], sums[1], sums[2]);
  Matrix4 inverse;
  if (!(Determinant3(m) > 1e-10 * square * square * square) || !Invert(m, &inverse)) return false;
  frame->duals.clear();
  for (const Index j : neighbors) frame->duals.push_back(TransformVector(inverse, rest[j] - rest[point]));
  frame->normal_dual = TransformVector(inverse, normal * scale);
  return true;
}

}  // namespace

std::vector<Index> DriverFramesDemand(const Topology& driver, std::span<const Double3> rest,
                                      std::span<const Index> frame_points) {
  std::vector<Index> demand;
  RestFrame frame;
  for (const Index point : frame_points) {
    if (!MakeRestFrame(driver, rest, point, &frame)) continue;
    demand.push_back(point);
    const auto neighbors = driver.neighbors().row(point);
    demand.insert(demand.end(), neighbors.begin(), neighbors.end());
  }
  std::sort(demand.begin(), demand.end());
  demand.erase(std::unique(demand.begin(), demand.end()), demand.end());
  return demand;
}

DriverFrames::DriverFrames(const Topology& driver, std::span<const Double3> rest,
                           std::span<const Index> frame_points, std::span<const Index> in_points) {
  KPSA_CHECK_EQ(driver.point_count(), rest.size());
  KPSA_CHECK(IsSortedSet(frame_points, rest.size()) && IsSortedSet(in_points, rest.size()));
  const auto entry = [&](Index point) {
    const auto it = std::lower_bound(in_points.begin(), in_points.end(), point);
    KPSA_CHECK(it != in_points.end() && *it == point);
    return static_cast<Index>(it - in_points.begin());
  };
  RestFrame frame;
  for (const Index point : frame_points) {
    if (MakeRestFrame(driver, rest, point, &frame)) {
      own_.push_back(entry(point));
      const auto neighbors = driver.neighbors().row(point);
      for (std::size_t k = 0; k < neighbors.size(); ++k)
        edges_.push_back({entry(neighbors[k]), frame.duals[k]});
      for (const Index t : driver.point_triangles().row(point)) {
        for (std::size_t k = 0; k < 3; ++k)
          triangles_.push_back(entry(driver.triangles()[3 * std::size_t{t} + k]));
      }
      normal_duals_.push_back(frame.normal_dual);
    } else {
      own_.push_back(0);
      normal_duals_.push_back({});
    }
    edge_offsets_.push_back(static_cast<Index>(edges_.size()));
    triangle_offsets_.push_back(static_cast<Index>(triangles_.size()));
  }
}

void DriverFrames::Run(std::span<const Double3> points, std::span<DriverFrame> frames,
                       const Parallel* parallel) const noexcept {
  KPSA_CHECK_EQ(frames.size(), count());
  ForRanges(parallel, count(), kFrameGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t f = begin; f < end; ++f) {
      if (!exists(f)) continue;
      Double3 normal;
      for (Index t = triangle_offsets_[f]; t < triangle_offsets_[f + 1]; t += 3) {
        const Double3 a = points[triangles_[t]];
        normal = normal + Cross(points[triangles_[t + 1]] - a, points[triangles_[t + 2]] - a);
      }
      normal = Unit(normal);
      double sums[9];
      for (int c = 0; c < 3; ++c) {
        for (int a = 0; a < 3; ++a) sums[3 * c + a] = normal[a] * normal_duals_[f][c];
      }
      const Double3 own = points[own_[f]];
      for (Index e = edge_offsets_[f]; e < edge_offsets_[f + 1]; ++e) {
        const Double3 edge = points[edges_[e].point] - own, dual = edges_[e].dual;
        const double from[3] = {edge.x, edge.y, edge.z}, to[3] = {dual.x, dual.y, dual.z};
        for (int c = 0; c < 3; ++c) {
          for (int a = 0; a < 3; ++a) sums[3 * c + a] += from[a] * to[c];
        }
      }
      double* values = frames[f].values;
      for (int k = 0; k < 9; ++k) values[k] = sums[k];
      values[9] = normal.x, values[10] = normal.y, values[11] = normal.z;
    }
  });
}

}  // namespace kpsa
