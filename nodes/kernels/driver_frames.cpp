#include "nodes/kernels/driver_frames.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "base/check.h"
#include "nodes/kernels/weights.h"
#include "nodes/kernels/wrap_run.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kFrameGrain = 512;

// Unlike UnitOrZero's, what is not a number stays that: where the driver has no place, its points have none.
Double3 Unit(Double3 v) {
  const double length = Length(v);
  return length == 0 ? v : v * (1 / length);
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
  const auto add = [](std::vector<float>* floats, Double3 v) {
    for (int i = 0; i < 3; ++i) floats->push_back(static_cast<float>(v[i]));
    floats->push_back(0);
  };
  RestFrame frame;
  std::unordered_map<Index, Index> numbers;  // of the driver's triangles among these
  for (const Index point : frame_points) {
    if (MakeRestFrame(driver, rest, point, &frame)) {
      own_.push_back(entry(point));
      const auto neighbors = driver.neighbors().row(point);
      for (std::size_t k = 0; k < neighbors.size(); ++k) {
        edge_points_.push_back(entry(neighbors[k]));
        add(&duals_, frame.duals[k]);
      }
      for (const Index t : driver.point_triangles().row(point)) {
        const auto [at, fresh] = numbers.emplace(t, static_cast<Index>(triangles_.size() / 3));
        around_.push_back(at->second);
        for (std::size_t k = 0; fresh && k < 3; ++k)
          triangles_.push_back(entry(driver.triangles()[3 * std::size_t{t} + k]));
      }
      add(&normal_duals_, frame.normal_dual);
    } else {
      own_.push_back(0);
      add(&normal_duals_, {});
    }
    edge_offsets_.push_back(static_cast<Index>(edge_points_.size()));
    triangle_offsets_.push_back(static_cast<Index>(around_.size()));
  }
}

void DriverFrames::Run(const float* points, float* frames, const Parallel* parallel) const noexcept {
  const FramesRun run{own_.data(),   edge_offsets_.data(), triangle_offsets_.data(), edge_points_.data(),
                      duals_.data(), around_.data(),       normal_duals_.data()};
  float* normals = frames + kFrameFloats * count();
  ForRanges(parallel, triangles_.size() / 3, kFrameGrain, [&](std::size_t begin, std::size_t end) {
    RunTriangleNormals(triangles_.data(), points, begin, end, normals);
  });
  ForRanges(parallel, count(), kFrameGrain, [&](std::size_t begin, std::size_t end) {
    RunDriverFrames(run, points, normals, begin, end, frames);
  });
}

}  // namespace kpsa::engine
