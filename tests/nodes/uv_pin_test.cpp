// uvPin and follicle: frames on a moving mesh.
#include <cmath>
#include <limits>

#include "nodes/kernels/surface_pin.h"
#include "tests/nodes/driver_rig.h"
#include "tests/nodes/node_support.h"
#include "tests/support/instruction_count.h"

namespace kpsa::engine {
namespace {

constexpr float kNone = std::numeric_limits<float>::quiet_NaN();

// Coordinates of a mesh over [-1, 1]^2: u along x, v along y.
std::shared_ptr<const TriangleUvs> FlatUvs(const Mesh& mesh) {
  std::vector<float> values;
  const ConstPointsView rest = mesh.data().rest.view();
  for (const Index p : mesh.data().triangles)
    values.insert(values.end(), {(rest.x[p] + 1) / 2, (rest.y[p] + 1) / 2});
  return std::make_shared<const TriangleUvs>(std::move(values));
}

// A mesh that a matrix moves, and pins on it.
struct PinRig {
  TestGraph g{StandardNodes()};
  std::shared_ptr<const Mesh> mesh;

  explicit PinRig(std::shared_ptr<const Mesh> of, const char* type = "uvPin",
                  const std::vector<std::pair<std::string, Value>>& values = {})
      : mesh(std::move(of)) {
    g.add("mesh", "skin", {{"mesh", mesh}});
    g.add("transformGeometry", "move");
    g.add(type, "pin", {{"driverMesh", mesh}});
    if (!mesh->data().triangles.empty()) g.hold("pin.driverUvs", FlatUvs(*mesh));
    for (const auto& [name, value] : values) g.hold("pin." + name, value);
    g.connect("skin.points", "move.inPoints[0]");
    g.connect("move.outPoints[0]", "pin.driverPoints");
    g.vary("move.matrix");
  }
  void Put(int pin, double u, double v) {
    g.hold("pin.coordinateU[" + std::to_string(pin) + "]", u);
    g.hold("pin.coordinateV[" + std::to_string(pin) + "]", v);
  }
  Matrix4 Pin(int pin = 0) { return g.pull<Matrix4>("pin.outputMatrix[" + std::to_string(pin) + "]"); }
  Matrix4 PinAt(const Matrix4& motion, int pin = 0) {
    g.want("pin.outputMatrix[" + std::to_string(pin) + "]");
    g.set("move.matrix", motion);
    return Pin(pin);
  }
  std::string Error(const std::string& output = "outputMatrix[0]") {
    const Status status = g.try_pull("pin." + output);
    return status.ok() ? "no error" : status.ToString();
  }
  // The points that a step of the mesh computes.
  Index Demanded() const {
    Index most = 0;
    for (Index s = 0; s < g.plan->steps().size(); ++s) {
      if (g.plan->step_name(s) == std::string("move")) most = std::max(most, g.plan->infos()[s].points);
    }
    return most;
  }
};

std::shared_ptr<const Mesh> FlatSheet() {
  return GridMesh(3, 3, [](double, double) { return 0; });
}
double Bump(double x, double y) { return 0.3 * std::sin(2 * x) * std::cos(y) + 0.2 * x * y; }
std::shared_ptr<const Mesh> Hill() { return GridMesh(17, 15, Bump); }

TEST(UvPin, LiesAtItsCoordinateAlongTheNormalAndGrowingU) {
  PinRig rig(FlatSheet());
  rig.Put(0, 0.75, 0.5);
  Matrix4 expected = Translation({0.5, 0, 0});  // x stays x, y is the normal, z = x cross y
  expected(1, 1) = 0, expected(2, 1) = 1, expected(1, 2) = -1, expected(2, 2) = 0;
  EXPECT_LT(Apart(rig.Pin(), expected), 1e-12);
  rig.g.hold("pin.normalAxis", "-z");
  rig.g.hold("pin.tangentAxis", "y");
  const Matrix4 other = rig.Pin();
  EXPECT_LT(Apart(AxisOf(other, 2), {0, 0, -1}), 1e-12);
  EXPECT_LT(Apart(AxisOf(other, 1), {1, 0, 0}), 1e-12);
  EXPECT_LT(Apart(AxisOf(other, 0), {0, 1, 0}), 1e-12);  // y cross z
  // Coordinates that run the other way turn the tangent, not the normal
  std::vector<float> mirrored = FlatUvs(*rig.mesh)->values();
  for (std::size_t i = 0; i < mirrored.size(); i += 2) mirrored[i] = 1 - mirrored[i];
  rig.g.hold("pin.driverUvs", std::make_shared<const TriangleUvs>(mirrored));
  EXPECT_LT(Apart(AxisOf(rig.Pin(), 1), {-1, 0, 0}), 1e-12);
  EXPECT_LT(Apart(AxisOf(rig.Pin(), 2), {0, 0, -1}), 1e-12);
  EXPECT_LT(Apart(PlaceIn(rig.Pin()), {-0.5, 0, 0}), 1e-12);
}

// By a twin that solves for the coordinate in every triangle.
TEST(UvPin, FindsTheTriangleThatHoldsTheCoordinate) {
  PinRig rig(Hill());
  RandomFrames random(3);
  const std::vector<Index>& triangles = rig.mesh->data().triangles;
  const std::vector<Double3> points = ToDouble(rig.mesh->data().rest.view());
  for (int pin = 0; pin < 40; ++pin) {
    const double u = random.Number(0, 1), v = random.Number(0, 1);
    rig.Put(pin, u, v);
  }
  for (int pin = 0; pin < 40; ++pin) rig.g.want("pin.outputMatrix[" + std::to_string(pin) + "]");
  RandomFrames again(3);
  for (int pin = 0; pin < 40; ++pin) {
    const double x = 2 * again.Number(0, 1) - 1, y = 2 * again.Number(0, 1) - 1;
    double height = 1e9;
    for (std::size_t t = 0; t < triangles.size() && height > 1e8; t += 3) {
      const Double3 a = points[triangles[t]], b = points[triangles[t + 1]], c = points[triangles[t + 2]];
      const double area = (b.x - a.x) * (c.y - a.y) - (c.x - a.x) * (b.y - a.y);
      const double v = ((x - a.x) * (c.y - a.y) - (c.x - a.x) * (y - a.y)) / area;
      const double w = ((b.x - a.x) * (y - a.y) - (x - a.x) * (b.y - a.y)) / area;
      if (v >= 0 && w >= 0 && v + w <= 1) height = a.z + v * (b.z - a.z) + w * (c.z - a.z);
    }
    EXPECT_LT(Apart(PlaceIn(rig.Pin(pin)), {x, y, height}), 1e-6) << pin;
  }
}

TEST(UvPin, MovesRigidlyWithItsMesh) {
  PinRig rig(Hill());
  rig.Put(0, 0.3, 0.62);
  const Matrix4 rest = rig.Pin();
  RandomFrames random(7);
  for (int i = 0; i < 20; ++i) {
    const Matrix4 motion = random.Rigid(3);
    EXPECT_LT(Apart(rig.PinAt(motion), motion * rest), 5e-6);
  }
  // Scale goes into the place only
  const Matrix4 large = rig.PinAt(Scaling({2, 2, 2}));
  EXPECT_LT(Apart(PlaceIn(large), PlaceIn(rest) * 2), 1e-6);
  for (int axis = 0; axis < 3; ++axis) EXPECT_LT(Apart(AxisOf(large, axis), AxisOf(rest, axis)), 1e-6);
}

TEST(UvPin, DemandsTheCornersOfItsTriangleOnly) {
  PinRig rig(Hill());
  rig.Put(0, 0.3, 0.62);
  rig.Put(1, 0.8, 0.1);
  const Matrix4 motion = RandomFrames(11).Scaled();
  const Matrix4 one = rig.PinAt(motion);
  EXPECT_EQ(rig.Demanded(), 3u);
  rig.PinAt(motion, 1);
  EXPECT_EQ(rig.Demanded(), 6u);
  PinRig whole(Hill());
  whole.Put(0, 0.3, 0.62);
  whole.g.want("move.outPoints[0]");
  const Matrix4 same = whole.PinAt(motion);
  EXPECT_EQ(whole.Demanded(), whole.mesh->point_count());
  EXPECT_EQ(one, same);  // bit for bit
}

TEST(UvPin, TheFirstOfOverlappingTrianglesCountsAndTheNearestOutside) {
  const auto two = MeshOf({0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 5, 1, 0, 5, 0, 1, 5}, {0, 1, 2, 3, 4, 5});
  PinRig rig(two);
  const std::vector<float> same = {0, 0, 1, 0, 0, 1}, larger = {-1, -1, 3, -1, -1, 3},
                           none = {kNone, 0, 1, 0, 0, 1};
  const auto uvs = [&](const std::vector<float>& a, const std::vector<float>& b) {
    std::vector<float> all = a;
    all.insert(all.end(), b.begin(), b.end());
    rig.g.hold("pin.driverUvs", std::make_shared<const TriangleUvs>(all));
  };
  rig.Put(0, 0.25, 0.375);
  uvs(same, same);
  EXPECT_LT(Apart(PlaceIn(rig.Pin()), {0.25, 0.375, 0}), 1e-12);
  uvs(larger, same);
  EXPECT_NEAR(rig.Pin()(2, 3), 0, 1e-12);
  uvs(none, same);  // triangles without coordinates hold nothing
  EXPECT_LT(Apart(PlaceIn(rig.Pin()), {0.25, 0.375, 5}), 1e-12);
  uvs(same, {0, 1, 1, 0, 1, 1});
  rig.Put(0, 2, 0.25);  // outside of both: the edge of the second is nearest
  EXPECT_LT(Apart(PlaceIn(rig.Pin()), {0.75, 0.25, 5}), 1e-12);
  rig.Put(0, -3, -4);
  EXPECT_LT(Apart(PlaceIn(rig.Pin()), {0, 0, 0}), 1e-12);
}

// Triangles that overlap, share edges, have no area or no coordinates; against a look at each of them.
TEST(UvMap, FindsWhatALookAtAllTrianglesFinds) {
  RandomFrames random(21);
  std::vector<float> uvs;
  for (int t = 0; t < 400; ++t) {
    const double u = random.Number(0, 1), v = random.Number(0, 1), size = t % 17 == 0 ? 0.8 : 0.1;
    for (int k = 0; k < 3; ++k) {
      uvs.push_back(static_cast<float>(u + (t % 11 == 0 ? 0 : random.Number(-size, size))));
      uvs.push_back(t % 23 == 0 && k == 1 ? kNone : static_cast<float>(v + random.Number(-size, size)));
    }
    if (t % 5 == 4) std::copy_n(uvs.end() - 12, 6, uvs.end() - 6);  // there a second time
  }
  const UvMap map(uvs);
  for (int i = 0; i < 300; ++i) {
    const double span = i % 3 == 0 ? 3 : 0.5, u = 0.5 + random.Number(-span, span),
                 v = i % 50 == 0 ? static_cast<double>(uvs[7]) : 0.5 + random.Number(-span, span);
    SurfacePoint expected;
    for (std::size_t t = 0; 6 * t < uvs.size() && !(expected.squared <= 1e-18); ++t) {
      const float* uv = &uvs[6 * t];
      if (std::any_of(uv, uv + 6, [](float x) { return std::isnan(x); })) continue;
      const PointBuffer corners =
          PointBuffer::FromInterleaved(std::vector<float>{uv[0], uv[1], 0, uv[2], uv[3], 0, uv[4], uv[5], 0});
      constexpr Index kCorners[3] = {0, 1, 2};
      SurfacePoint one = ClosestOnTriangle(corners.view(), kCorners, {u, v, 0});
      one.triangle = static_cast<Index>(t);
      if (one.squared < expected.squared) expected = one;
    }
    const TrianglePlace found = map.Find(u, v);
    ASSERT_EQ(found.triangle, expected.triangle) << i;
    for (int k = 0; k < 3; ++k) EXPECT_EQ(found.weights[k], expected.weights[k]);
  }
  EXPECT_EQ(UvMap(std::vector<float>(12, kNone)).Find(0, 0).triangle, kNoIndex);
  EXPECT_EQ(UvMap({}).Find(0, 0).triangle, kNoIndex);
}

TEST(UvMap, LooksAtFewOfManyTriangles) {
  const auto mesh = GridMesh(60, 60, [](double, double) { return 0; });
  const auto uvs = FlatUvs(*mesh);
  std::vector<float> stacked;
  while (stacked.size() < uvs->values().size()) stacked.insert(stacked.end(), {0, 0, 1, 0, 0, 1});
  const UvMap map(uvs->values()), stack(stacked);
  for (const auto& [of, at] : std::vector<std::pair<const UvMap*, Double3>>{
           {&map, {0.3, 0.4, 0}}, {&map, {0.999, 0.97, 0}}, {&map, {1.5, 0.5, 0}}, {&stack, {0.3, 0.4, 0}}}) {
    const auto count = CountInstructions([of = of, at = at] { of->Find(at.x, at.y); });
    if (!count.has_value()) GTEST_SKIP() << "instructions cannot be counted here";
    EXPECT_LT(*count, 30000u) << (of == &stack) << at.x;  // of 6962 triangles, some hundred instructions each
  }
}

TEST(UvPin, PlacesByFace) {
  PinRig rig(FlatSheet(), "uvPin", {{"face[0]", 1}, {"face[1]", 1}, {"barycentric[1]", Double3{2, 1, 1}}});
  // Triangle 1 is (-1, -1), (0, 0), (-1, 0)
  EXPECT_LT(Apart(PlaceIn(rig.Pin()), {-2.0 / 3, -1.0 / 3, 0}), 1e-12);
  EXPECT_LT(Apart(PlaceIn(rig.Pin(1)), {-0.75, -0.5, 0}), 1e-12);
  // Without coordinates the tangent is the first edge
  PinRig bare(FlatSheet(), "uvPin",
              {{"face[0]", 1},
               {"driverUvs", Value(std::shared_ptr<const TriangleUvs>(
                                 std::make_shared<const TriangleUvs>(std::vector<float>(48, kNone))))}});
  EXPECT_LT(Apart(AxisOf(bare.Pin(), 0), {std::sqrt(0.5), std::sqrt(0.5), 0}), 1e-12);
  EXPECT_LT(Apart(AxisOf(bare.Pin(), 1), {0, 0, 1}), 1e-12);
}

TEST(UvPin, RelativeSpaces) {
  const Matrix4 world = ComposeTrs({1, 2, 3}, RandomFrames(5).Turn(), {1, 1, 1});
  const Matrix4 seen_from = RandomFrames(6).Rigid();
  PinRig rig(Hill(), "uvPin", {{"driverMatrix", world}, {"relativeSpaceMatrix", seen_from}});
  rig.Put(0, 0.3, 0.62);
  rig.g.hold("pin.relativeSpaceMode", "local");
  const Matrix4 local = rig.Pin();
  rig.g.hold("pin.relativeSpaceMode", "world");
  EXPECT_LT(Apart(rig.Pin(), world * local), 1e-9);
  rig.g.hold("pin.relativeSpaceMode", "custom");
  EXPECT_LT(Apart(seen_from * rig.Pin(), world * local), 1e-9);
}

TEST(UvPin, AFlattenedTriangleKeepsTheAxes) {
  PinRig rig(Hill());
  rig.Put(0, 0.3, 0.62);
  for (const Double3& scale : {Double3{0, 0, 0}, Double3{1, 0, 0}}) {
    Matrix4 pin = rig.PinAt(Translation({0, 0, 4}) * Scaling(scale));
    EXPECT_LT(Apart(AxisOf(pin, 0), {1, 0, 0}), 1e-12);
    EXPECT_LT(Apart(AxisOf(pin, 1), {0, 0, 1}), 1e-12);
    EXPECT_NEAR(pin(2, 3), 4, 1e-6);
  }
  const Matrix4 pin = rig.PinAt(Translation({std::nan(""), 0, 0}));
  EXPECT_TRUE(std::isnan(pin(0, 3)));
  EXPECT_EQ(pin(0, 0), 1);
}

TEST(UvPin, ErrorsSayWhatIsMissing) {
  const auto has = [](const std::string& text, const char* part) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  PinRig empty(Hill());
  has(empty.Error(), "pin 0 has no place: set coordinateU[0], or face[0]");
  empty.g.hold("pin.coordinateU[0]", 0.5);
  has(empty.Error(), "pin 0 has no place: set coordinateV[0], or face[0]");
  PinRig same(Hill(), "uvPin", {{"face[0]", 0}, {"normalAxis", "x"}, {"tangentAxis", "-x"}});
  has(same.Error(), "normalAxis and tangentAxis are the same axis");
  PinRig far(FlatSheet(), "uvPin", {{"face[0]", 8}});
  has(far.Error(), "face: 8, its driver has the triangles 0 to 7");
  PinRig nothing(FlatSheet(), "uvPin", {{"face[0]", 0}, {"barycentric[0]", Double3{1, -1, 0}}});
  has(nothing.Error(), "expected numbers whose sum is not 0");
  PinRig bare(MeshOf({0, 0, 0, 1, 0, 0}, {}), "uvPin", {{"face[0]", 0}});
  has(bare.Error(), "has no faces");
  PinRig other(FlatSheet(), "uvPin", {{"driverMesh", Hill()}, {"face[0]", 0}});
  has(other.Error(), "driver's mesh has 255 points, driverPoints 9");
  PinRig few(FlatSheet(), "uvPin",
             {{"driverUvs", Value(std::shared_ptr<const TriangleUvs>(
                                std::make_shared<const TriangleUvs>(std::vector<float>(6))))}});
  few.Put(0, 0, 0);
  has(few.Error(), "driverUvs are of 1 triangles, its driver has 8");
  PinRig none(FlatSheet(), "uvPin",
              {{"driverUvs", Value(std::shared_ptr<const TriangleUvs>(
                                 std::make_shared<const TriangleUvs>(std::vector<float>(48, kNone))))}});
  none.Put(0, 0, 0);
  has(none.Error(), "none of its driver's faces has texture coordinates");
  TestGraph alone(StandardNodes());
  alone.add("follicle", "f");
  has(alone.try_pull("f.outMatrix").ToString(), "it has no driver");
}

TEST(Follicle, GivesTheSameFrameInParts) {
  PinRig rig(Hill(), "follicle", {{"parameterU", 0.3}, {"parameterV", 0.62}});
  PinRig pin(Hill(), "uvPin", {{"normalAxis", "z"}});
  pin.Put(0, 0.3, 0.62);
  const Matrix4 motion = RandomFrames(2).Scaled();
  for (const char* output : {"outTranslate", "outRotate", "outMatrix", "outNormal", "outTangent"})
    rig.g.want(std::string("pin.") + output);
  rig.g.set("move.matrix", motion);
  const Matrix4 matrix = rig.g.pull<Matrix4>("pin.outMatrix");
  EXPECT_EQ(matrix, pin.PinAt(motion));
  EXPECT_EQ(rig.Demanded(), 3u);
  const Double3 place = rig.g.pull<Double3>("pin.outTranslate"), turn = rig.g.pull<Double3>("pin.outRotate");
  EXPECT_LT(Apart(Translation(place) * RotationFromEuler(turn, RotateOrder::kXyz), matrix), 1e-9);
  EXPECT_EQ(rig.g.pull<Double3>("pin.outNormal"), AxisOf(matrix, 2));
  EXPECT_EQ(rig.g.pull<Double3>("pin.outTangent"), AxisOf(matrix, 0));
}

}  // namespace
}  // namespace kpsa::engine
