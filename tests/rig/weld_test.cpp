#include "rig/character/weld.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>

#include "rig/character/point_order.h"
#include "tests/support/shared_files.h"

namespace kpsa::engine {
namespace {

// A grid of quads whose columns are split at a seam: every vertex of column `seam` is there twice.
gltf::Character SplitGrid(Index columns, Index rows, Index seam) {
  gltf::Character character;
  gltf::Mesh mesh;
  gltf::Primitive primitive;
  std::vector<std::vector<Index>> left(rows), right(rows);
  const auto add = [&](Index c, Index r) {
    for (float f : {static_cast<float>(c), static_cast<float>(r), 0.0f}) mesh.positions.push_back(f);
    return static_cast<Index>(mesh.positions.size() / 3 - 1);
  };
  for (Index r = 0; r < rows; ++r) {
    for (Index c = 0; c < columns; ++c) {
      left[r].push_back(add(c, r));
      right[r].push_back(c == seam ? add(c, r) : left[r].back());
    }
  }
  for (Index r = 0; r + 1 < rows; ++r) {
    for (Index c = 0; c + 1 < columns; ++c) {
      const auto& from = c >= seam ? right : left;
      const Index a = from[r][c], b = left[r][c + 1], d = from[r + 1][c], e = left[r + 1][c + 1];
      primitive.triangles.insert(primitive.triangles.end(), {a, b, e, a, e, d});
    }
  }
  primitive.vertex_count = static_cast<Index>(mesh.vertex_count());
  mesh.primitives.push_back(primitive);
  character.meshes.push_back(mesh);
  return character;
}

TEST(Weld, JoinsSeams) {
  const gltf::Character character = SplitGrid(5, 4, 2);
  const WeldedMesh welded = WeldMesh(character, 0, "m", true);
  EXPECT_EQ(character.meshes[0].vertex_count(), 24u);
  EXPECT_EQ(welded.mesh->point_count(), 20u);
  EXPECT_EQ(welded.mesh->vertex_count(), 24u);
  const WeldedMesh unwelded = WeldMesh(character, 0, "m", false);
  EXPECT_EQ(unwelded.mesh->point_count(), 24u);
  EXPECT_NE(welded.mesh->digest(), unwelded.mesh->digest());
  // Every vertex finds its own position, and triangles keep their vertices
  for (const WeldedMesh* w : {&welded, &unwelded}) {
    const Mesh::Data& data = w->mesh->data();
    const ConstPointsView rest = data.rest.view();
    for (Index v = 0; v < 24; ++v) {
      const Index p = data.vertex_to_point[v];
      EXPECT_EQ(rest.x[p], character.meshes[0].positions[3 * v]);
      EXPECT_EQ(rest.y[p], character.meshes[0].positions[3 * v + 1]);
    }
    ASSERT_EQ(data.triangles.size(), 3u * 24u);
    for (std::size_t i = 0; i < data.triangles.size(); ++i)
      EXPECT_EQ(data.triangles[i], data.vertex_to_point[data.triangle_vertices[i]]);
  }
}

TEST(Weld, KeepsVerticesApartThatMoveApart) {
  gltf::Character character = SplitGrid(3, 2, 1);  // vertices 1, 2 and 5, 6 are pairs
  gltf::Mesh& mesh = character.meshes[0];
  mesh.targets.push_back({"open", {1}, {0, 0, 1}});
  const auto together = [&](Index a, Index b) {
    const WeldedMesh welded = WeldMesh(character, 0, "m", true);
    return welded.mesh->data().vertex_to_point[a] == welded.mesh->data().vertex_to_point[b];
  };
  EXPECT_FALSE(together(1, 2));
  EXPECT_TRUE(together(5, 6));
  mesh.targets[0] = {"open", {1, 2}, {0, 0, 1, 0, 0, 1}};
  EXPECT_TRUE(together(1, 2));
  mesh.targets[0] = {"open", {1, 2}, {0, 0, 1, 0, 0, 0.5f}};
  EXPECT_FALSE(together(1, 2));
  mesh.targets.clear();
  mesh.influence_offsets.assign(1, 0);
  for (Index v = 0; v < mesh.vertex_count(); ++v) {
    mesh.influences.push_back({v == 5 ? 1u : 0u, 1});
    mesh.influence_offsets.push_back(v + 1);
  }
  EXPECT_TRUE(together(1, 2));
  EXPECT_FALSE(together(5, 6));
  mesh.influences.clear();
  mesh.influence_offsets.clear();
  mesh.positions[3 * 5 + 2] = -0.0f;  // as a number it is 0
  EXPECT_TRUE(together(5, 6));
  mesh.positions[3 * 5 + 2] = 1e-30f;
  EXPECT_FALSE(together(5, 6));
}

// Of a sheet over which two dozen joints are strewn, each vertex by the two nearest: so many points as are kept together
// follow two thirds as many joints as rows of the file do. Shuffled vertices come out in the same places.
TEST(Weld, PointsKeptTogetherFollowFewJoints) {
  const Index side = 48;
  gltf::Character character = SplitGrid(side, side, 0);
  gltf::Mesh& mesh = character.meshes[0];
  std::mt19937 random(5);
  std::vector<std::pair<float, float>> joints;
  for (int j = 0; j < 24; ++j)
    joints.emplace_back(static_cast<float>(random() % side), static_cast<float>(random() % side));
  mesh.influence_offsets.assign(1, 0);
  for (Index v = 0; v < mesh.vertex_count(); ++v) {
    std::vector<std::pair<float, Index>> near;
    for (Index j = 0; j < joints.size(); ++j) {
      const float x = mesh.positions[3 * v] - joints[j].first,
                  y = mesh.positions[3 * v + 1] - joints[j].second;
      near.emplace_back(x * x + y * y, j);
    }
    std::ranges::sort(near);
    mesh.influences.push_back({near[0].second, 0.75f});
    mesh.influences.push_back({near[1].second, 0.25f});
    mesh.influence_offsets.push_back(static_cast<Index>(mesh.influences.size()));
  }
  const auto joints_of_tiles = [&](const std::vector<Index>& order) {
    std::size_t sum = 0;
    for (std::size_t first = 0; first < order.size(); first += kOrderTogether) {
      std::set<Index> of_tile;
      for (std::size_t i = first; i < std::min(order.size(), first + kOrderTogether); ++i) {
        for (const gltf::Influence& influence : mesh.influence_rows().row(order[i]))
          of_tile.insert(influence.joint);
      }
      sum += of_tile.size();
    }
    return sum;
  };
  std::vector<Index> file, sorted;
  for (Index v = 0; v < mesh.vertex_count(); ++v) file.push_back(v);
  sorted = file;
  SortPoints(mesh, &sorted);
  EXPECT_TRUE(std::ranges::is_permutation(sorted, file));
  EXPECT_LT(3 * joints_of_tiles(sorted), 2 * joints_of_tiles(file));
  std::vector<Index> shuffled = file;
  std::shuffle(shuffled.begin(), shuffled.end(), random);
  SortPoints(mesh, &shuffled);
  EXPECT_EQ(shuffled, sorted);
}

TEST(Weld, DropsTrianglesThatCollapse) {
  gltf::Character character = SplitGrid(3, 2, 1);
  character.meshes[0].primitives[0].triangles.insert(character.meshes[0].primitives[0].triangles.end(),
                                                     {1, 2, 5, 0, 0, 1});
  const WeldedMesh welded = WeldMesh(character, 0, "m", true);
  EXPECT_EQ(welded.mesh->data().triangles.size(), 3u * 4u);
  EXPECT_EQ(welded.mesh->data().primitives[0].triangle_count, 4u);
}

TEST(Weld, MapsTargetsAndInfluencesToPoints) {
  gltf::Character character = SplitGrid(4, 3, 2);
  gltf::Mesh& mesh = character.meshes[0];
  std::mt19937 random(7);
  gltf::MorphTarget target;
  const WeldedMesh before = WeldMesh(character, 0, "m", true);
  mesh.influence_offsets.assign(1, 0);
  for (Index v = 0; v < mesh.vertex_count(); ++v) {  // from the position alone, so that pairs stay equal
    const float key = mesh.positions[3 * v] + 10 * mesh.positions[3 * v + 1];
    target.vertices.push_back(v);
    target.deltas.insert(target.deltas.end(), {key + 1, 2 * key, -key});
    mesh.influences.push_back({0, 0.25f});
    mesh.influences.push_back({1, 0.75f});
    mesh.influence_offsets.push_back(static_cast<Index>(mesh.influences.size()));
  }
  mesh.targets = {target, {"", {}, {}}};
  const WeldedMesh welded = WeldMesh(character, 0, "m", true);
  ASSERT_EQ(welded.mesh->point_count(), before.mesh->point_count());
  ASSERT_NE(welded.targets, nullptr);
  ASSERT_EQ(welded.targets->targets().size(), 2u);
  EXPECT_EQ(welded.targets->targets()[0].name, "0");  // unnamed: by number
  EXPECT_TRUE(welded.targets->targets()[1].points.empty());
  const MorphTargets::Target& moved = welded.targets->targets()[0];
  ASSERT_EQ(moved.points.size(), welded.mesh->point_count());
  EXPECT_TRUE(std::is_sorted(moved.points.begin(), moved.points.end()));
  for (Index p = 0; p < moved.points.size(); ++p) {
    const Index v = welded.point_to_vertex[moved.points[p]];
    for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(moved.deltas[3 * p + i], target.deltas[3 * v + i]);
  }
  bool needs_node = true;
  const auto influences = PointInfluences(mesh, welded, 2, &needs_node);
  EXPECT_FALSE(needs_node);
  EXPECT_EQ(influences->joint_count(), 2u);
  EXPECT_EQ(influences->offsets().size(), welded.mesh->point_count() + 1u);
  EXPECT_EQ(influences->weights()[1], 0.75f);
}

TEST(Weld, UnskinnedVerticesFollowTheNode) {
  gltf::Character character = SplitGrid(3, 2, 1);
  gltf::Mesh& mesh = character.meshes[0];
  mesh.influence_offsets.assign(1, 0);
  for (Index v = 0; v < mesh.vertex_count(); ++v) {
    if (v != 0) mesh.influences.push_back({0, 1});
    mesh.influence_offsets.push_back(static_cast<Index>(mesh.influences.size()));
  }
  const WeldedMesh welded = WeldMesh(character, 0, "m", true);
  bool needs_node = false;
  const auto influences = PointInfluences(mesh, welded, 5, &needs_node);
  EXPECT_TRUE(needs_node);
  EXPECT_EQ(influences->joint_count(), 6u);
  EXPECT_EQ(influences->joints()[influences->offsets()[welded.mesh->data().vertex_to_point[0]]], 5u);
}

TEST(Weld, PutsNeighboursNearEachOther) {
  const WeldedMesh welded = WeldMesh(SplitGrid(64, 64, 10), 0, "m", true);
  const Mesh::Data& data = welded.mesh->data();
  double distance = 0;
  for (std::size_t i = 0; i < data.triangles.size(); i += 3) {
    distance += std::abs(static_cast<double>(data.triangles[i]) - static_cast<double>(data.triangles[i + 1]));
  }
  // Row by row, half of these edges would be 1 apart and half about 64
  EXPECT_LT(distance / (static_cast<double>(data.triangles.size()) / 3), 64 * 64 / 16.0);
  std::set<Index> all(data.vertex_to_point.begin(), data.vertex_to_point.end());
  EXPECT_EQ(all.size(), welded.mesh->point_count());
}

TEST(Weld, AnEmptyMeshIsEmpty) {
  gltf::Character character;
  character.meshes.emplace_back();
  const WeldedMesh welded = WeldMesh(character, 0, "m", true);
  EXPECT_EQ(welded.mesh->point_count(), 0u);
  EXPECT_EQ(welded.targets, nullptr);
}

TEST(Weld, RandomMeshesAgainstAComparisonOfAllPairs) {
  std::mt19937 random(11);
  for (int round = 0; round < 20; ++round) {
    gltf::Character character;
    character.meshes.emplace_back();
    gltf::Mesh& mesh = character.meshes[0];
    const auto pick = [&](int n) { return static_cast<float>(random() % static_cast<unsigned>(n)); };
    const Index count = 60;
    mesh.influence_offsets.assign(1, 0);
    mesh.targets.resize(2);
    for (Index v = 0; v < count; ++v) {
      for (int i = 0; i < 3; ++i) mesh.positions.push_back(pick(2));
      for (Index j = 0; j < 2; ++j) {
        if (random() % 3 != 0) mesh.influences.push_back({j, 0.5f});
      }
      mesh.influence_offsets.push_back(static_cast<Index>(mesh.influences.size()));
      for (gltf::MorphTarget& target : mesh.targets) {
        if (random() % 2 == 0) continue;
        target.vertices.push_back(v);
        target.deltas.insert(target.deltas.end(), {1 + pick(2), 0, 0});
      }
    }
    const auto key = [&](Index v) {
      std::vector<float> k(mesh.positions.begin() + 3 * v, mesh.positions.begin() + 3 * v + 3);
      for (const gltf::Influence& i : mesh.influence_rows().row(v)) k.push_back(static_cast<float>(i.joint));
      for (const gltf::MorphTarget& target : mesh.targets) {
        const auto it = std::find(target.vertices.begin(), target.vertices.end(), v);
        k.push_back(it == target.vertices.end()
                        ? 0
                        : target.deltas[static_cast<std::size_t>(3 * (it - target.vertices.begin()))]);
      }
      return k;
    };
    const WeldedMesh welded = WeldMesh(character, 0, "m", true);
    const auto& point = welded.mesh->data().vertex_to_point;
    for (Index a = 0; a < count; ++a) {
      for (Index b = 0; b < a; ++b)
        EXPECT_EQ(point[a] == point[b], key(a) == key(b)) << round << " " << a << " " << b;
    }
  }
}

}  // namespace
}  // namespace kpsa::engine
