// A character for compressed documents: one sheet of n * n vertices with colours and texture coordinates, two
// joints, a morph target and a clip, all numbers without any pattern. Nodes: 0 mesh, 1 root, 2 tip. And
// comparisons of what is read.
#pragma once

#include <gtest/gtest.h>

#include <random>
#include <string>
#include <utility>
#include <vector>

#include "gltf/import.h"
#include "tests/support/gltf_builder.h"

namespace kpsa::engine {

struct GridCharacter {
  std::vector<float> positions, normals, weights, uvs, deltas, times, turns;
  std::vector<std::uint8_t> joints, colors;  // VEC4; colours normalised
  std::vector<std::uint16_t> indices;
  std::size_t vertex_count = 0;
  GltfBuilder builder;
  // Accessors of `builder`
  int position = 0, joint = 0, weight = 0, color = 0, uv = 0, normal = 0, index = 0, delta = 0, matrix = 0,
      time = 0, turn = 0;

  explicit GridCharacter(std::size_t n) : vertex_count(n * n) {
    std::mt19937 random(7);
    const auto number = [&](float low, float high) {
      return std::uniform_real_distribution<float>(low, high)(random);
    };
    for (std::size_t i = 0; i < n * n; ++i) {
      const float u = static_cast<float>(i % n), v = static_cast<float>(i / n), share = number(0.1f, 0.9f);
      positions.insert(positions.end(), {u + number(-0.4f, 0.4f), v + number(-0.4f, 0.4f), number(-1, 1)});
      deltas.insert(deltas.end(), {number(-1, 1), number(-1, 1), number(-1, 1)});
      weights.insert(weights.end(), {share, 1 - share, 0, 0});
      joints.insert(joints.end(),
                    {static_cast<std::uint8_t>(i % 2), static_cast<std::uint8_t>(1 - i % 2), 0, 0});
      uvs.insert(uvs.end(), {positions[3 * i] / 7, positions[3 * i + 1] / 7});
      normals.insert(normals.end(), {positions[3 * i] / 9, positions[3 * i + 1] / 9, 1});
      for (int c = 0; c < 4; ++c) colors.push_back(static_cast<std::uint8_t>(random() % 256));
      if (i % n + 1 == n || i / n + 1 == n) continue;
      const auto corner = [&](std::size_t k) { indices.push_back(static_cast<std::uint16_t>(i + k)); };
      for (const std::size_t k : {std::size_t{0}, std::size_t{1}, n + 1, std::size_t{0}, n + 1, n}) corner(k);
    }
    for (int k = 0; k < 20; ++k) {
      times.push_back(0.125f * static_cast<float>(k));
      const float angle = number(-1.5f, 1.5f);
      turns.insert(turns.end(), {0, 0, std::sin(angle), std::cos(angle)});
    }
    GltfBuilder& b = builder;
    position = b.Accessor(positions, "VEC3");
    joint = b.Accessor(joints, "VEC4");
    weight = b.Accessor(weights, "VEC4");
    color = b.Accessor(colors, "VEC4", true);
    uv = b.Accessor(uvs, "VEC2");
    normal = b.Accessor(normals, "VEC3");
    index = b.Accessor(indices, "SCALAR");
    delta = b.Accessor(deltas, "VEC3");
    std::vector<float> matrices(32, 0.f);
    for (std::size_t i = 0; i < 8; ++i) matrices[16 * (i / 4) + 5 * (i % 4)] = 1;
    matrix = b.Accessor(matrices, "MAT4");
    time = b.Accessor(times, "SCALAR");
    turn = b.Accessor(turns, "VEC4");
    b.Push("meshes", {{"extras", {{"targetNames", {"bulge"}}}},
                      {"primitives",
                       {{{"attributes",
                          {{"POSITION", position},
                           {"JOINTS_0", joint},
                           {"WEIGHTS_0", weight},
                           {"COLOR_0", color},
                           {"TEXCOORD_0", uv},
                           {"NORMAL", normal}}},
                         {"indices", index},
                         {"targets", {{{"POSITION", delta}}}}}}}});
    b.Push("skins", {{"joints", {1, 2}}, {"inverseBindMatrices", matrix}});
    b.Push("nodes", {{"name", "sheet"}, {"mesh", 0}, {"skin", 0}});
    b.Push("nodes", {{"name", "root"}, {"children", {2}}});
    b.Push("nodes", {{"name", "tip"}, {"translation", {0, 1, 0}}});
    b.Push("scenes", {{"nodes", {0, 1}}});
    b.Push("animations", {{"name", "wave"},
                          {"samplers", {{{"input", time}, {"output", turn}}}},
                          {"channels", {{{"sampler", 0}, {"target", {{"node", 2}, {"path", "rotation"}}}}}}});
  }
  nlohmann::json& Primitive() { return builder.root["meshes"][0]["primitives"][0]; }
};

inline Result<gltf::Character> LoadText(const std::string& text) {
  return gltf::LoadGltfFromMemory({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()},
                                  "/nonexistent", "test.gltf");
}
inline gltf::Character MustLoadText(const std::string& text) {
  Result<gltf::Character> character = LoadText(text);
  EXPECT_TRUE(character.ok()) << character.status().ToString();
  return character.ok() ? std::move(*character) : gltf::Character();
}
inline std::string LoadError(const std::string& text) {
  const Result<gltf::Character> character = LoadText(text);
  return character.ok() ? "accepted" : character.status().ToString();
}

template <typename T>
void ExpectNear(const std::vector<T>& got, const std::vector<T>& expected, double tolerance) {
  ASSERT_EQ(got.size(), expected.size());
  for (std::size_t i = 0; i < got.size(); ++i) ASSERT_NEAR(got[i], expected[i], tolerance) << i;
}

// All of the mesh, the skin and the clip; bit for bit.
inline void ExpectSame(const gltf::Character& got, const gltf::Character& expected) {
  ASSERT_EQ(got.meshes.size(), expected.meshes.size());
  for (std::size_t m = 0; m < got.meshes.size(); ++m) {
    const gltf::Mesh &a = got.meshes[m], &b = expected.meshes[m];
    EXPECT_EQ(a.positions, b.positions);
    EXPECT_EQ(a.colors, b.colors);
    EXPECT_EQ(a.uvs, b.uvs);
    EXPECT_EQ(a.normals, b.normals);
    EXPECT_EQ(a.influence_offsets, b.influence_offsets);
    ASSERT_EQ(a.influences.size(), b.influences.size());
    for (std::size_t i = 0; i < a.influences.size(); ++i) {
      EXPECT_EQ(a.influences[i].joint, b.influences[i].joint);
      EXPECT_EQ(a.influences[i].weight, b.influences[i].weight);
    }
    ASSERT_EQ(a.targets.size(), b.targets.size());
    for (std::size_t t = 0; t < a.targets.size(); ++t) {
      EXPECT_EQ(a.targets[t].vertices, b.targets[t].vertices);
      EXPECT_EQ(a.targets[t].deltas, b.targets[t].deltas);
    }
    ASSERT_EQ(a.primitives.size(), b.primitives.size());
    for (std::size_t p = 0; p < a.primitives.size(); ++p)
      EXPECT_EQ(a.primitives[p].triangles, b.primitives[p].triangles);
  }
  ASSERT_EQ(got.skins.size(), expected.skins.size());
  EXPECT_EQ(got.skins.at(0).inverse_bind_matrices, expected.skins.at(0).inverse_bind_matrices);
  ASSERT_EQ(got.clips.size(), expected.clips.size());
  EXPECT_EQ(got.clips.at(0).channels.at(0).times, expected.clips.at(0).channels.at(0).times);
  EXPECT_EQ(got.clips.at(0).channels.at(0).values, expected.clips.at(0).channels.at(0).values);
}

}  // namespace kpsa::engine
