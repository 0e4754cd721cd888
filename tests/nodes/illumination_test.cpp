// camera, lights and indirectIllumination as nodes.
#include "nodes/illumination.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/parallel.h"
#include "base/scalar_math.h"
#include "graph/frames.h"
#include "graph/geometry.h"
#include "nodes/standard_nodes.h"
#include "tests/support/countdown.h"
#include "tests/support/memory_in_use.h"
#include "tests/support/test_graph.h"

namespace kpsa::engine {
namespace {

const NodeRegistry& IlluminationRegistry() {
  static const NodeRegistry* registry = [] {
    auto* r = new NodeRegistry;
    AddStandardNodes(*r);
    return r;
  }();
  return *registry;
}

// A floor and a red wall.
std::shared_ptr<const Mesh> Corner() {
  Mesh::Data data;
  data.name = "corner";
  const std::vector<float> xyz = {-1, 0, 1, 1, 0, 1, 1, 0, -1, -1, 0, -1, 1, 2, -1, -1, 2, -1};
  data.rest = PointBuffer::FromInterleaved(xyz);
  data.triangles = {0, 1, 2, 0, 2, 3, 3, 2, 4, 3, 4, 5};
  data.triangle_vertices = data.triangles;
  for (Index i = 0; i < 6; ++i) data.vertex_to_point.push_back(i);
  data.primitives = {{0, 6, 0, 2, "floor", {0.8f, 0.8f, 0.8f}}, {0, 6, 2, 2, "wall", {0.9f, 0.1f, 0.0f}}};
  return std::make_shared<const Mesh>(std::move(data));
}

struct Room : TestGraph {
  Room() : TestGraph(IlluminationRegistry()) {
    const auto mesh = Corner();
    add("mesh", "m", {{"mesh", Value(mesh)}});
    add("camera", "cam", {{"matrix", Value(Translation({0, 1, 4}))}, {"verticalFieldOfView", Value(0.8)}});
    add("pointLight", "lamp", {{"matrix", Value(Translation({0.5, 1.5, 0.5}))}, {"intensity", Value(3.0)}});
    add("indirectIllumination", "gi",
        {{"mesh[0]", Value(mesh)},
         {"width", Value(24)},
         {"height", Value(16)},
         {"lightKinds", Value(std::vector<std::int64_t>{0})}});
    connect("m.points", "gi.points[0]");
    connect("cam.worldFromScreen", "gi.worldFromScreen");
    connect("lamp.outMatrix", "gi.lightMatrix[0]");
    connect("lamp.outColor", "gi.lightColor[0]");
  }
  void replace(const std::string& source, const std::string& destination) {
    const Status status = graph.Connect(plug(source), plug(destination), true);
    EXPECT_TRUE(status.ok()) << status.ToString();
  }
};

TEST(Camera, TakesTheScreenToDirections) {
  TestGraph g(IlluminationRegistry());
  g.add("camera", "cam",
        {{"matrix", Value(Translation({1, 2, 3}))},
         {"verticalFieldOfView", Value(kPi / 2)},
         {"aspectRatio", Value(2.0)}});
  const Matrix4 m = g.pull<Matrix4>("cam.worldFromScreen");
  Double3 origin, direction;
  PixelRay(m, 0, 4, 2, &origin, &direction);  // the middle of the top left pixel of 4 x 2
  EXPECT_LT(Length(origin - Double3{1, 2, 3}), 1e-12);
  EXPECT_LT(Length(direction - Double3{-1.5, 0.5, -1}), 1e-12);
  PixelRay(m, 7, 4, 2, &origin, &direction);
  EXPECT_LT(Length(direction - Double3{1.5, -0.5, -1}), 1e-12);
}

TEST(Lights, HandOnTheirSizeAndStrength) {
  TestGraph g(IlluminationRegistry());
  g.add("areaLight", "a",
        {{"width", Value(2.0)},
         {"height", Value(3.0)},
         {"color", Value(Double3{1, 0.5, 0})},
         {"intensity", Value(4.0)}});
  EXPECT_EQ(g.pull<Matrix4>("a.outMatrix"), Scaling({2, 3, 1}));
  const Double3 color = g.pull<Double3>("a.outColor");
  EXPECT_LT(Length(color - Double3{4, 2, 0}), 1e-12);

  // A ball's size is in its frame: whatever the frame turns, its axes get the radius
  const Matrix4 place = Translation({1, 2, 3}) * RotationFromUnit({0, 0, 0.6, 0.8});
  g.add("sphereLight", "s", {{"matrix", Value(place)}, {"radius", Value(0.25)}, {"intensity", Value(2.0)}});
  const Matrix4 ball = g.pull<Matrix4>("s.outMatrix");
  EXPECT_EQ(ball, place * Scaling({0.25, 0.25, 0.25}));
  EXPECT_NEAR(Length(TransformVector(ball, {1, 0, 0})), 0.25, 1e-15);
  EXPECT_EQ(g.pull<Double3>("s.outColor"), (Double3{2, 2, 2}));
}

double Sum(const std::vector<float>& light) {
  double sum = 0;
  for (const float x : light) sum += x;
  return sum;
}

// A sphereLight in the lamp's place.
struct BallRoom : Room {
  explicit BallRoom(double radius) {
    add("sphereLight", "ball",
        {{"matrix", Value(Translation({0.5, 1.5, 0.5}))},
         {"intensity", Value(3.0)},
         {"radius", Value(radius)}});
    hold("gi.lightKinds", Value(std::vector<std::int64_t>{3}));
    replace("ball.outMatrix", "gi.lightMatrix[0]");
    replace("ball.outColor", "gi.lightColor[0]");
  }
};

TEST(IndirectIllumination, ABallIsAPointThatHasASize) {
  Room point;
  BallRoom tiny(0), small(0.2), large(1.4);
  const std::vector<float> a = point.pull_points("gi.irradiance"), b = tiny.pull_points("gi.irradiance");
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) EXPECT_NEAR(a[i], b[i], 1e-6 * (1 + a[i])) << i;
  const double whole = Sum(a);
  EXPECT_NEAR(Sum(small.pull_points("gi.irradiance")), whole, 0.1 * whole);
  EXPECT_LT(Sum(large.pull_points("gi.irradiance")), 0.8 * whole);  // from near, it lights less than a point
}

TEST(IndirectIllumination, OneContributionIsBounded) {
  Room free, loose, tight;
  loose.hold("gi.largestContribution", 1e3);
  tight.hold("gi.largestContribution", 0.01);
  tight.hold("gi.bounces", 1);
  const std::vector<float> all = free.pull_points("gi.irradiance");
  EXPECT_EQ(loose.pull_points("gi.irradiance"), all);
  const std::vector<float> bounded = tight.pull_points("gi.irradiance");
  for (const float light : bounded) EXPECT_LE(light, 0.01f);
  EXPECT_GT(Sum(bounded), 0);
  EXPECT_LT(Sum(bounded), 0.5 * Sum(all));
}

TEST(IndirectIllumination, TheWallColoursTheFloor) {
  Room room;
  const std::vector<float> light = room.pull_points("gi.irradiance");
  ASSERT_EQ(light.size(), 3u * 24 * 16);
  // A pixel at the floor before the wall, and one of the background
  const std::size_t floor = 3 * (12 * 24 + 12), nothing = 0;
  EXPECT_GT(light[floor], 2 * light[floor + 1]);
  EXPECT_GT(light[floor + 1], 0);
  EXPECT_EQ(light[nothing], 0);
}

TEST(IndirectIllumination, EachPixelIsItsOwn) {
  Room room;
  const std::vector<float> all = room.pull_points("gi.irradiance");
  for (const std::vector<Index>& pixels :
       {std::vector<Index>{204}, std::vector<Index>{17, 100, 228, 229, 383}}) {
    Room few;
    few.want("gi.irradiance", PointSet::Of(pixels, 24 * 16));
    const std::vector<float> some = few.pull_points("gi.irradiance");
    ASSERT_EQ(some.size(), 3 * pixels.size());
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      for (std::size_t k = 0; k < 3; ++k) EXPECT_EQ(some[3 * i + k], all[3 * pixels[i] + k]) << pixels[i];
    }
  }
  Room threads;
  threads.options.parallel = true;
  EXPECT_EQ(threads.pull_points("gi.irradiance"), all);
}

