// A character of any size: a sheet of points, a metre wide and high, on columns of joints that hang from one
// root. Points share the four joints about them. Nodes: 0 root, 1.. the joints, column by column, last the
// mesh.
#pragma once

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "tests/support/gltf_builder.h"

namespace kpsa::engine {

struct SheetCharacter {
  GltfBuilder builder;
  int joints = 0;  // without the root

  // points: side * side; columns of `length` joints.
  SheetCharacter(int side, int columns, int length) : joints(columns * length) {
    const auto place = [](int number, int of) {
      return (static_cast<float>(number) + 0.5f) / static_cast<float>(of);
    };
    std::vector<float> positions, weights, bind;
    std::vector<std::uint16_t> influences;
    std::vector<std::uint32_t> indices;
    for (int p = 0; p < side * side; ++p) {
      const float x = place(p % side, side), y = place(p / side, side);
      positions.insert(positions.end(), {x, -y, 0.02f * std::sin(9 * x)});
      const float column = std::clamp(x * static_cast<float>(columns) - 0.5f, 0.0f,
                                      static_cast<float>(columns - 1)),
                  row =
                      std::clamp(y * static_cast<float>(length) - 0.5f, 0.0f, static_cast<float>(length - 1));
      for (const int c : {0, 1}) {
        for (const int r : {0, 1}) {
          const int at_column = std::min(static_cast<int>(column) + c, columns - 1),
                    at_row = std::min(static_cast<int>(row) + r, length - 1);
          const float right = column - std::floor(column), below = row - std::floor(row);
          influences.push_back(static_cast<std::uint16_t>(1 + at_column * length + at_row));
          weights.push_back((c == 1 ? right : 1 - right) * (r == 1 ? below : 1 - below));
        }
      }
      if (p % side + 1 == side || p / side + 1 == side) continue;
      for (const int corner : {0, side, 1, 1, side, side + 1})
        indices.push_back(static_cast<std::uint32_t>(p + corner));
    }
    std::vector<int> skin;
    builder.Push("nodes", {{"name", "root"}});
    for (int j = 0; j <= joints; ++j) {
      skin.push_back(j);
      const int column = (j - 1) / length, row = (j - 1) % length;
      const float x = j == 0 ? 0 : place(column, columns), y = j == 0 ? 0 : -place(row, length);
      bind.insert(bind.end(), {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, -x, -y, 0, 1});
      if (j == 0) continue;
      const float from_y = row == 0 ? 0 : -place(row - 1, length);
      builder.Push("nodes",
                   {{"name", "j" + std::to_string(j)}, {"translation", {row == 0 ? x : 0, y - from_y, 0}}});
      builder.root["nodes"][static_cast<std::size_t>(row == 0 ? 0 : j - 1)]["children"].push_back(j);
    }
    builder.Push("meshes", {{"name", "sheet"},
                            {"primitives",
                             {{{"attributes",
                                {{"POSITION", builder.Accessor(positions, "VEC3")},
                                 {"JOINTS_0", builder.Accessor(influences, "VEC4")},
                                 {"WEIGHTS_0", builder.Accessor(weights, "VEC4")}}},
                               {"indices", builder.Accessor(indices, "SCALAR")}}}}});
    builder.Push("skins", {{"joints", skin}, {"inverseBindMatrices", builder.Accessor(bind, "MAT4")}});
    builder.Push("nodes", {{"name", "sheet"}, {"mesh", 0}, {"skin", 0}});
    builder.Push("scenes", {{"nodes", {0, joints + 1}}});
    builder.root["scene"] = 0;
  }

  // A clip of `frames` at 30 a second in which every joint swings about X and Z by up to `angle` (radians),
  // each in a rhythm of its own. Angle 0: it stands still.
  void Swing(const std::string& name, int frames, float angle) {
    std::vector<float> times;
    for (int f = 0; f < frames; ++f) times.push_back(static_cast<float>(f) / 30);
    const int input = builder.Accessor(times, "SCALAR");
    nlohmann::json clip = {{"name", name}};
    for (int j = 1; j <= joints; ++j) {
      std::vector<float> turns;
      const auto own = static_cast<float>(j);
      for (const float time : times) {
        const float x = 0.5f * angle * std::sin((2 + std::fmod(own * 0.37f, 1.0f)) * time + own),
                    z = 0.25f * angle * std::sin((1 + std::fmod(own * 0.61f, 1.0f)) * time + 2 * own);
        turns.insert(turns.end(), {std::sin(x), 0, std::sin(z),
                                   std::sqrt(1 - std::sin(x) * std::sin(x) - std::sin(z) * std::sin(z))});
      }
      clip["samplers"].push_back(
          {{"input", input}, {"output", builder.Accessor(turns, "VEC4")}, {"interpolation", "LINEAR"}});
      clip["channels"].push_back({{"sampler", j - 1}, {"target", {{"node", j}, {"path", "rotation"}}}});
    }
    builder.Push("animations", clip);
  }
};

}  // namespace kpsa::engine
