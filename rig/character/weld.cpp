#include "rig/character/weld.h"

#include <algorithm>
#include <array>
#include <bit>
#include <numeric>

#include "rig/character/point_order.h"

namespace kpsa::engine {
namespace {

struct MorphEntry {
  Index target;
  std::array<float, 3> delta;
};

// The displacements of every vertex, by vertex: offsets [V + 1] and entries in the order of the targets.
struct MorphRows {
  std::vector<Index> offsets;
  std::vector<MorphEntry> entries;
  std::span<const MorphEntry> row(Index v) const {
    return {entries.data() + offsets[v], offsets[v + 1] - offsets[v]};
  }
};

MorphRows RowsByVertex(const gltf::Mesh& mesh) {
  MorphRows rows;
  rows.offsets.assign(mesh.vertex_count() + 1, 0);
  for (const gltf::MorphTarget& target : mesh.targets) {
    for (Index v : target.vertices) ++rows.offsets[v + 1];
  }
  std::partial_sum(rows.offsets.begin(), rows.offsets.end(), rows.offsets.begin());
  rows.entries.resize(rows.offsets.back());
  std::vector<Index> next(rows.offsets.begin(), rows.offsets.end() - 1);
  for (std::size_t t = 0; t < mesh.targets.size(); ++t) {
    const gltf::MorphTarget& target = mesh.targets[t];
    for (std::size_t i = 0; i < target.vertices.size(); ++i) {
      rows.entries[next[target.vertices[i]]++] = {
          static_cast<Index>(t), {target.deltas[3 * i], target.deltas[3 * i + 1], target.deltas[3 * i + 2]}};
    }
  }
  return rows;
}

// Orders vertices by everything that moves them: first by a hash of it, then by the data itself.
class VertexOrder {
 public:
  explicit VertexOrder(const gltf::Mesh& mesh)
      : mesh_(mesh), morphs_(RowsByVertex(mesh)), hashes_(mesh.vertex_count()) {
    for (Index v = 0; v < hashes_.size(); ++v) hashes_[v] = Hash(v);
  }
  // Negative, zero or positive as a comes before, with or after b.
  int Compare(Index a, Index b) const {
    if (hashes_[a] != hashes_[b]) return hashes_[a] < hashes_[b] ? -1 : 1;
    for (std::size_t i = 0; i < 3; ++i) {
      if (const int c = CompareFloats(mesh_.positions[3 * a + i], mesh_.positions[3 * b + i]); c != 0)
        return c;
    }
    if (mesh_.skinned()) {
      const auto row_a = mesh_.influence_rows().row(a), row_b = mesh_.influence_rows().row(b);
      if (row_a.size() != row_b.size()) return row_a.size() < row_b.size() ? -1 : 1;
      for (std::size_t i = 0; i < row_a.size(); ++i) {
        if (row_a[i].joint != row_b[i].joint) return row_a[i].joint < row_b[i].joint ? -1 : 1;
        if (const int c = CompareFloats(row_a[i].weight, row_b[i].weight); c != 0) return c;
      }
    }
    const auto row_a = morphs_.row(a), row_b = morphs_.row(b);
    if (row_a.size() != row_b.size()) return row_a.size() < row_b.size() ? -1 : 1;
    for (std::size_t i = 0; i < row_a.size(); ++i) {
      if (row_a[i].target != row_b[i].target) return row_a[i].target < row_b[i].target ? -1 : 1;
      for (std::size_t k = 0; k < 3; ++k) {
        if (const int c = CompareFloats(row_a[i].delta[k], row_b[i].delta[k]); c != 0) return c;
      }
    }
    return 0;
  }

 private:
  static int CompareFloats(float a, float b) { return a < b ? -1 : a > b ? 1 : 0; }
  std::uint64_t Hash(Index v) const {
    std::uint64_t hash = 0x9e3779b97f4a7c15ull;
    const auto add = [&](std::uint32_t word) {
      hash = (hash ^ word) * 0xff51afd7ed558ccdull;
      hash ^= hash >> 32;
    };
    const auto add_float = [&](float f) { add(std::bit_cast<std::uint32_t>(f + 0.0f)); };  // -0 becomes 0
    for (std::size_t i = 0; i < 3; ++i) add_float(mesh_.positions[3 * v + i]);
    if (mesh_.skinned()) {
      for (const gltf::Influence& influence : mesh_.influence_rows().row(v)) {
        add(influence.joint);
        add_float(influence.weight);
      }
    }
    for (const MorphEntry& entry : morphs_.row(v)) {
      add(entry.target);
      for (float d : entry.delta) add_float(d);
    }
    return hash;
  }

