// A cube from -1 to 1 that a morph target shears along x: node and mesh "cube", a clip of a second to all of it.
#pragma once

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/gltf_builder.h"

namespace kpsa::engine {

enum class CubeEdges {
  kHard,    // 24 vertices with the normals of their faces
  kSmooth,  // 24 vertices with those of their corners
  kNone     // 8 vertices without any: flat, as glTF has it
};

inline GltfBuilder CubeCharacter(CubeEdges edges) {
  GltfBuilder b;
  std::vector<float> positions, normals, deltas;
  std::vector<std::uint16_t> indices;
  const auto vertex = [&](float x, float y, float z) {
    positions.insert(positions.end(), {x, y, z});
    deltas.insert(deltas.end(), {y > 0 ? 1.0f : 0.0f, 0, 0});
  };
  for (int axis = 0; axis < 3; ++axis) {
    for (const float side : {-1.0f, 1.0f}) {
      const auto first = static_cast<std::uint16_t>(positions.size() / 3);
      for (const auto& [s, t] : {std::pair{-1.0f, -1.0f}, {1.0f, -1.0f}, {1.0f, 1.0f}, {-1.0f, 1.0f}}) {
        float p[3];
        p[axis] = side, p[(axis + 1) % 3] = s * side, p[(axis + 2) % 3] = t;
        vertex(p[0], p[1], p[2]);
        const std::size_t at = normals.size();
        normals.insert(normals.end(), {0, 0, 0});
        if (edges == CubeEdges::kHard) normals[at + static_cast<std::size_t>(axis)] = side;
        for (std::size_t k = 0; k < 3 && edges == CubeEdges::kSmooth; ++k) normals[at + k] = p[k] * 0.57735f;
      }
      for (const int corner : {0, 1, 2, 0, 2, 3})
        indices.push_back(static_cast<std::uint16_t>(first + corner));
    }
  }
  if (edges == CubeEdges::kNone) {
    std::vector<float> eight;
    std::vector<std::uint16_t> joined;
    for (const std::uint16_t v : indices) {
      std::uint16_t same = 0;
      while (3 * same < eight.size() &&
             !std::equal(&eight[3 * same], &eight[3 * same] + 3, &positions[3 * v]))
        ++same;
      if (3 * same == eight.size()) eight.insert(eight.end(), &positions[3 * v], &positions[3 * v] + 3);
      joined.push_back(same);
    }
    indices = joined, positions = eight;
    deltas.clear();
    for (std::size_t i = 0; i < positions.size(); i += 3)
      deltas.insert(deltas.end(), {positions[i + 1] > 0 ? 1.0f : 0.0f, 0, 0});
  }
  nlohmann::json attributes = {{"POSITION", b.Accessor(positions, "VEC3")}};
  if (edges != CubeEdges::kNone) attributes["NORMAL"] = b.Accessor(normals, "VEC3");
  b.Push("meshes", {{"name", "cube"},
                    {"primitives",
                     {{{"attributes", attributes},
                       {"indices", b.Accessor(indices, "SCALAR")},
                       {"targets", {{{"POSITION", b.Accessor(deltas, "VEC3")}}}}}}}});
  b.Push("nodes", {{"name", "cube"}, {"mesh", 0}});
  b.Push("scenes", {{"nodes", {0}}});
  const int times = b.Accessor<float>({0, 1}, "SCALAR"), weights = b.Accessor<float>({0, 1}, "SCALAR");
  b.Push("animations", {{"name", "shear"},
                        {"samplers", {{{"input", times}, {"output", weights}}}},
                        {"channels", {{{"sampler", 0}, {"target", {{"node", 0}, {"path", "weights"}}}}}}});
  return b;
}

}  // namespace kpsa::engine
