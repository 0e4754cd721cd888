#include "bench/growth_rig.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>

#include "base/scalar_math.h"
#include "scenes/glb_writer.h"

namespace kpsa::engine::growth {
namespace {

using scenes::Float3;

constexpr double kSide = 1;  // metres
constexpr int kFrames = 49, kChildren = 4;

struct Sheet {
  std::size_t across = 2, down = 2;  // points
  explicit Sheet(std::size_t points) {
    across = std::max<std::size_t>(2, static_cast<std::size_t>(std::sqrt(static_cast<double>(points))));
    down = std::max<std::size_t>(2, (points + across - 1) / across);
  }
  std::size_t points() const { return across * down; }
  Float3 At(std::size_t i) const {
    const double x = static_cast<double>(i % across) / static_cast<double>(across - 1),
                 z = static_cast<double>(i / across) / static_cast<double>(down - 1);
    return {static_cast<float>(kSide * x),
            static_cast<float>(0.05 * std::sin(19 * x + 3 * z) * std::cos(13 * z)),
            static_cast<float>(kSide * z)};
  }
};

// The joint that has most of a point.
std::size_t JointOf(std::size_t point, const Sheet& sheet, std::size_t joints) {
  return std::min(joints - 1, point * joints / sheet.points());
}

scenes::GlbMesh MakeMesh(const RigSize& size, const Sheet& sheet) {
  scenes::GlbMesh mesh;
  mesh.name = "sheet";
  std::vector<std::array<int, 4>> quads;
  for (std::size_t i = 0; i < sheet.points(); ++i) {
    mesh.positions.push_back(sheet.At(i));
    mesh.normals.push_back({0, 1, 0});
    const std::size_t first = JointOf(i, sheet, size.joints), second = (first + 1) % size.joints;
    scenes::Influences& influences = mesh.influences.emplace_back();
    influences.joints = {static_cast<std::uint16_t>(first), static_cast<std::uint16_t>(second)};
    if (size.joints > 1) influences.weights = {0.75f, 0.25f};
    if (i % sheet.across + 1 < sheet.across && i + sheet.across < sheet.points()) {
      const int a = static_cast<int>(i), below = static_cast<int>(i + sheet.across);
      quads.push_back({a, below, below + 1, a + 1});
    }
  }
  mesh.triangles = scenes::Triangulate(quads);
  for (std::size_t s = 0; s < size.shapes; ++s) {
    scenes::SparseTarget& target = mesh.targets.emplace_back();
    target.name = fmt::format("shape{}", s);
    const std::size_t begin = s * sheet.points() / size.shapes, end = (s + 1) * sheet.points() / size.shapes;
    for (std::size_t i = begin; i < end; ++i) {
      const double t = static_cast<double>(i - begin) / static_cast<double>(end - begin);
      target.points.push_back(static_cast<Index>(i));
      target.deltas.push_back({0, static_cast<float>(0.1 * std::sin(kPi * t)), 0});
    }
  }
  return mesh;
}

scenes::GlbScene MakeScene(const RigSize& size, const Sheet& sheet) {
  scenes::GlbScene scene;
  scenes::GlbClip clip{"wave", kFrames, {}};
  for (std::size_t j = 0; j < size.joints; ++j) {
    scenes::GlbNode& node = scene.nodes.emplace_back();
    node.name = fmt::format("j{}", j);
    node.parent = j == 0 ? -1 : static_cast<int>((j - 1) / kChildren);
    node.translation = {j == 0 ? 0 : 0.01, 0, 0};
    scene.joints.push_back(static_cast<int>(j));
    scenes::GlbChannel& turn = clip.channels.emplace_back();
    turn.node = static_cast<int>(j);
    for (int f = 0; f < kFrames; ++f) {
      const double half = 0.1 * std::sin(2 * kPi * f / (kFrames - 1) + static_cast<double>(j % 7)) / 2;
      for (const double v : {std::sin(half), 0.0, 0.0, std::cos(half)})
        turn.values.push_back(static_cast<float>(v));
    }
  }
  scene.nodes.emplace_back().name = "sheet";
  scene.nodes.back().mesh = 0;
  scene.meshes.push_back(MakeMesh(size, sheet));
  scene.clips.push_back(std::move(clip));
  return scene;
}

std::string RigText(const RigSize& size) {
  std::string text = "kpsa: 1\nunits: {length: m}\ncharacter: sheet.glb\n",
              stack = size.shapes > 0 ? "morph, skin" : "skin";
  std::string nodes, connections, controls;
  for (std::size_t n = 0; n < size.nodes; ++n)
    nodes += fmt::format(
        "  n{}: {{type: remapValue, inputMin: -1, inputMax: 1, outputMin: -1, outputMax: 1}}\n", n);
  for (std::size_t n = 1; n < size.nodes; ++n)
    connections += fmt::format("  - n{}.outValue -> n{}.inputValue\n", n - 1, n);
  if (size.nodes > 0) {
    nodes += "  roll: {type: transform, parent: j0}\n  move: {type: cluster, matrix: roll.worldMatrix}\n";
    connections += fmt::format("  - n{}.outValue -> roll.translateY\n", size.nodes - 1);
    controls += "  n0.inputValue: {min: -1, max: 1}\n";
    stack += ", move";
  }
  if (size.vertices > 0) {
    nodes += "  line: {type: curve, places: [";
    for (std::size_t v = 0; v < size.vertices; ++v)
      nodes += fmt::format(
          "{}[{:.9g}, 0, 0.5]", v == 0 ? "" : ", ",
          kSide * static_cast<double>(v) / static_cast<double>(std::max<std::size_t>(1, size.vertices - 1)));
    nodes += "]}\n  follow: {type: wire, curve: line, dropoff: 0.3}\n";
    for (std::size_t h = 0; h < 8; ++h) nodes += fmt::format("  h{}: {{type: transform}}\n", h);
    for (std::size_t v = 0; v < size.vertices; ++v)
      connections += fmt::format("  - h{}.translate -> line.cv[{}]\n", v * 8 / size.vertices, v);
    for (std::size_t h = 0; h < 8; ++h)
      controls += fmt::format("  h{}.translateY: {{min: -0.1, max: 0.1}}\n", h);
    stack += ", follow";
  }
  if (size.mush) nodes += "  mush: {type: deltaMush, iterations: 10}\n", stack += ", mush";
  for (std::size_t s = 0; s < size.shapes; ++s)
    controls += fmt::format("  sheet.weight[shape{}]: {{min: 0, max: 1}}\n", s);
  if (!nodes.empty()) text += "nodes:\n" + nodes;
  if (!connections.empty()) text += "connections:\n" + connections;
  text += fmt::format("deform:\n  - {{meshes: [sheet], stack: [{}]}}\n", stack);
  if (!controls.empty()) text += "controls:\n" + controls;
  if (!size.train.empty())
    text += fmt::format(
        "accelerate:\n  sheet: {{points: [sheet@{}], subspace: rig.kpsa, tolerance: 1mm, train: {{{}}}}}\n",
        stack.substr(stack.rfind(' ') + 1), size.train);
  return text;
}

Status WriteBytes(const std::string& path, const std::string& bytes) {
  std::ofstream file(path, std::ios::binary);
  file << bytes;
  if (!file.flush()) return Status::Invalid("cannot be written").At({path});
  return Status();
}

}  // namespace

Result<std::string> WriteRig(const RigSize& size, const std::string& folder) {
  if (size.joints < 1 || size.joints > 65536)
    return Status::Usage("{} joints: expected 1 to 65,536", size.joints);
  const Sheet sheet(std::max(size.points, size.joints));
  KPSA_RETURN_IF_ERROR(WriteBytes(folder + "/sheet.glb", scenes::WriteGlb(MakeScene(size, sheet))));
  const std::string path = folder + "/rig.yaml";
  KPSA_RETURN_IF_ERROR(WriteBytes(path, RigText(size)));
  return path;
}

}  // namespace kpsa::engine::growth
