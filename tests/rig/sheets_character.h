// A character of sheets for deformers that follow meshes: `cage`, 9 x 9 points over [-1, 1]^2 at z = 0,
// skinned to root and tip (above x = 0); `shirt`, 5 x 5 points over [-0.8, 0.8]^2 at z = 0.1, with the same
// skin; `cloth`, like the shirt but without a skin, its node 1 m up along y; `thread`, whose only face has no
// area. All but the thread have texture coordinates, u along x and v along y.
#pragma once

#include <string>
#include <vector>

#include "tests/support/gltf_builder.h"

namespace kpsa::engine {

inline GltfBuilder SheetsCharacter() {
  GltfBuilder b;
  const auto sheet = [&](int n, float size, float height, bool skinned) {
    std::vector<float> xyz, weights, uvs;
    std::vector<std::uint8_t> joints;
    std::vector<std::uint16_t> corners;
    for (int v = 0; v < n; ++v) {
      for (int u = 0; u < n; ++u) {
        const float x = size * (2.0f * static_cast<float>(u) / static_cast<float>(n - 1) - 1);
        xyz.insert(xyz.end(),
                   {x, size * (2.0f * static_cast<float>(v) / static_cast<float>(n - 1) - 1), height});
        uvs.insert(uvs.end(), {static_cast<float>(u) / static_cast<float>(n - 1),
                               static_cast<float>(v) / static_cast<float>(n - 1)});
        joints.insert(joints.end(), {static_cast<std::uint8_t>(x > 0 ? 1 : 0), 0, 0, 0});
        weights.insert(weights.end(), {1, 0, 0, 0});
        if (u + 1 == n || v + 1 == n) continue;
        const auto a = static_cast<std::uint16_t>(u + n * v), c = static_cast<std::uint16_t>(a + n);
        const auto next = [](std::uint16_t i) { return static_cast<std::uint16_t>(i + 1); };
        corners.insert(corners.end(), {a, next(a), next(c), a, next(c), c});
      }
    }
    nlohmann::json attributes = {{"POSITION", b.Accessor(xyz, "VEC3")},
                                 {"TEXCOORD_0", b.Accessor(uvs, "VEC2")}};
    if (skinned) {
      attributes["JOINTS_0"] = b.Accessor(joints, "VEC4");
      attributes["WEIGHTS_0"] = b.Accessor(weights, "VEC4");
    }
    return b.Push("meshes", {{"primitives",
                              {{{"attributes", attributes}, {"indices", b.Accessor(corners, "SCALAR")}}}}});
  };
  const int cage = sheet(9, 1, 0, true), shirt = sheet(5, 0.8f, 0.1f, true),
            cloth = sheet(5, 0.8f, 0.1f, false);
  const int thread = b.Push(
      "meshes", {{"primitives",
                  {{{"attributes", {{"POSITION", b.Accessor<float>({0, 0, 0, 1, 0, 0, 2, 0, 0}, "VEC3")}}},
                    {"indices", b.Accessor<std::uint16_t>({0, 1, 1}, "SCALAR")}}}}});
  std::vector<float> matrices(32, 0.f);
  for (std::size_t i = 0; i < 2; ++i) {
    for (std::size_t k = 0; k < 4; ++k) matrices[16 * i + 5 * k] = 1;
  }
  b.Push("skins", {{"joints", {1, 2}}, {"inverseBindMatrices", b.Accessor(matrices, "MAT4")}});
  b.Push("nodes", {{"name", "cage"}, {"mesh", cage}, {"skin", 0}});
  b.Push("nodes", {{"name", "root"}, {"children", {2}}});
  b.Push("nodes", {{"name", "tip"}});
  b.Push("nodes", {{"name", "shirt"}, {"mesh", shirt}, {"skin", 0}});
  b.Push("nodes", {{"name", "cloth"}, {"mesh", cloth}, {"translation", {0, 1, 0}}});
  b.Push("nodes", {{"name", "thread"}, {"mesh", thread}});
  b.Push("scenes", {{"nodes", {0, 1, 3, 4, 5}}});
  b.root["scene"] = 0;
  return b;
}

}  // namespace kpsa::engine
