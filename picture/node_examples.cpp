#include "picture/node_examples.h"

#include <algorithm>
#include <cmath>

#include "base/matrix.h"
#include "base/scalar_math.h"

namespace kpsa::engine {
namespace {

using ExampleSetting = NodeExample::Setting;

// Rows of points from a function of two numbers, 0 to 1; closed: the last column is followed by the first.
template <typename F>
ExampleShape ShapeOfRows(Index columns, Index rows, bool closed, F place) {
  Mesh::Data data;
  ExampleShape shape;
  std::vector<float> xyz;
  for (Index v = 0; v < rows; ++v) {
    for (Index u = 0; u < columns; ++u) {
      const Double3 p = place(static_cast<double>(u) / (closed ? columns : columns - 1),
                              static_cast<double>(v) / (rows - 1));
      for (int i = 0; i < 3; ++i) xyz.push_back(static_cast<float>(p[i]));
      if (v + 1 == rows || (u + 1 == columns && !closed)) continue;
      const Index next = (u + 1) % columns;
      const Index a = u + v * columns, b = next + v * columns, c = b + columns, d = a + columns;
      data.triangles.insert(data.triangles.end(), {a, b, c, a, c, d});
      const bool dark = (u / 2 + v / 2) % 2 == 0;
      shape.dark.insert(shape.dark.end(), {dark, dark});
    }
  }
  data.name = "shape";
  data.rest = PointBuffer::FromInterleaved(xyz);
  for (Index i = 0; i < data.rest.count(); ++i) data.vertex_to_point.push_back(i);
  shape.mesh = std::make_shared<const Mesh>(std::move(data));
  return shape;
}

ExampleShape ColumnShape() {
  return ShapeOfRows(24, 33, true, [](double u, double v) {
    return Double3{0.35 * Sin(2 * kPi * u), 2 * v - 1, 0.35 * Cos(2 * kPi * u)};
  });
}
ExampleShape SheetShape(double size = 1, double height = 0, Index n = 29) {
  return ShapeOfRows(n, n, false, [=](double u, double v) {
    return Double3{size * (2 * u - 1), height, size * (1 - 2 * v)};
  });
}
ExampleShape BallShape(double radius = 0.9) {
  return ShapeOfRows(28, 19, true, [=](double u, double v) {
    const double polar = kPi * (0.01 + 0.98 * v);
    return Double3{radius * Sin(polar) * Sin(2 * kPi * u), -radius * Cos(polar),
                   radius * Sin(polar) * Cos(2 * kPi * u)};
  });
}

Double3 RestOf(const ExampleShape& shape, Index p) {
  const ConstPointsView rest = shape.mesh->data().rest.view();
  return {rest.x[p], rest.y[p], rest.z[p]};
}
double Smooth(double t) {
  t = std::clamp(t, 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

template <typename F>
Value Weights(const ExampleShape& shape, F weight) {
  std::vector<float> weights;
  for (Index p = 0; p < shape.mesh->point_count(); ++p)
    weights.push_back(static_cast<float>(weight(RestOf(shape, p))));
  return std::make_shared<const WeightMap>(std::move(weights));
}

// Every point by the first joint and the second, whose share this is.
template <typename F>
Value TwoJoints(const ExampleShape& shape, F second) {
  std::vector<Index> offsets{0}, joints;
  std::vector<float> weights;
  for (Index p = 0; p < shape.mesh->point_count(); ++p) {
    const auto w = static_cast<float>(second(RestOf(shape, p)));
    joints.insert(joints.end(), {0, 1});
    weights.insert(weights.end(), {1 - w, w});
    offsets.push_back(static_cast<Index>(joints.size()));
  }
  return std::make_shared<const Influences>(std::move(offsets), std::move(joints), std::move(weights), 2);
}

// The ball's points moved onto a cube.
Value CubeTarget(const ExampleShape& shape) {
  MorphTargets::Target target{"cube", {}, {}};
  for (Index p = 0; p < shape.mesh->point_count(); ++p) {
    const Double3 at = RestOf(shape, p);
    const double most = std::max({std::fabs(at.x), std::fabs(at.y), std::fabs(at.z)});
    const Double3 delta = at * (0.72 / most) - at;
    target.points.push_back(p);
    for (int i = 0; i < 3; ++i) target.deltas.push_back(static_cast<float>(delta[i]));
  }
  return std::make_shared<const MorphTargets>(std::vector<MorphTargets::Target>{target},
                                              shape.mesh->point_count());
}

Value Offsets(const std::vector<float>& xyz) {
  return Value(PointBufferPtr(std::make_shared<PointBuffer>(PointBuffer::FromInterleaved(xyz))));
}
Matrix4 TurnZ(double radians) { return RotationFromEuler({0, 0, radians}, RotateOrder::kXyz); }

// A column whose upper half bends about its middle.
std::vector<ExampleSetting> BentBy(const ExampleShape& shape, double sharpness) {
  return {{"in.influences[0]", TwoJoints(shape, [=](Double3 p) { return Smooth(0.5 + sharpness * p.y); })},
          {"in.matrix[0]", Matrix4()},
          {"in.bindPreMatrix[0]", Matrix4()},
          {"in.bindPreMatrix[1]", Matrix4()}};
}

NodeExample OnColumn(const std::string& type, std::vector<ExampleSetting> pose) {
  return {.type = type, .shape = ColumnShape(), .pose = std::move(pose)};
}

// A sheet that lies on another one, which a wave lifts.
NodeExample OnWavingSheet(const std::string& type) {
  NodeExample e{.type = type, .shape = SheetShape(0.62, 0.14, 19)};
  e.driver = SheetShape(1, 0, 25);
  e.nodes = {{"driver", "mesh"}, {"lift", "sine"}};
  e.settings = {{"driver.mesh", e.driver.mesh},
                {"d.driverMesh", e.driver.mesh},
                {"lift.matrix", TurnZ(-kPi / 2)},
                {"lift.wavelength", 2.0}};
  e.pose = {{"lift.amplitude", 0.42}};
  e.connections = {{"driver.points", "lift.inPoints[0]"}, {"lift.outPoints[0]", "d.driverPoints"}};
  e.driver_points = "lift.outPoints[0]";
  return e;
}

}  // namespace

std::vector<NodeExample> NodeExamples() {
  std::vector<NodeExample> examples;
  const ExampleShape column = ColumnShape(), sheet = SheetShape(), ball = BallShape();
  const auto add = [&](NodeExample example) { examples.push_back(std::move(example)); };

  add(OnColumn("bend", {{"d.curvature", 0.9}}));
  add(OnColumn("twist", {{"d.startAngle", -1.2}, {"d.endAngle", 1.2}}));
  add(OnColumn("squash", {{"d.factor", -0.45}}));
  add(OnColumn("flare",
               {{"d.startFlareX", 0.6}, {"d.startFlareZ", 0.6}, {"d.endFlareX", 1.7}, {"d.endFlareZ", 1.7}}));
  add(OnColumn("sine", {{"d.amplitude", 0.22}}));
  add({.type = "wave", .shape = sheet, .pose = {{"d.amplitude", 0.12}}});
  add({.type = "cluster",
       .shape = sheet,
       .settings = {{"d.weights[0]", Weights(sheet, [](Double3 p) { return p.x > 0.05 ? 1.0 : 0.0; })}},
       .pose = {{"d.matrix", Translation({0, 0.35, 0})}}});
  add({.type = "softMod",
       .shape = sheet,
       .settings = {{"d.falloffCenter", Double3()}, {"d.falloffRadius", 0.85}},
       .pose = {{"d.matrix", Translation({0, 0.75, 0})}}});
  add({.type = "sculpt",
       .shape = sheet,
       .settings = {{"d.radius", 0.5},
                    {"d.mode", "stretch"},
                    {"d.dropoffDistance", 0.5},
                    {"d.stretchOrigin", Double3{0, -1, 0}}},
       .pose = {{"d.matrix", Translation({0, -0.1, 0})}}});
  {
    NodeExample e{.type = "lattice", .shape = column};
    e.settings = {{"d.divisions", std::vector<std::int64_t>{2, 3, 2}},
                  {"d.interpolation", "bernstein"},
                  {"d.boxMin", Double3{-0.36, -1.01, -0.36}},
                  {"d.boxMax", Double3{0.36, 1.01, 0.36}}};
    for (int s = 0; s < 2; ++s) {
      for (int u = 0; u < 2; ++u) {
        const std::string middle = "d.points[" + std::to_string(s) + ",1," + std::to_string(u) + "]";
        e.settings.push_back({middle, Double3{s == 0 ? -1.0 : 2.0, 0.5, u == 0 ? -1.0 : 2.0}});
      }
    }
    add(std::move(e));
  }
  {
    const auto curve = std::make_shared<const Curve>(
        std::vector<Double3>{{-1, 0, 0.2}, {-0.5, 0, -0.2}, {0, 0, 0.2}, {0.5, 0, -0.2}, {1, 0, 0.2}}, false);
    add({.type = "wire",
         .shape = sheet,
         .nodes = {{"c", "curve"}},
         .settings = {{"c.curve", curve},
                      {"d.curve", curve},
                      {"d.dropoff", 0.45},
                      {"c.cv", Offsets({0, 0.1f, 0, 0, 0.8f, 0, 0, 0.2f, 0, 0, 0.8f, 0, 0, 0.1f, 0})}},
         .connections = {{"c.displacements", "d.displacements"}}});
  }
  add({.type = "blendShape",
       .shape = ball,
       .settings = {{"d.targets[0]", CubeTarget(ball)}},
       .pose = {{"d.weight[0]", 1.0}}});
  {
    std::vector<ExampleSetting> settings = BentBy(column, 1.1);
    for (ExampleSetting& setting : settings) setting.first[0] = 'd', setting.first.erase(1, 1);
    add({.type = "skinCluster",
         .shape = column,
         .settings = std::move(settings),
         .pose = {{"d.matrix[1]", TurnZ(-1.3)}}});
  }
  add({.type = "transformGeometry",
       .shape = column,
       .pose = {{"d.matrix", Translation({0.2, 0.2, 0}) * TurnZ(-0.7) * Scaling({1, 0.7, 1})}}});
  add({.type = "deltaMush",
       .shape = column,
       .nodes = {{"in", "skinCluster"}},
       .settings = BentBy(column, 9),
       .pose = {{"in.matrix[1]", TurnZ(-1.4)}},
       .connections = {{"m.points", "in.inPoints[0]"}},
       .input = "in.outPoints[0]"});
  add({.type = "tension",
       .shape = column,
       .nodes = {{"in", "skinCluster"}},
       .settings =
           [&] {
             std::vector<ExampleSetting> settings = BentBy(column, 0.9);
             settings.push_back({"d.compressScale", 0.35});
             settings.push_back({"d.stretchScale", -0.2});
             return settings;
           }(),
       .pose = {{"in.matrix[1]", TurnZ(-1.1)}},
       .connections = {{"m.points", "in.inPoints[0]"}},
       .input = "in.outPoints[0]"});
  add(OnWavingSheet("wrap"));
  add(OnWavingSheet("proximityWrap"));
  {
    NodeExample e{.type = "shrinkWrap", .shape = SheetShape(0.75, 0.8, 25)};
    e.driver = BallShape(0.6);
    e.nodes = {{"driver", "mesh"}};
    e.settings = {{"driver.mesh", e.driver.mesh},
                  {"d.driverMesh", e.driver.mesh},
                  {"d.offset", 0.03},
                  {"d.projection", "parallelToAxis"},
                  {"d.reverse", true}};
    e.connections = {{"driver.points", "d.driverPoints"}};
    e.driver_points = "driver.points";
    add(std::move(e));
  }
  add({.type = "jiggle",
       .shape = column,
       .nodes = {{"in", "cluster"}},
       .settings = {{"d.weights[0]", Weights(column, [](Double3 p) { return Smooth((p.y + 1) / 2); })},
                    {"d.stiffness", 0.1}},
       .pose = {{"in.matrix", Translation({0.6, 0, 0})}, {"d.time", 1.0 / 24}},
       .connections = {{"m.points", "in.inPoints[0]"}},
       .input = "in.outPoints[0]"});
  add({.type = "tripwire", .shape = column});

  std::sort(examples.begin(), examples.end(),
            [](const NodeExample& a, const NodeExample& b) { return a.type < b.type; });
  return examples;
}

}  // namespace kpsa::engine
