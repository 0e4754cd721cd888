// Writes the few parts of glTF 2.0 that the generated characters need: a binary file with one buffer, meshes
// with sparse morph targets, a skin, LINEAR clips. The same calls give the same bytes.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/types.h"

namespace kpsa::engine::scenes {

using Float3 = std::array<float, 3>;

// The displacements of some points of a mesh, ascending by point.
struct SparseTarget {
  std::string name;
  std::vector<Index> points;
  std::vector<Float3> deltas;
};

// Up to four joints a point; the weights of a point add up to exactly 1.
struct Influences {
  std::array<std::uint16_t, 4> joints = {0, 0, 0, 0};
  std::array<float, 4> weights = {1, 0, 0, 0};
};

struct GlbMesh {
  std::string name;
  std::vector<Float3> positions, normals;
  std::vector<std::array<std::uint8_t, 4>> colors;  // linear, normalised
  std::vector<Influences> influences;
  std::vector<Index> triangles;
  std::vector<SparseTarget> targets;
  std::optional<Float3> base_color;  // of a material of its own, linear; else the plain one
};

struct GlbNode {
  std::string name;
  int parent = -1;  // an earlier node
  Double3 translation;
  int mesh = -1;        // skinned by the skin
  bool hidden = false;  // KHR_node_visibility: a cage that others follow
  Quaternion rotation = {};
};

inline constexpr double kFramesPerSecond = 24;  // of the scenes' clips

// Values at each frame: rotations are x y z w, weights one a target, translations x y z.
struct GlbChannel {
  int node = 0;
  bool weights = false;
  std::vector<float> values;
  bool translation = false;
};
struct GlbClip {
  std::string name;
  int frames = 0;  // keys at f / frames_per_second
  std::vector<GlbChannel> channels;
  double frames_per_second = kFramesPerSecond;
};

struct GlbScene {
  std::vector<GlbNode> nodes;
  std::vector<GlbMesh> meshes;
  std::vector<int> joints;  // nodes, in the order of Influences::joints
  std::vector<GlbClip> clips;
};

// The bytes of the .glb file.
std::string WriteGlb(const GlbScene& scene);

// Area-weighted unit normals.
std::vector<Float3> SmoothNormals(std::span<const Float3> positions, std::span<const Index> triangles);

// Splits quads along their first diagonal; a quad that repeats its last point is one triangle.
std::vector<Index> Triangulate(std::span<const std::array<int, 4>> quads);

// Shapes are made in centimetres, files are in metres.
inline constexpr double kMetres = 0.01;
Float3 ToMetres(Double3 centimetres);
// A linear colour, opaque.
std::array<std::uint8_t, 4> Color(Double3 linear);

// Weights rounded to multiples of 1/4096 that add up to 1 exactly; the four largest are kept.
Influences MakeInfluences(std::span<const double> weight_of_joint);

}  // namespace kpsa::engine::scenes
