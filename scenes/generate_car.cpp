// Puts the car's files together: car.glb, the rig's curves, the weight maps.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/scalar_math.h"
#include "scenes/car_model.h"
#include "scenes/weight_maps.h"

namespace kpsa::engine::scenes::car {
namespace {

constexpr double kSmallestDelta = 0.02;  // cm

constexpr Double3 kPaint = {0.02, 0.30, 0.42}, kCream = {0.75, 0.62, 0.38}, kGlass = {0.03, 0.05, 0.07},
                  kChrome = {0.55, 0.57, 0.60}, kThroat = {0.22, 0.03, 0.03},
                  kBrowColor = {0.012, 0.02, 0.03}, kRubber = {0.02, 0.02, 0.022},
                  kWhite = {0.82, 0.82, 0.80}, kIris = {0.16, 0.30, 0.05}, kPupil = {0.004, 0.004, 0.004},
                  kLamp = {0.85, 0.80, 0.55};

// Paint with a cream flank, glass in the cabin, chrome lips, dark brows.
std::vector<Double3> BodyColors(const CarShape& shape) {
  const auto mix = [](Double3 a, Double3 b, double t) { return a * (1 - t) + b * t; };
  std::vector<Double3> colors;
  for (std::size_t i = 0; i < shape.points.size(); ++i) {
    const Double3 p = shape.points[i];
    const double x = std::fabs(p.x);
    Double3 c = mix(kPaint, kCream, Smooth(48, 37, p.y) * (shape.mouth[i] > 0 ? 0 : 1));
    const double cabin = Smooth(98, 103, p.y) * Smooth(146, 141, p.y);
    const double side = Smooth(52, 57, x) * Smooth(8, 0, p.z) * Smooth(-82, -74, p.z);
    const double rear = Smooth(-68, -76, p.z) * Smooth(46, 40, x);
    c = mix(c, kGlass, cabin * std::max(side, rear));
    const double brow = Smooth(4, 9, x) * Smooth(50, 44, x) * Smooth(143, 147, p.y) * Smooth(-9, -3, p.z) *
                        Smooth(13, 9, p.z);
    c = mix(c, kBrowColor, brow);
    if (shape.socket[i] > 0) c = mix(kPaint, kPaint * 0.45, shape.socket[i]);
    if (shape.mouth[i] > 0) c = mix(c, kChrome, Smooth(0.7, 0.95, shape.mouth[i]));
    if (shape.mouth[i] > 1.15) c = kThroat;
    colors.push_back(c);
  }
  return colors;
}

Influences Only(int joint) {
  JointShares weights = {};
  weights[static_cast<std::size_t>(joint)] = 1;
  return MakeInfluences(weights);
}

void AddTargets(const std::vector<Expression>& expressions, GlbMesh* mesh) {
  for (const Expression& expression : expressions)
    mesh->targets.push_back(TargetOf(expression, kSmallestDelta));
}

GlbMesh BodyMesh(const CarShape& shape, const std::vector<Expression>& expressions) {
  GlbMesh mesh;
  mesh.name = "car_body";
  for (const Double3& p : shape.points) mesh.positions.push_back(ToMetres(p));
  mesh.triangles = Triangulate(shape.quads);
  mesh.normals = SmoothNormals(mesh.positions, mesh.triangles);
  for (const Double3& c : BodyColors(shape)) mesh.colors.push_back(Color(c));
  for (const JointShares& weights : CarWeights(shape)) mesh.influences.push_back(MakeInfluences(weights));
  AddTargets(expressions, &mesh);
  return mesh;
}

// Cages lie under the shell, and as dark as the inside of the mouth.
GlbMesh CageMesh(const char* name, const CarCage& cage, const std::vector<Expression>& expressions) {
  GlbMesh mesh;
  mesh.name = name;
  for (const Double3& p : cage.points) {
    mesh.positions.push_back(ToMetres(p));
    mesh.colors.push_back(Color(kThroat * 0.4));
    JointShares weights = {};
    weights[kJaw] = JawField(p), weights[kBody] = 1 - weights[kJaw];
    mesh.influences.push_back(MakeInfluences(weights));
  }
  mesh.triangles = Triangulate(cage.quads);
  mesh.normals = SmoothNormals(mesh.positions, mesh.triangles);
  AddTargets(expressions, &mesh);
  return mesh;
}

// A surface of revolution about an axis: stations along it with a radius and a colour each, closed by a point
// at a radius of 0.
struct Station {
  double along, radius;
  Double3 color;
};
void AddTurned(Double3 at, Double3 axis, Double3 across, const std::vector<Station>& stations, int around,
               int joint, GlbMesh* mesh) {
  const Double3 other = Cross(axis, across);
  std::vector<std::array<int, 4>> quads;
  const auto base = static_cast<int>(mesh->positions.size());
  const auto add = [&](Double3 p, Double3 color) {
    mesh->positions.push_back(ToMetres(p));
    mesh->colors.push_back(Color(color));
    mesh->influences.push_back(Only(joint));
    return static_cast<int>(mesh->positions.size()) - 1;
  };
  std::vector<int> below;
  for (const Station& station : stations) {
    std::vector<int> ring;
    for (int k = 0; k < (station.radius == 0 ? 1 : around); ++k) {
      double sine, cosine;
      SinCos(2 * kPi * k / around, &sine, &cosine);
      ring.push_back(
          add(at + axis * station.along + (across * cosine + other * sine) * station.radius, station.color));
    }
    for (std::size_t k = 0; !below.empty() && k < static_cast<std::size_t>(around); ++k) {
      const std::size_t n = static_cast<std::size_t>(around), next = (k + 1) % n;
      const auto of = [](const std::vector<int>& r, std::size_t i) { return r.size() == 1 ? r[0] : r[i]; };
      if (below.size() == 1)
        quads.push_back({below[0], of(ring, next), of(ring, k), of(ring, k)});
      else if (ring.size() == 1)
        quads.push_back({of(below, k), of(below, next), ring[0], ring[0]});
      else
        quads.push_back({below[k], below[next], ring[next], ring[k]});
    }
    below = std::move(ring);
  }
  for (auto& q : quads) {
    for (int& i : q) i -= base;
  }
  for (Index index : Triangulate(quads)) mesh->triangles.push_back(static_cast<Index>(base) + index);
}

// Eyeballs, wheels and lamps: stiff parts with a joint each.
GlbMesh PartsMesh() {
  GlbMesh mesh;
  mesh.name = "car_parts";
  for (const double side : {1.0, -1.0}) {
    std::vector<Station> eye;
    constexpr double kAngles[] = {1.5, 0.95, 0.53, 0.48, 0.30, 0.25, 0.0};
    for (std::size_t k = 0; k < std::size(kAngles); ++k) {
      const Double3 color = k < 3 ? kWhite : k < 5 ? kIris : kPupil;
      eye.push_back({kEyeBall * Cos(kAngles[k]), kAngles[k] == 0 ? 0 : kEyeBall * Sin(kAngles[k]), color});
    }
    constexpr Double3 kLook = {0, 0.26, 0.9656};
    AddTurned({side * kEye.x, kEye.y, kEye.z}, kLook, {1, 0, 0}, eye, 16, side > 0 ? kEyeL : kEyeR, &mesh);
    AddTurned({side * 61, 68, 150}, {side * 0.34, 0.2, 0.918}, {0.9378, 0, side * -0.3473},
              {{4, 11, kChrome}, {8.5, 9, kLamp}, {11, 0, kLamp}}, 12, kBody, &mesh);
    for (const double end : {1.0, -1.0}) {
      const int joint = end > 0 ? (side > 0 ? kWheelFL : kWheelFR) : (side > 0 ? kWheelBL : kWheelBR);
      AddTurned({side * 70, kWheelAxle, end * kWheelAt}, {side, 0, 0}, {0, 1, 0},
                {{-10, 27, kRubber},
                 {8, kWheelAxle - 1, kRubber},
                 {11, 22, kRubber},
                 {9, 16, kChrome},
                 {12, 0, kChrome}},
                14, joint, &mesh);
    }
  }
  mesh.normals = SmoothNormals(mesh.positions, mesh.triangles);
  return mesh;
}

std::string CurvesYaml(const CarShape& shape) {
  std::string out =
      "# Written by generate_scenes: the vertices that the car's wires run along.\n"
      "kpsa: 1\n"
      "nodes:\n";
  for (const auto& [name, points] : shape.curves) {
    const char* parent = name == "lipLower"                                    ? "jaw"
                         : name.starts_with("lid") || name.starts_with("brow") ? "roof"
                                                                               : "body";
    out += fmt::format("  {}: {{type: curve, mesh: car_body, vertices: [{}], parent: {}}}\n", name,
                       fmt::join(points, ", "), parent);
  }
  return out;
}

}  // namespace
}  // namespace kpsa::engine::scenes::car