// A second mesh that the pixels look through: it has light at its points, and throws light on what they see.
struct Carrying : Room {
  Carrying() {
    Mesh::Data data;
    data.name = "board";
    data.rest = PointBuffer::FromInterleaved(
        std::vector<float>{-0.4f, 0.3f, 0, 0.4f, 0.3f, 0, 0.4f, 1.1f, 0, -0.4f, 1.1f, 0});
    data.triangles = {0, 1, 2, 0, 2, 3};
    data.triangle_vertices = data.triangles;
    data.vertex_to_point = {0, 1, 2, 3};
    data.primitives = {{0, 4, 0, 2, "board", {0.1f, 0.9f, 0.1f}}};
    const auto board = std::make_shared<const Mesh>(std::move(data));
    add("mesh", "b", {{"mesh", Value(board)}});
    hold("gi.mesh[1]", Value(board));
    connect("b.points", "gi.points[1]");
  }
};

TEST(IndirectIllumination, PixelsLookThroughWhatIsCarried) {
  Room empty;
  Carrying seen, carried;
  carried.hold("gi.carriedMeshes", Value(std::vector<std::int64_t>{1}));
  const std::vector<float> a = empty.pull_points("gi.irradiance"), b = seen.pull_points("gi.irradiance"),
                           c = carried.pull_points("gi.irradiance");
  const std::size_t board = 3 * (8 * 24 + 12), beside = 3 * (8 * 24 + 4);
  // The board faces the camera and the dark; behind it is the wall, which now gets less light
  EXPECT_NE(b[board], c[board]);
  EXPECT_NE(a[board], c[board]);
  EXPECT_EQ(b[beside], c[beside]);
  const std::vector<float> points = carried.pull_points("gi.pointIrradiance[0]");
  ASSERT_EQ(points.size(), 12u);
  for (std::size_t i = 0; i < 6; i += 3) EXPECT_GT(points[i], 0) << i;  // the lower ones, near the floor
  // Each point is its own
  Carrying few;
  few.hold("gi.carriedMeshes", Value(std::vector<std::int64_t>{1}));
  few.want("gi.pointIrradiance[0]", PointSet::Of({2}, 4));
  const std::vector<float> some = few.pull_points("gi.pointIrradiance[0]");
  ASSERT_EQ(some.size(), 3u);
  for (std::size_t k = 0; k < 3; ++k) EXPECT_EQ(some[k], points[6 + k]);

  Carrying wrong;
  wrong.hold("gi.carriedMeshes", Value(std::vector<std::int64_t>{2}));
  const Status status = wrong.try_pull("gi.irradiance");
  EXPECT_NE(status.ToString().find("2 is none of the 2 meshes"), std::string::npos) << status.ToString();
}

