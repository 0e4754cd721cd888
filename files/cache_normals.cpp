#include "files/cache_normals.h"

#include <algorithm>
#include <cmath>

#include "base/check.h"

namespace kpsa::engine {

std::vector<float> CacheNormals(const PointCacheMesh& mesh, std::size_t frame) {
  if (mesh.triangles.empty()) return {};
  const float* points = &mesh.frames[3 * frame * mesh.vertex_count];
  const auto point = [&](Index vertex) {
    const float* p = points + std::size_t{3} * vertex;
    return Double3{p[0], p[1], p[2]};
  };
  const auto group = [&](Index vertex) {
    return mesh.smooth.empty() || mesh.smooth[vertex] == kNoIndex ? vertex : mesh.smooth[vertex];
  };
  std::vector<Double3> sums(mesh.vertex_count);
  for (std::size_t i = 0; i < mesh.triangles.size(); i += 3) {
    const Index a = mesh.triangles[i], b = mesh.triangles[i + 1], c = mesh.triangles[i + 2];
    const Double3 normal = Cross(point(b) - point(a), point(c) - point(a));
    for (const Index vertex : {a, b, c}) sums[group(vertex)] = sums[group(vertex)] + normal;
  }
  std::vector<float> normals;
  normals.reserve(3 * mesh.vertex_count);
  for (Index v = 0; v < mesh.vertex_count; ++v) {
    const Double3 sum = sums[group(v)];
    const double length = Length(sum);
    const Double3 unit = length > 0 && std::isfinite(length) ? sum * (1 / length) : Double3{0, 1, 0};
    normals.insert(normals.end(),
                   {static_cast<float>(unit.x), static_cast<float>(unit.y), static_cast<float>(unit.z)});
  }
  return normals;
}

std::vector<CachePart> CacheParts(const PointCacheMesh& mesh) {
  if (!mesh.parts.empty()) return mesh.parts;
  return {{0, static_cast<Index>(mesh.vertex_count), kNoIndex}};
}

std::vector<Index> PartTriangles(const PointCacheMesh& mesh, const CachePart& part) {
  std::vector<Index> triangles;
  for (std::size_t i = 0; i < mesh.triangles.size(); i += 3) {
    const Index first = mesh.triangles[i];
    if (first < part.first_vertex || first - part.first_vertex >= part.vertex_count) continue;
    triangles.insert(triangles.end(), {first, mesh.triangles[i + 1], mesh.triangles[i + 2]});
  }
  return triangles;
}

bool PartIsFlat(const PointCacheMesh& mesh, const CachePart& part) {
  if (mesh.smooth.empty()) return false;
  const auto begin = mesh.smooth.begin() + part.first_vertex;
  return std::all_of(begin, begin + part.vertex_count, [](Index first) { return first == kNoIndex; });
}

bool PartHasUvs(const PointCacheMesh& mesh, const CachePart& part) {
  if (mesh.uvs.empty()) return false;
  const auto begin = mesh.uvs.begin() + std::ptrdiff_t{2} * part.first_vertex;
  return std::all_of(begin, begin + std::ptrdiff_t{2} * part.vertex_count,
                     [](float value) { return std::isfinite(value); });
}

}  // namespace kpsa::engine