namespace kpsa::engine::scenes {

SceneFiles GenerateCar() {
  using namespace car;
  const CarShape shape = MakeCarShape();
  const CarCage muscles = MuscleCage();
  const std::vector<Expression> expressions = CarExpressions(shape), pulls = MuscleExpressions(muscles);
  GlbScene scene;
  for (const JointRest& joint : CarJoints()) {
    Double3 at = joint.position;
    if (joint.parent >= 0) at = at - CarJoints()[static_cast<std::size_t>(joint.parent)].position;
    scene.joints.push_back(static_cast<int>(scene.nodes.size()));
    scene.nodes.push_back({joint.name, joint.parent, at * kMetres, -1});
  }
  const int first = static_cast<int>(scene.nodes.size());
  constexpr std::size_t kFirstCage = 2;  // of these
  scene.meshes = {BodyMesh(shape, expressions),        PartsMesh(),
                  CageMesh("muscles", muscles, pulls), CageMesh("panels", PanelCage(), {}),
                  CageMesh("frame", FrameCage(), {}),  CageMesh("clay", ClayCage(), {})};
  for (std::size_t m = 0; m < scene.meshes.size(); ++m)
    scene.nodes.push_back({scene.meshes[m].name, -1, {}, static_cast<int>(m), m >= kFirstCage});
  const auto names = [](const std::vector<Expression>& list) {
    std::vector<std::string> out;
    for (const Expression& each : list) out.push_back(each.name);
    return out;
  };
  scene.clips = CarClips(names(expressions), first, names(pulls), first + static_cast<int>(kFirstCage));
  return {{"car.glb", WriteGlb(scene)},
          {"car_curves.yaml", CurvesYaml(shape)},
          {"w/car.json", WeightsJson("car_body", CarWeightMaps(shape), shape.points.size())}};
}

}  // namespace kpsa::engine::scenes
