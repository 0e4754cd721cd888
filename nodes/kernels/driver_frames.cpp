#include "nodes/kernels/driver_frames.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/check.h"
#include "nodes/kernels/weights.h"
#include "nodes/kernels/wrap_run.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kGroupGrain = 128;  // groups of frames
constexpr std::size_t kSortedBlock =
    256;  // frames among which those with equally long rings are put together

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
  for (const Index j : neighbors) frame->duals.push_back(TransformVector(inverse, rest[j] - rest[point]));
  frame->normal_dual = TransformVector(inverse, normal * scale);
  return true;
}

// The ring of a point as a cycle of its neighbours in which triangle (point, a, b) has a before b, so that the
// sum of edge x next edge is that of the triangles' normals. Where the surface ends, or is in several pieces
// around the point, kNoIndex keeps neighbours apart.
std::vector<Index> RingOf(const Topology& driver, Index point) {
  std::vector<std::pair<Index, Index>> sides;
  for (const Index t : driver.point_triangles().row(point)) {
    const Index* corner = &driver.triangles()[3 * std::size_t{t}];
    const int k = corner[0] == point ? 0 : corner[1] == point ? 1 : 2;
    sides.emplace_back(corner[(k + 1) % 3], corner[(k + 2) % 3]);
  }
  const auto from = [&](Index at) {
    return std::find_if(sides.begin(), sides.end(), [&](const auto& side) { return side.first == at; });
  };
  const auto begins = [&](const auto& side) {
    return std::none_of(sides.begin(), sides.end(),
                        [&](const auto& other) { return other.second == side.first; });
  };
  std::vector<Index> ring;
  while (!sides.empty()) {
    const bool first = ring.empty();
    auto side = std::find_if(sides.begin(), sides.end(), begins);
    if (side == sides.end()) side = sides.begin();  // all of them are part of cycles
    const Index start = side->first;
    Index at = start;
    do {
      ring.push_back(at);
      at = side->second;
      sides.erase(side);
      side = from(at);
    } while (at != start && side != sides.end());
    if (at == start && first && sides.empty()) break;
    ring.push_back(at);
    ring.push_back(kNoIndex);
  }
  return ring;
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
                           std::span<const Index> frame_points, std::span<const Index> in_points)
    : slots_(frame_points.size()), exists_(frame_points.size()) {
  KPSA_CHECK_EQ(driver.point_count(), rest.size());
  KPSA_CHECK(IsSortedSet(frame_points, rest.size()) && IsSortedSet(in_points, rest.size()));
  const auto entry = [&](Index point) {
    const auto it = std::lower_bound(in_points.begin(), in_points.end(), point);
    KPSA_CHECK(it != in_points.end() && *it == point);
    return static_cast<Index>(4 * (it - in_points.begin()));
  };
  std::vector<float> duals, normal_duals;
  const auto put = [](Double3 v, std::size_t at, std::vector<float>* floats) {
    floats->resize(std::max(floats->size(), 4 * (at + 1)));
    for (int k = 0; k < 3; ++k) (*floats)[4 * at + static_cast<std::size_t>(k)] = static_cast<float>(v[k]);
  };
  for (std::size_t begin = 0; begin < frame_points.size(); begin += kSortedBlock) {
    const std::size_t end = std::min(begin + kSortedBlock, frame_points.size());
    std::vector<RestFrame> frames(end - begin);
    std::vector<std::vector<Index>> rings(end - begin);
    std::vector<std::size_t> order(end - begin);
    for (std::size_t k = 0; k < order.size(); ++k) {
      order[k] = k;
      const Index point = frame_points[begin + k];
      exists_[begin + k] = MakeRestFrame(driver, rest, point, &frames[k]);
      if (exists_[begin + k]) rings[k] = RingOf(driver, point);
    }
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return rings[a].size() < rings[b].size(); });
    for (std::size_t k = 0; k < order.size();) {
      // A group: up to four rings of this length; the rest of it is the last one again
      const std::size_t size = rings[order[k]].size(), group = first_.size() - 1;
      const std::size_t spoke = first_.back();
      for (std::size_t lane = 0; lane < kFrameGroup; ++lane) {
        const bool more = k < order.size() && rings[order[k]].size() == size;
        if (more) slots_[begin + order[k]] = static_cast<Index>(kFrameGroup * group + lane), ++k;
        const std::size_t member = order[k - 1];
        const Index point = frame_points[begin + member];
        own_.push_back(entry(point));
        put(frames[member].normal_dual, kFrameGroup * group + lane, &normal_duals);
        spokes_.resize(kFrameGroup * (spoke + size));
        const auto neighbors = driver.neighbors().row(point);
        std::vector<bool> seen(neighbors.size());
        for (std::size_t j = 0; j < size; ++j) {
          const std::size_t at = kFrameGroup * (spoke + j) + lane;
          const Index to = rings[member][j];
          spokes_[at] = to == kNoIndex ? own_.back() : entry(to);
          put({}, at, &duals);
          if (to == kNoIndex) continue;
          const auto it = std::lower_bound(neighbors.begin(), neighbors.end(), to);
          const auto number = static_cast<std::size_t>(it - neighbors.begin());
          if (!seen[number]) put(frames[member].duals[number], at, &duals);
          seen[number] = true;
        }
      }
      first_.push_back(static_cast<Index>(spoke + size));
    }
  }
  duals_ = AlignedFloats(duals.size());
  std::copy(duals.begin(), duals.end(), duals_.data());
  normal_duals_ = AlignedFloats(normal_duals.size());
  std::copy(normal_duals.begin(), normal_duals.end(), normal_duals_.data());
}

void DriverFrames::Run(const float* points, float* frames, const Parallel* parallel) const noexcept {
  const FramesRun run{first_.data(), own_.data(), spokes_.data(), duals_.data(), normal_duals_.data()};
  ForRanges(parallel, first_.size() - 1, kGroupGrain,
            [&](std::size_t begin, std::size_t end) { RunDriverFrames(run, points, begin, end, frames); });
}

}  // namespace kpsa::engine
