// Puts the face's files together: face.glb, the rig's curves, the weight maps.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "scenes/face_model.h"

namespace kpsa::scenes {
namespace {

constexpr double kMetres = 0.01;          // of the centimetres that shapes are made in
constexpr double kSmallestDelta = 2e-4;   // cm; expressions leave out less
constexpr double kSmallestWeight = 1e-3;  // of a weight map

Float3 ToMetres(Double3 p) {
  return {static_cast<float>(p.x * kMetres), static_cast<float>(p.y * kMetres),
          static_cast<float>(p.z * kMetres)};
}

std::array<std::uint8_t, 4> Color(Double3 linear) {
  const auto byte = [](double v) {
    return static_cast<std::uint8_t>(std::floor(255 * std::clamp(v, 0.0, 1.0) + 0.5));
  };
  return {byte(linear.x), byte(linear.y), byte(linear.z), 255};
}

// Skin with a tint on lips, cheeks and nose, darker brows.
std::vector<std::array<std::uint8_t, 4>> SkinColors(const HeadShape& shape) {
  constexpr Double3 kSkin = {0.62, 0.43, 0.34}, kLip = {0.50, 0.21, 0.19}, kFlush = {0.62, 0.34, 0.27};
  constexpr Double3 kBrow = {0.11, 0.07, 0.05}, kMouth = {0.25, 0.07, 0.06};
  const auto mix = [](Double3 a, Double3 b, double t) { return a * (1 - t) + b * t; };
  std::vector<Double3> colors;
  for (const Double3& p : shape.points) {
    const Double3 q = {std::fabs(p.x), p.y, p.z};
    const double cheek = Bump(Length(q - Double3{4.3, 15.2, 6.6}), 2.8),
                 nose = Bump(Length(q - Double3{0, 14.8, 11.0}), 1.8);
    const double arch =
        20.62 + 0.32 * Bump(q.x - 3.7, 2.4) - 0.25 * Smooth(4.2, 5.6, q.x);  // the brow's line
    const double brow =
        Bump(q.y - arch, 0.60) * Smooth(0.7, 1.6, q.x) * Smooth(5.7, 4.0, q.x) * Smooth(2, 4, p.z);
    colors.push_back(mix(mix(kSkin, kFlush, std::max(0.30 * cheek, 0.35 * nose)), kBrow, 0.9 * brow));
  }
  const auto border = static_cast<std::size_t>(shape.border_ring);
  for (std::size_t ring = border; ring < shape.mouth_rings.size(); ++ring) {
    const double lip = ring == border ? 0.55 : 1.0;
    for (int i : shape.mouth_rings[ring]) {
      Double3& c = colors[static_cast<std::size_t>(i)];
      c = ring > static_cast<std::size_t>(shape.contact_ring) ? kMouth : mix(c, kLip, lip);
    }
  }
  std::vector<std::array<std::uint8_t, 4>> out;
  for (const Double3& c : colors) out.push_back(Color(c));
  return out;
}

GlbMesh FaceMesh(const HeadShape& shape, const std::vector<Expression>& expressions) {
  GlbMesh mesh;
  mesh.name = "face_mesh";
  for (const Double3& p : shape.points) mesh.positions.push_back(ToMetres(p));
  mesh.triangles = Triangulate(shape.quads);
  mesh.normals = SmoothNormals(mesh.positions, mesh.triangles);
  mesh.colors = SkinColors(shape);
  for (const auto& weights : FaceWeights(shape)) mesh.influences.push_back(MakeInfluences(weights));
  for (const Expression& expression : expressions) {
    SparseTarget target = {expression.name, {}, {}};
    for (std::size_t i = 0; i < expression.deltas.size(); ++i) {
      if (Length(expression.deltas[i]) < kSmallestDelta) continue;
      target.points.push_back(static_cast<Index>(i));
      target.deltas.push_back(ToMetres(expression.deltas[i]));
    }
    mesh.targets.push_back(std::move(target));
  }
  return mesh;
}

GlbMesh EyesMesh() {
  const EyeShape eye = MakeEyeShape();
  constexpr Double3 kColors[] = {{0.80, 0.77, 0.74}, {0.10, 0.20, 0.28}, {0.01, 0.01, 0.01}};
  GlbMesh mesh;
  mesh.name = "eyes";
  for (double side : {1.0, -1.0}) {
    const auto base = static_cast<Index>(mesh.positions.size());
    std::array<double, kJointCount> weights = {};
    weights[side > 0 ? kEyeL : kEyeR] = 1;
    for (std::size_t i = 0; i < eye.points.size(); ++i) {
      mesh.positions.push_back(
          ToMetres(eye.points[i] + Double3{side * kEyeCenter.x, kEyeCenter.y, kEyeCenter.z}));
      mesh.colors.push_back(Color(kColors[eye.part[i]]));
      mesh.influences.push_back(MakeInfluences(weights));
    }
    for (Index index : Triangulate(eye.quads)) mesh.triangles.push_back(base + index);
  }
  mesh.normals = SmoothNormals(mesh.positions, mesh.triangles);
  return mesh;
}

// The point nearest to `at`; one on the middle of the face where `at` is.
int Nearest(const HeadShape& shape, Double3 at) {
  int best = 0;
  double least = 1e30;
  for (std::size_t i = 0; i < shape.points.size(); ++i) {
    const double distance = Length(shape.points[i] - at);
    if (distance >= least || (at.x == 0 && shape.points[i].x != 0)) continue;
    least = distance;
    best = static_cast<int>(i);
  }
  return best;
}

std::string CurvesYaml(const HeadShape& shape) {
  std::string out =
      "# Written by generate_scenes: the vertices that face.yaml's wires run along and its soft handles sit "
      "at.\n"
      "kpsa: 1\n"
      "nodes:\n";
  const auto curve = [&](const char* name, const std::vector<int>& points, const char* parent) {
    out += fmt::format("  {}: {{type: curve, mesh: face_mesh, vertices: [{}], parent: {}}}\n", name,
                       fmt::join(points, ", "), parent);
  };
  curve("upperLip", shape.upper_lip_curve, "head");
  curve("lowerLip", shape.lower_lip_curve, "jaw");
  curve("browL", shape.brow_curve_left, "head");
  curve("browR", shape.brow_curve_right, "head");
  const auto handle = [&](const char* name, int point, const char* parent) {
    out += fmt::format("  {}: {{type: transform, parent: {}, at: {{vertex: {}, mesh: face_mesh}}}}\n", name,
                       parent, point);
  };
  const int cheek = Nearest(shape, {4.4, 14.6, 6.8});
  handle("nose", Nearest(shape, {0, 14.8, 11.6}), "head");
  handle("chin", Nearest(shape, {0, 8.9, 8.8}), "jaw");
  handle("cheekL", cheek, "head");
  handle("cheekR", shape.mirror[static_cast<std::size_t>(cheek)], "head");
  return out;
}

std::string WeightsJson(const std::map<std::string, std::vector<double>>& maps, std::size_t points) {
  std::string out = fmt::format(
      "{{\"kpsa\": \"weights\", \"version\": 1, \"mesh\": \"face_mesh\", \"points\": {}, \"maps\": {{",
      points);
  bool first = true;
  for (const auto& [name, values] : maps) {
    // The commonest of 0 and 1 is the default
    const auto ones =
        std::count_if(values.begin(), values.end(), [](double v) { return v > 1 - kSmallestWeight; });
    const auto zeros =
        std::count_if(values.begin(), values.end(), [](double v) { return v < kSmallestWeight; });
    const double usual = ones > zeros ? 1 : 0;
    std::vector<std::string> indices, numbers;
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (std::fabs(values[i] - usual) < kSmallestWeight) continue;
      indices.push_back(fmt::format("{}", i));
      numbers.push_back(fmt::format("{:.4g}", values[i]));
    }
    out += fmt::format("{}\n  \"{}\": {{\"default\": {}, \"indices\": [{}], \"values\": [{}]}}",
                       first ? "" : ",", name, usual, fmt::join(indices, ","), fmt::join(numbers, ","));
    first = false;
  }
  return out + "\n}}\n";
}

}  // namespace

SceneFiles GenerateFace() {
  const HeadShape shape = MakeHeadShape();
  const std::vector<Expression> expressions = FaceExpressions(shape);
  GlbScene scene;
  for (const JointRest& joint : FaceJoints()) {
    Double3 at = joint.position;
    if (joint.parent >= 0) at = at - FaceJoints()[static_cast<std::size_t>(joint.parent)].position;
    scene.joints.push_back(static_cast<int>(scene.nodes.size()));
    scene.nodes.push_back({joint.name, joint.parent, at * kMetres, -1});
  }
  const int mesh_node = static_cast<int>(scene.nodes.size());
  scene.nodes.push_back({"face_mesh", -1, {}, 0});
  scene.nodes.push_back({"eyes", -1, {}, 1});
  scene.meshes = {FaceMesh(shape, expressions), EyesMesh()};
  std::vector<std::string> names;
  for (const Expression& expression : expressions) names.push_back(expression.name);
  scene.clips = FaceClips(names, mesh_node);
  return {{"face.glb", WriteGlb(scene)},
          {"face_curves.yaml", CurvesYaml(shape)},
          {"w/face.json", WeightsJson(FaceWeightMaps(shape), shape.points.size())}};
}

}  // namespace kpsa::scenes