// Light is measured by the first of the paths that pictures have.
TEST(IndirectIllumination, KeysHaveTheirOwnPaths) {
  const auto light = [](int samples, int key_samples, const char* output) {
    Carrying room;
    room.hold("gi.carriedMeshes", Value(std::vector<std::int64_t>{1}));
    room.hold("gi.samples", samples);
    room.hold("gi.keySamples", key_samples);
    return room.pull_points(output);
  };
  for (const auto& [shown, key] : {std::pair{"gi.irradiance", "gi.keyIrradiance"},
                                   std::pair{"gi.pointIrradiance[0]", "gi.keyPointIrradiance[0]"}}) {
    EXPECT_EQ(light(16, 4, key), light(4, 0, shown)) << key;
    EXPECT_EQ(light(16, 4, shown), light(16, 0, shown)) << shown;
    EXPECT_EQ(light(16, 0, key), light(16, 0, shown)) << key;
    EXPECT_NE(light(16, 4, key), light(16, 4, shown)) << key;
  }
  // Both at once, and a few keys
  Room both, few_paths;
  few_paths.hold("gi.samples", 4);
  both.hold("gi.keySamples", 4);
  both.want("gi.irradiance");
  both.want("gi.keyIrradiance", PointSet::Of({204, 228}, 24 * 16));
  const std::vector<float> keys = both.pull_points("gi.keyIrradiance"),
                           all = few_paths.pull_points("gi.irradiance");
  ASSERT_EQ(keys.size(), 6u);
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_EQ(keys[k], all[3 * 204 + k]);
    EXPECT_EQ(keys[3 + k], all[3 * 228 + k]);
  }
  EXPECT_EQ(both.pull_points("gi.irradiance"), Room().pull_points("gi.irradiance"));
}

