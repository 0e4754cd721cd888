#include "nodes/kernels/topology.h"

#include <algorithm>
#include <numeric>

#include "base/check.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kMaxIndices = std::size_t{1} << 31;

// Turns counts in offsets[1..] into offsets.
void Accumulate(std::vector<Index>* offsets) {
  std::partial_sum(offsets->begin(), offsets->end(), offsets->begin());
}

}  // namespace

Result<Topology> Topology::Build(std::size_t point_count, std::span<const Index> triangles) {
  if (point_count >= kMaxIndices || triangles.size() >= kMaxIndices) {
    return Status::Invalid(
        "a mesh of {} points and {} triangle indices is too large, expected less than 2^31", point_count,
        triangles.size());
  }
  if (triangles.size() % 3 != 0) {
    return Status::Invalid("{} triangle indices, expected a multiple of 3", triangles.size());
  }
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    if (triangles[i] >= point_count) {
      return Status::Invalid("triangle {} names point {}, expected an index below {}", i / 3, triangles[i],
                             point_count);
    }
  }
  Topology t;
  t.triangles_.assign(triangles.begin(), triangles.end());
  t.border_.assign(point_count, 0);

  // Triangles around each point
  const auto degenerate = [&](std::size_t k) {
    const Index* v = &triangles[3 * k];
    return v[0] == v[1] || v[1] == v[2] || v[2] == v[0];
  };
  t.triangle_offsets_.assign(point_count + 1, 0);
  for (std::size_t k = 0; k < triangles.size() / 3; ++k) {
    if (degenerate(k)) continue;
    for (int c = 0; c < 3; ++c) ++t.triangle_offsets_[triangles[3 * k + c] + 1];
  }
  Accumulate(&t.triangle_offsets_);
  t.point_triangles_.resize(t.triangle_offsets_.back());
  std::vector<Index> next(t.triangle_offsets_.begin(), t.triangle_offsets_.end() - 1);
  for (std::size_t k = 0; k < triangles.size() / 3; ++k) {
    if (degenerate(k)) continue;
    for (int c = 0; c < 3; ++c) t.point_triangles_[next[triangles[3 * k + c]]++] = static_cast<Index>(k);
  }

  // All directed edges by their first point; an edge of one triangle occurs once in each direction
  t.neighbor_offsets_.assign(point_count + 1, 0);
  const auto for_edges = [&](auto&& visit) {
    for (std::size_t k = 0; k < triangles.size() / 3; ++k) {
      for (int c = 0; c < 3; ++c) {
        const Index a = triangles[3 * k + c], b = triangles[3 * k + (c + 1) % 3];
        if (a != b) visit(a, b, degenerate(k));
      }
    }
  };
  std::vector<Index> offsets(point_count + 1, 0);
  for_edges([&](Index a, Index b, bool) { ++offsets[a + 1], ++offsets[b + 1]; });
  Accumulate(&offsets);
  struct Edge {
    Index to;
    bool flat;  // of a triangle without area: no border
    bool operator<(const Edge& other) const { return to < other.to; }
  };
  std::vector<Edge> edges(offsets.back());
  next.assign(offsets.begin(), offsets.end() - 1);
  for_edges([&](Index a, Index b, bool flat) {
    edges[next[a]++] = {b, flat};
    edges[next[b]++] = {a, flat};
  });
  t.neighbors_.reserve(edges.size() / 2);
  for (std::size_t p = 0; p < point_count; ++p) {
    const auto begin = edges.begin() + offsets[p], end = edges.begin() + offsets[p + 1];
    std::sort(begin, end);
    for (auto i = begin; i != end;) {
      auto j = i;
      int triangles_here = 0;
      for (; j != end && j->to == i->to; ++j) triangles_here += j->flat ? 0 : 1;
      t.neighbors_.push_back(i->to);
      if (triangles_here == 1) t.border_[p] = t.border_[i->to] = 1;
      i = j;
    }
    t.neighbor_offsets_[p + 1] = static_cast<Index>(t.neighbors_.size());
  }
  return t;
}

std::vector<Index> Topology::Dilate(std::span<const Index> points, int rings) const {
  return Dilate(points, rings, nullptr);
}

std::vector<Index> Topology::Dilate(std::span<const Index> points, int rings,
                                    std::vector<int>* ring_of) const {
  std::vector<std::uint8_t> seen(point_count(), 0);
  std::vector<Index> found;
  std::vector<int> ring;
  for (Index p : points) {
    KPSA_CHECK_LT(p, point_count());
    if (seen[p] == 0) seen[p] = 1, found.push_back(p), ring.push_back(0);
  }
  std::size_t begin = 0;
  for (int r = 1; r <= rings && begin < found.size(); ++r) {
    const std::size_t end = found.size();
    for (; begin < end; ++begin) {
      for (Index q : neighbors().row(found[begin])) {
        if (seen[q] == 0) seen[q] = 1, found.push_back(q), ring.push_back(r);
      }
    }
  }
  if (ring_of == nullptr) {
    std::sort(found.begin(), found.end());
    return found;
  }
  std::vector<Index> order = found;
  std::vector<int> ring_by_point(point_count(), 0);
  for (std::size_t i = 0; i < found.size(); ++i) ring_by_point[found[i]] = ring[i];
  std::sort(order.begin(), order.end());
  ring_of->resize(order.size());
  for (std::size_t i = 0; i < order.size(); ++i) (*ring_of)[i] = ring_by_point[order[i]];
  return order;
}

std::vector<Index> Topology::Components(Index* count) const {
  std::vector<Index> component(point_count(), kNoIndex), stack;
  *count = 0;
  for (Index p = 0; p < point_count(); ++p) {
    if (component[p] != kNoIndex) continue;
    component[p] = *count;
    stack.push_back(p);
    while (!stack.empty()) {
      const Index q = stack.back();
      stack.pop_back();
      for (Index r : neighbors().row(q)) {
        if (component[r] == kNoIndex) component[r] = *count, stack.push_back(r);
      }
    }
    ++*count;
  }
  return component;
}

}  // namespace kpsa::engine