  const gltf::Mesh& mesh_;
  MorphRows morphs_;
  std::vector<std::uint64_t> hashes_;
};

// The lowest equal vertex of every vertex.
std::vector<Index> Representatives(const gltf::Mesh& mesh) {
  std::vector<Index> order(mesh.vertex_count()), representative(mesh.vertex_count());
  std::iota(order.begin(), order.end(), 0u);
  const VertexOrder vertex_order(mesh);
  std::sort(order.begin(), order.end(), [&](Index a, Index b) {
    const int c = vertex_order.Compare(a, b);
    return c != 0 ? c < 0 : a < b;
  });
  for (std::size_t i = 0; i < order.size(); ++i) {
    const bool same = i > 0 && vertex_order.Compare(order[i - 1], order[i]) == 0;
    representative[order[i]] = same ? representative[order[i - 1]] : order[i];
  }
  return representative;
}

void AddTriangles(const gltf::Character& character, const gltf::Mesh& mesh, Mesh::Data* data) {
  for (const gltf::Primitive& from : mesh.primitives) {
    Mesh::Primitive to;
    to.first_vertex = from.first_vertex;
    to.vertex_count = from.vertex_count;
    to.first_triangle = static_cast<Index>(data->triangles.size() / 3);
    if (from.material != kNoIndex) {
      const gltf::Material& material = character.materials[from.material];
      to.material = material.name;
      for (std::size_t i = 0; i < 3; ++i) to.base_color[i] = static_cast<float>(material.base_color[i]);
    }
    for (std::size_t t = 0; t + 2 < from.triangles.size(); t += 3) {
      std::array<Index, 3> vertices, points;
      for (std::size_t k = 0; k < 3; ++k) {
        vertices[k] = from.triangles[t + k];
        points[k] = data->vertex_to_point[vertices[k]];
      }
      if (points[0] == points[1] || points[1] == points[2] || points[2] == points[0]) continue;
      data->triangles.insert(data->triangles.end(), points.begin(), points.end());
      data->triangle_vertices.insert(data->triangle_vertices.end(), vertices.begin(), vertices.end());
    }
    to.triangle_count = static_cast<Index>(data->triangles.size() / 3) - to.first_triangle;
    data->primitives.push_back(std::move(to));
  }
}

std::shared_ptr<const MorphTargets> PointTargets(const gltf::Mesh& mesh,
                                                 const std::vector<Index>& vertex_to_point,
                                                 const std::vector<Index>& point_to_vertex) {
  std::vector<MorphTargets::Target> targets;
  for (std::size_t t = 0; t < mesh.targets.size(); ++t) {
    const gltf::MorphTarget& from = mesh.targets[t];
    MorphTargets::Target to;
    to.name = from.name.empty() ? std::to_string(t) : from.name;
    std::vector<std::pair<Index, std::size_t>> moved;  // point, position in `from`
    for (std::size_t i = 0; i < from.vertices.size(); ++i) {
      const Index point = vertex_to_point[from.vertices[i]];
      if (point_to_vertex[point] == from.vertices[i]) moved.emplace_back(point, i);
    }
    std::sort(moved.begin(), moved.end());
    for (const auto& [point, i] : moved) {
      to.points.push_back(point);
      to.deltas.insert(to.deltas.end(), from.deltas.begin() + static_cast<std::ptrdiff_t>(3 * i),
                       from.deltas.begin() + static_cast<std::ptrdiff_t>(3 * i + 3));
    }
    targets.push_back(std::move(to));
  }
  return std::make_shared<const MorphTargets>(std::move(targets), static_cast<Index>(point_to_vertex.size()));
}

}  // namespace

WeldedMesh WeldMesh(const gltf::Character& character, Index mesh_index, std::string name, bool weld) {
  const gltf::Mesh& mesh = character.meshes[mesh_index];
  std::vector<Index> representative;
  if (weld) {
    representative = Representatives(mesh);
  } else {
    representative.resize(mesh.vertex_count());
    std::iota(representative.begin(), representative.end(), 0u);
  }
  WeldedMesh welded;
  for (Index v = 0; v < representative.size(); ++v) {
    if (representative[v] == v) welded.point_to_vertex.push_back(v);
  }
  SortPoints(mesh, &welded.point_to_vertex);

  Mesh::Data data;
  data.name = std::move(name);
  data.vertex_to_point.resize(representative.size());
  for (Index p = 0; p < welded.point_to_vertex.size(); ++p)
    data.vertex_to_point[welded.point_to_vertex[p]] = p;
  for (Index v = 0; v < representative.size(); ++v)
    data.vertex_to_point[v] = data.vertex_to_point[representative[v]];
  std::vector<float> rest;
  rest.reserve(3 * welded.point_to_vertex.size());
  for (Index v : welded.point_to_vertex) {
    for (std::size_t i = 0; i < 3; ++i) rest.push_back(mesh.positions[3 * v + i]);
  }
  data.rest = PointBuffer::FromInterleaved(rest);
  AddTriangles(character, mesh, &data);
  if (!mesh.targets.empty())
    welded.targets = PointTargets(mesh, data.vertex_to_point, welded.point_to_vertex);
  welded.mesh = std::make_shared<const Mesh>(std::move(data));
  return welded;
}

std::shared_ptr<const Influences> PointInfluences(const gltf::Mesh& mesh, const WeldedMesh& welded,
                                                  Index joint_count, bool* needs_node) {
  std::vector<Index> offsets{0}, joints;
  std::vector<float> weights;
  *needs_node = false;
  for (Index v : welded.point_to_vertex) {
    const auto row = mesh.influence_rows().row(v);
    for (const gltf::Influence& influence : row) {
      joints.push_back(influence.joint);
      weights.push_back(influence.weight);
    }
    if (row.empty()) {
      joints.push_back(joint_count);
      weights.push_back(1);
      *needs_node = true;
    }
    offsets.push_back(static_cast<Index>(joints.size()));
  }
  return std::make_shared<const Influences>(std::move(offsets), std::move(joints), std::move(weights),
                                            joint_count + (*needs_node ? 1 : 0));
}

}  // namespace kpsa::engine
