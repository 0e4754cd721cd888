#include "rig/character/smoothing.h"

#include <algorithm>
#include <cmath>

#include "base/check.h"

namespace kpsa::engine {
namespace {

constexpr double kOneDegree = 0.99984769515639123916;  // its cosine

// Unit, or zero where there is no direction.
Double3 Direction(const std::vector<float>& normals, Index vertex) {
  const Double3 n = {normals[std::size_t{3} * vertex], normals[std::size_t{3} * vertex + 1],
                     normals[std::size_t{3} * vertex + 2]};
  const double length = Length(n);
  return length > 0 && std::isfinite(length) ? n * (1 / length) : Double3{0, 0, 0};
}

}  // namespace

std::vector<Index> SmoothVertices(const gltf::Mesh& file, const std::vector<Index>& vertex_to_point) {
  KPSA_CHECK_EQ(vertex_to_point.size(), file.vertex_count());
  std::vector<Index> share(file.vertex_count(), kNoIndex);
  if (file.normals.empty()) return share;
  std::vector<bool> smooth(share.size(), false);
  for (const gltf::Primitive& primitive : file.primitives) {
    const auto begin = file.normals.begin() + std::ptrdiff_t{3} * primitive.first_vertex,
               end = begin + std::ptrdiff_t{3} * primitive.vertex_count;
    if (std::none_of(begin, end, [](float value) { return std::isfinite(value); })) continue;
    std::fill_n(smooth.begin() + primitive.first_vertex, primitive.vertex_count, true);
  }
  // By point, ascending within each; the heads of a point's groups are few
  std::vector<Index> order;
  for (Index v = 0; v < share.size(); ++v) {
    if (smooth[v]) order.push_back(v);
  }
  std::stable_sort(order.begin(), order.end(),
                   [&](Index a, Index b) { return vertex_to_point[a] < vertex_to_point[b]; });
  std::vector<Index> heads;
  for (std::size_t i = 0; i < order.size(); ++i) {
    const Index v = order[i];
    if (i == 0 || vertex_to_point[order[i - 1]] != vertex_to_point[v]) heads.clear();
    const Double3 n = Direction(file.normals, v);
    const bool none = Length(n) == 0;
    const auto same = std::find_if(heads.begin(), heads.end(), [&](Index head) {
      return none || Dot(Direction(file.normals, head), n) >= kOneDegree;
    });
    share[v] = same == heads.end() ? v : *same;
    constexpr std::size_t kMost = 64;  // that are compared with; a point of more edges is nobody's work
    if (same == heads.end() && heads.size() < kMost) heads.push_back(v);
  }
  return share;
}

}  // namespace kpsa::engine