TEST(IndirectIllumination, ItsColoursMayGoWherePointsDo) {
  Room room;
  room.add("tripwire", "trip");
  room.connect("gi.irradiance", "trip.inPoints[0]");
  room.vary("lamp.intensity");
  EXPECT_EQ(room.pull_points("trip.outPoints[0]"), room.pull_points("gi.irradiance"));
}

// What it takes some megabytes to trace.
std::shared_ptr<const Mesh> LargeFloor() {
  constexpr Index kSide = 120;
  Mesh::Data data;
  data.name = "floor";
  std::vector<float> xyz;
  for (Index i = 0; i < kSide * kSide; ++i) {
    xyz.insert(xyz.end(),
               {0.02f * static_cast<float>(i % kSide) - 1, 0, 1 - 0.02f * static_cast<float>(i / kSide)});
    data.vertex_to_point.push_back(i);
    if (i % kSide + 1 == kSide || i / kSide + 1 == kSide) continue;
    const Index far = i + kSide;
    data.triangles.insert(data.triangles.end(), {i, i + 1, far + 1, i, far + 1, far});
  }
  data.rest = PointBuffer::FromInterleaved(xyz);
  data.triangle_vertices = data.triangles;
  data.primitives = {
      {0, kSide * kSide, 0, static_cast<Index>(data.triangles.size() / 3), "floor", {0.8f, 0.8f, 0.8f}}};
  return std::make_shared<const Mesh>(std::move(data));
}

// A frame without numbers is refused; the next one is what it would have been without it. What frames need is
// there before the first one, and stays.
TEST(IndirectIllumination, ABrokenFrameLeavesNothingBehind) {
  Room room;
  const auto mesh = LargeFloor();
  room.hold("m.mesh", Value(mesh));
  room.hold("gi.mesh[0]", Value(mesh));
  room.hold("gi.width", 2);
  room.hold("gi.height", 2);
  room.add("transformGeometry", "move");
  room.connect("m.points", "move.inPoints[0]");
  room.replace("move.outPoints[0]", "gi.points[0]");
  room.vary("move.matrix");
  room.want("gi.irradiance");
  ASSERT_TRUE(room.compile().ok()) << room.compile().ToString();
  const std::size_t bound = MemoryInUse();
  const std::vector<float> before = room.pull_points("gi.irradiance");
  constexpr std::size_t kLittle = std::size_t{1} << 19;  // bytes
  EXPECT_LT(MemoryInUse(), bound + kLittle);
  room.set("move.matrix", Translation({NAN, 0, 0}));
  for (int i = 0; i < 3; ++i) {
    EXPECT_FALSE(room.try_pull("gi.irradiance").ok());
    EXPECT_LT(bound, MemoryInUse() + kLittle);
  }
  room.set("move.matrix", Matrix4());
  EXPECT_EQ(room.pull_points("gi.irradiance"), before);
}

