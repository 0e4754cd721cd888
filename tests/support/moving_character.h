// A character whose clips a test makes up: a strip of 22 points along X on two joints, root
// and tip, that share it smoothly, and no clip. Nodes: 0 mesh, 1 root, 2 tip; 1 m long.
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "tests/support/gltf_builder.h"

namespace kpsa::engine {

struct MovingCharacter {
  static constexpr int kPoints = 22;
  GltfBuilder builder;

  MovingCharacter() {
    std::vector<float> positions, weights, bind(32, 0.0f);
    std::vector<std::uint8_t> joints;
    std::vector<std::uint16_t> indices;
    for (int i = 0; i < kPoints; ++i) {
      const float along = static_cast<float>(i / 2) / 10, tip = along > 0.5f ? 2 * along - 1 : 0;
      positions.insert(positions.end(), {along, static_cast<float>(i % 2) / 10, 0.05f * along * along});
      joints.insert(joints.end(), {0, 1, 0, 0});
      weights.insert(weights.end(), {1 - tip, tip, 0, 0});
      const auto corner = [&](int k) { indices.push_back(static_cast<std::uint16_t>(i + k)); };
      if (i + 2 < kPoints) corner(0), corner(1), corner(2);
    }
    for (std::size_t k = 0; k < 8; ++k) bind[16 * (k / 4) + 5 * (k % 4)] = 1;
    bind[16 + 12] = -0.5f;  // the tip stands at 0.5
    builder.Push("meshes", {{"name", "strip"},
                            {"primitives",
                             {{{"attributes",
                                {{"POSITION", builder.Accessor(positions, "VEC3")},
                                 {"JOINTS_0", builder.Accessor(joints, "VEC4")},
                                 {"WEIGHTS_0", builder.Accessor(weights, "VEC4")}}},
                               {"indices", builder.Accessor(indices, "SCALAR")}}}}});
    builder.Push("skins", {{"joints", {1, 2}}, {"inverseBindMatrices", builder.Accessor(bind, "MAT4")}});
    builder.Push("nodes", {{"name", "strip"}, {"mesh", 0}, {"skin", 0}});
    builder.Push("nodes", {{"name", "root"}, {"children", {2}}});
    builder.Push("nodes", {{"name", "tip"}, {"translation", {0.5, 0, 0}}});
    builder.Push("scenes", {{"nodes", {0, 1}}});
    builder.root["scene"] = 0;
  }
  // A channel of a node in a clip of that name, which is added where it is new. `path` is as
  // glTF has them.
  void Animate(const std::string& clip, int node, const char* path, const std::vector<float>& times,
               const std::vector<float>& values, const char* interpolation = "LINEAR") {
    const int input = builder.Accessor(times, "SCALAR");
    const int output = builder.Accessor(values, path == std::string("rotation")  ? "VEC4"
                                                : path == std::string("weights") ? "SCALAR"
                                                                                 : "VEC3");
    nlohmann::json* found = nullptr;
    for (nlohmann::json& known : builder.root["animations"]) {
      if (known["name"] == clip) found = &known;
    }
    if (found == nullptr) {
      builder.Push("animations", {{"name", clip}});
      found = &builder.root["animations"].back();
    }
    (*found)["samplers"].push_back({{"input", input}, {"output", output}, {"interpolation", interpolation}});
    (*found)["channels"].push_back(
        {{"sampler", (*found)["samplers"].size() - 1}, {"target", {{"node", node}, {"path", path}}}});
  }
  // The node swings to and fro about Z, `degrees` to both sides, once a second.
  void Swing(const std::string& clip, double degrees, double seconds, int node = 2) {
    std::vector<float> times, turns;
    for (int k = 0; k <= 8 * seconds; ++k) {
      const double half = degrees * 3.14159265358979 / 360 * std::sin(k * 3.14159265358979 / 4);
      times.push_back(static_cast<float>(k) / 8);
      turns.insert(turns.end(),
                   {0, 0, static_cast<float>(std::sin(half)), static_cast<float>(std::cos(half))});
    }
    Animate(clip, node, "rotation", times, turns);
  }
};

}  // namespace kpsa::engine
