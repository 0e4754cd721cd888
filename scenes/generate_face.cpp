// Puts a head's files together: the .glb, the rig's curves, the weight maps.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "scenes/face_model.h"
#include "scenes/weight_maps.h"

namespace kpsa::engine::scenes {
namespace {

constexpr double kSmallestDelta = 2e-4;  // cm; expressions leave out less

// The skin's, with tinted lips.
std::vector<std::array<std::uint8_t, 4>> SkinColors(const HeadDesign& design, const HeadShape& shape) {
  std::vector<Double3> colors;
  for (std::size_t i = 0; i < shape.points.size(); ++i) {
    const Double3 p = shape.points[i];
    const Double3 color = design.color({std::fabs(p.x), p.y, p.z}, shape.ear[i]);
    colors.push_back(design.ear.pointed && shape.ear_inside[i] ? design.inner_ear_color : color);
  }
  const auto border = static_cast<std::size_t>(shape.border_ring);
  for (std::size_t ring = border; ring < shape.mouth_rings.size(); ++ring) {
    const double lip = ring == border ? design.lip_tint : 1.0;
    for (int i : shape.mouth_rings[ring]) {
      Double3& c = colors[static_cast<std::size_t>(i)];
      c = ring > static_cast<std::size_t>(shape.contact_ring) ? design.mouth_color
                                                              : Mix(c, design.lip_color, lip);
    }
  }
  std::vector<std::array<std::uint8_t, 4>> out;
  for (const Double3& c : colors) out.push_back(Color(c));
  return out;
}

Influences InfluencesOf(const HeadDesign& design, const std::array<double, kJointCount>& weights) {
  return MakeInfluences(std::span(weights.data(), design.joints.size()));
}

GlbMesh FaceMesh(const HeadDesign& design, const HeadShape& shape, const std::vector<Expression>& expressions,
                 const std::vector<std::array<double, kJointCount>>& joint_weights) {
  GlbMesh mesh;
  mesh.name = "face_mesh";
  for (const Double3& p : shape.points) mesh.positions.push_back(ToMetres(p));
  mesh.triangles = Triangulate(shape.quads);
  mesh.normals = SmoothNormals(mesh.positions, mesh.triangles);
  mesh.colors = SkinColors(design, shape);
  for (const auto& weights : joint_weights) mesh.influences.push_back(InfluencesOf(design, weights));
  for (const Expression& expression : expressions)
    mesh.targets.push_back(TargetOf(expression, kSmallestDelta));
  return mesh;
}

// A sheet moves with the joints of the skin above it.
GlbMesh SheetMesh(const HeadDesign& design, Sheet sheet, const HeadShape& shape,
                  const std::vector<std::array<double, kJointCount>>& joint_weights) {
  const SheetShape muscles = MakeSheet(design, sheet);
  GlbMesh mesh;
  mesh.name = NameOf(sheet);
  for (const Double3& p : muscles.points) {
    mesh.positions.push_back(ToMetres(p));
    mesh.colors.push_back(Color({0.35, 0.07, 0.06}));
    std::size_t nearest = 0;
    for (std::size_t i = 0; i < shape.points.size(); ++i) {
      if (Length(shape.points[i] - p) < Length(shape.points[nearest] - p)) nearest = i;
    }
    mesh.influences.push_back(InfluencesOf(design, joint_weights[nearest]));
  }
  mesh.triangles = Triangulate(muscles.quads);
  mesh.normals = SmoothNormals(mesh.positions, mesh.triangles);
  for (const Expression& pull : muscles.pulls) mesh.targets.push_back(TargetOf(pull, kSmallestDelta));
  return mesh;
}

GlbMesh EyesMesh(const HeadDesign& design) {
  const EyeShape eye = MakeEyeShape(design);
  const Double3 center = design.eye_center;
  const Double3 colors[] = {{0.80, 0.77, 0.74}, design.iris_color, {0.01, 0.01, 0.01}};
  GlbMesh mesh;
  mesh.name = "eyes";
  for (double side : {1.0, -1.0}) {
    const auto base = static_cast<Index>(mesh.positions.size());
    std::array<double, kJointCount> weights = {};
    weights[side > 0 ? kEyeL : kEyeR] = 1;
    for (std::size_t i = 0; i < eye.points.size(); ++i) {
      mesh.positions.push_back(ToMetres(eye.points[i] + Double3{side * center.x, center.y, center.z}));
      mesh.colors.push_back(Color(colors[eye.part[i]]));
      mesh.influences.push_back(InfluencesOf(design, weights));
    }
    for (Index index : Triangulate(eye.quads)) mesh.triangles.push_back(base + index);
  }
  mesh.normals = SmoothNormals(mesh.positions, mesh.triangles);
  return mesh;
}

}  // namespace

SceneFiles GenerateHead(const HeadDesign& design, const HeadShape& shape) {
  const std::vector<Expression> expressions = FaceExpressions(design, shape);
  const auto joint_weights = FaceWeights(design, shape);
  GlbScene scene;
  for (const JointRest& joint : design.joints) {
    Double3 at = joint.position;
    if (joint.parent >= 0) at = at - design.joints[static_cast<std::size_t>(joint.parent)].position;
    scene.joints.push_back(static_cast<int>(scene.nodes.size()));
    scene.nodes.push_back({joint.name, joint.parent, at * kMetres, -1});
  }
  const int mesh_node = static_cast<int>(scene.nodes.size());
  scene.nodes.push_back({"face_mesh", -1, {}, 0});
  scene.nodes.push_back({"eyes", -1, {}, 1});
  scene.meshes = {FaceMesh(design, shape, expressions, joint_weights), EyesMesh(design)};
  if (design.production) {
    for (const Sheet sheet : kSheets) {
      scene.nodes.push_back({NameOf(sheet), -1, {}, static_cast<int>(scene.meshes.size()), true});
      scene.meshes.push_back(SheetMesh(design, sheet, shape, joint_weights));
    }
  }
  std::vector<std::string> names;
  for (const Expression& expression : expressions) names.push_back(expression.name);
  scene.clips = FaceClips(design, names, mesh_node);
  return {{design.name + ".glb", WriteGlb(scene)},
          {design.name + "_curves.yaml", CurvesYaml(design, shape)},
          {"w/" + design.name + ".json",
           WeightsJson("face_mesh", FaceWeightMaps(design, shape), shape.points.size())}};
}

}  // namespace kpsa::engine::scenes