TEST(IndirectIllumination, FollowsItsLightAndFailsClearly) {
  Room room;
  room.vary("lamp.intensity");
  const std::vector<float> before = room.pull_points("gi.irradiance");
  room.set("lamp.intensity", 6.0);
  const std::vector<float> after = room.pull_points("gi.irradiance");
  double sum = 0, doubled = 0;
  for (std::size_t i = 0; i < before.size(); ++i) sum += before[i], doubled += after[i];
  EXPECT_NEAR(doubled, 2 * sum, 1e-4 * sum);

  Room wrong;
  wrong.hold("gi.lightKinds", Value(std::vector<std::int64_t>{0, 2}));
  const Status status = wrong.try_pull("gi.irradiance");
  ASSERT_FALSE(status.ok());
  EXPECT_NE(status.ToString().find("2 lightKinds, 1 matrices and 1 colours"), std::string::npos)
      << status.ToString();
}

// Wherever it is asked to, in a pixel too; and what is evaluated afterwards is what it would have been.
TEST(IndirectIllumination, EndsWhereItIsAskedTo) {
  for (const bool parallel : {false, true}) {
    Room room;
    room.options.parallel = parallel;
    room.hold("gi.samples", Value(1000));
    room.vary("lamp.intensity");
    const std::vector<float> bright = room.pull_points("gi.irradiance");
    room.set("lamp.intensity", 6.0);
    const Countdown never;
    {
      const CancelScope scope(&never);
      EXPECT_NE(room.pull_points("gi.irradiance"), bright);
    }
    EXPECT_GT(never.questions(), 2 * 24 * 16) << "more than once a pixel";
    for (const long long questions : {0LL, 1LL, never.questions() / 2, never.questions() - 1}) {
      room.set("lamp.intensity", 3.0 + 1e-3 * static_cast<double>(questions + 1));
      const Countdown countdown(questions);
      {
        const CancelScope scope(&countdown);
        const Status status = room.try_pull("gi.irradiance");
        EXPECT_EQ(status.kind(), ErrorKind::kInterrupted) << status.ToString();
      }
      EXPECT_LE(countdown.questions(), questions + 16 + 2 * HardwareThreads());
      room.set("lamp.intensity", 3.0);
      EXPECT_EQ(room.pull_points("gi.irradiance"), bright);
    }
    // Where it is a constant, whoever compiles ends
    Room still;
    still.hold("gi.samples", Value(1000));
    const Countdown soon(20);
    const CancelScope scope(&soon);
    EXPECT_THROW((void)still.try_pull("gi.irradiance"), Cancelled);
  }
}

TEST(IndirectIllumination, FramesEndWithinOne) {
  Room room;
  room.hold("gi.samples", Value(1000));
  room.vary("lamp.intensity");
  room.want("gi.irradiance");
  ASSERT_TRUE(room.compile().ok());
  const Result<PlugHandle> intensity = room.evaluator->FindVarying(room.graph, room.plug("lamp.intensity"));
  ASSERT_TRUE(intensity.ok());
  for (const int threads : {1, 3}) {
    FrameOptions options;
    options.threads = threads;
    std::size_t given = 0;
    const Countdown countdown(100);
    const CancelScope scope(&countdown);
    const Status status = EvaluateFrames(
        room.plan, 10, options,
        [&](std::size_t frame, Evaluator& evaluator) {
          EXPECT_TRUE(evaluator.Set(*intensity, 1.0 + static_cast<double>(frame)).ok());
        },
        [&](std::size_t, const Evaluator&, const Status& evaluated) {
          given += evaluated.ok();
          return evaluated;
        });
    EXPECT_EQ(status.kind(), ErrorKind::kInterrupted) << status.ToString();
    EXPECT_EQ(given, 0u) << "the first frame was not through";
  }
}

}  // namespace
}  // namespace kpsa::engine
