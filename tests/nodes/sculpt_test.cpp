#include "nodes/kernels/sculpt.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "nodes/kernels/weights.h"
#include "tests/nodes/driver_rig.h"

namespace kpsa::engine {
namespace {

using Mode = SculptMode;
using Dropoff = SculptDropoff;

// Of one point, in a sphere of radius 1 about the origin.
Double3 SculptPoint(const SculptShape& shape, Double3 p) {
  const PointBuffer in = PointBuffer::FromPlaces(std::vector<Double3>{p});
  PointBuffer out(1);
  SculptKernel(AllPoints(1)).Run({shape, Matrix4(), 1, 1}, in.view(), out.view());
  return ToDouble(std::as_const(out).view())[0];
}

// The same in double.
Double3 SculptTwin(const SculptShape& shape, Double3 p) {
  const double r = Length(p), d = shape.dropoff_distance;
  const bool linear = shape.dropoff == Dropoff::kLinear && d > 0;
  if (shape.mode == Mode::kStretch) {
    if (!(r < 1 + d) || shape.stretch == Double3()) return p;
    const double fade = r <= 1 || !linear ? 1 : 1 - (r - 1) / d;
    const Double3 from = r <= 1 ? p : p * (1 / r);
    const double along = Dot(from, shape.stretch);
    const double exit = std::sqrt(along * along + std::max(1 - Dot(from, from), 0.0)) - along;
    return p + shape.stretch * std::min(exit * fade, shape.max_displacement);
  }
  if (!(r > 0)) return p;
  double way = 0;
  if (shape.mode == Mode::kFlip) {
    if (linear && r < 1 + d) way = 1 + r / (1 + d) * d - r;
    if (!linear && r < 1) way = 1 - r;
  } else if (std::fabs(r - 1) < d) {
    way = (1 - r) * (linear ? 1 - std::fabs(r - 1) / d : 1);
  }
  return p * (1 + std::clamp(way, -shape.max_displacement, shape.max_displacement) / r);
}

// Not where it jumps, and what is nearly tangent to a stretch takes the root of what floats leave of its depth.
TEST(Sculpt, AgreesWithItsTwin) {
  Random random(14);
  PointBuffer in(5000), out(5000);
  for (std::size_t i = 0; i < in.count(); ++i) {
    const Double3 p = random.Vector() * 1.2;
    in.view().x[i] = static_cast<float>(p.x), in.view().y[i] = static_cast<float>(p.y);
    in.view().z[i] = static_cast<float>(p.z);
  }
  const std::vector<Double3> points = ToDouble(std::as_const(in).view());
  const Matrix4 handle = ComposeTrs({0.1, 0.2, -0.1}, random.Rotation(), {1.5, 0.75, 1});
  const Matrix4 inverse = InverseOrIdentity(handle * Scaling({0.8, 0.8, 0.8}));
  const SculptKernel kernel(AllPoints(in.count()));
  for (const Mode mode : {Mode::kFlip, Mode::kProject, Mode::kStretch}) {
    for (const Dropoff dropoff : {Dropoff::kNone, Dropoff::kLinear}) {
      for (const double most : {0.125, 10.0}) {
        const SculptShape shape{mode, dropoff, 0.4, most, {0.6, 0, 0.8}};
        kernel.Run({shape, handle, 0.8, 1}, std::as_const(in).view(), out.view());
        const std::vector<Double3> result = ToDouble(std::as_const(out).view());
        std::size_t moved = 0;
        for (std::size_t i = 0; i < points.size(); ++i) {
          const Double3 q = TransformPoint(inverse, points[i]);
          if (std::fabs(Length(q) - 1) < 1e-4 || std::fabs(Length(q) - 1.4) < 1e-4) continue;
          const Double3 there = TransformPoint(handle, SculptTwin(shape, q) * 0.8);
          EXPECT_LT(Length(result[i] - there), mode == Mode::kStretch ? 3e-5 : 1e-6)
              << static_cast<int>(mode) << " " << i;
          moved += !(result[i] == points[i]);
        }
        EXPECT_GT(moved, 500u);
      }
    }
  }
}

double Along(Mode mode, Dropoff dropoff, double d, double x, double most = 100) {
  const Double3 there = SculptPoint({mode, dropoff, d, most, {1, 0, 0}}, {x, 0, 0});
  EXPECT_EQ(there.y, 0);
  return there.x;
}

TEST(Sculpt, FlipPushesOutAlongTheRadius) {
  EXPECT_FLOAT_EQ(Along(Mode::kFlip, Dropoff::kNone, 0, 0.25), 1);
  EXPECT_FLOAT_EQ(Along(Mode::kFlip, Dropoff::kNone, 0, -0.25), -1);
  EXPECT_FLOAT_EQ(Along(Mode::kFlip, Dropoff::kNone, 0, 1.25), 1.25);
  // Linear: [0, 1.5] goes to [1, 1.5], and what is outside stays
  EXPECT_FLOAT_EQ(Along(Mode::kFlip, Dropoff::kLinear, 0.5, 0.75), 1.25);
  EXPECT_FLOAT_EQ(Along(Mode::kFlip, Dropoff::kLinear, 0.5, 1.2), 1.4);
  EXPECT_FLOAT_EQ(Along(Mode::kFlip, Dropoff::kLinear, 0.5, 1.6), 1.6);
  EXPECT_FLOAT_EQ(Along(Mode::kFlip, Dropoff::kNone, 0, 0.25, 0.5), 0.75);  // not farther than that
  EXPECT_FLOAT_EQ(Along(Mode::kFlip, Dropoff::kNone, 0, 0), 0);
}

TEST(Sculpt, ProjectDrawsOntoTheSphere) {
  EXPECT_FLOAT_EQ(Along(Mode::kProject, Dropoff::kNone, 0.5, 0.75), 1);
  EXPECT_FLOAT_EQ(Along(Mode::kProject, Dropoff::kNone, 0.5, 1.4), 1);
  EXPECT_FLOAT_EQ(Along(Mode::kProject, Dropoff::kNone, 0.5, 1.6), 1.6);
  EXPECT_FLOAT_EQ(Along(Mode::kProject, Dropoff::kLinear, 0.5, 1.25), 1.125);  // half of the way
  EXPECT_FLOAT_EQ(Along(Mode::kProject, Dropoff::kNone, 0.5, 1.4, 0.1), 1.3);
  EXPECT_FLOAT_EQ(Along(Mode::kProject, Dropoff::kLinear, 0, 0.5), 0.5);
}

TEST(Sculpt, StretchGoesOneWay) {
  EXPECT_FLOAT_EQ(Along(Mode::kStretch, Dropoff::kNone, 0, 0.25), 1);
  EXPECT_FLOAT_EQ(Along(Mode::kStretch, Dropoff::kNone, 0, -0.5), 1);
  EXPECT_FLOAT_EQ(Along(Mode::kStretch, Dropoff::kNone, 0, 1.5), 1.5);
  EXPECT_FLOAT_EQ(Along(Mode::kStretch, Dropoff::kNone, 0, -1.5), -1.5);
  EXPECT_FLOAT_EQ(Along(Mode::kStretch, Dropoff::kLinear, 1, -1.5), -0.5);  // half of the diameter
  const Double3 beside = SculptPoint({Mode::kStretch, Dropoff::kNone, 0, 100, {0, 1, 0}}, {0.6, -0.1, 0});
  EXPECT_FLOAT_EQ(beside.x, 0.6);
  EXPECT_FLOAT_EQ(beside.y, 0.8);
}

TEST(Sculpt, ThereAreNoJumps) {
  // Walks out from the centre in small steps: with a linear dropoff the displacement never jumps
  for (const Mode mode : {Mode::kFlip, Mode::kProject, Mode::kStretch}) {
    const SculptShape shape{mode, Dropoff::kLinear, 0.5, 10, {0, 0, 1}};
    for (const Double3& direction : {Double3{0, 0, 1}, Double3{0.6, 0, -0.8}, Double3{1, 0, 0}}) {
      Double3 last = SculptPoint(shape, direction * 0.01);
      for (double r = 0.011; r < 2; r += 0.001) {
        const Double3 now = SculptPoint(shape, direction * r);
        EXPECT_LT(Length(now - last), mode == Mode::kStretch ? 0.1 : 0.01) << r;
        last = now;
      }
    }
  }
}

struct SculptRig {
  TestGraph g{NodesUnderTest()};
  std::shared_ptr<const Mesh> mesh = GridMesh(31, 31, [](double x, double y) { return 0.1 * x * y; });
  explicit SculptRig(const std::vector<std::pair<std::string, Value>>& values, const PointSet& points = {}) {
    g.add("mesh", "m", {{"mesh", mesh}});
    g.add("sculpt", "s", values);
    g.connect("m.points", "s.inPoints[0]");
    g.vary("s.matrix");
    g.vary("s.parentMatrix");
    g.want("s.outPoints[0]", points);
  }
  std::vector<Double3> Points() {
    const std::vector<float> xyz = g.pull_points("s.outPoints[0]");
    std::vector<Double3> points;
    for (std::size_t i = 0; i + 2 < xyz.size(); i += 3) points.push_back({xyz[i], xyz[i + 1], xyz[i + 2]});
    return points;
  }
  std::vector<Double3> Rest() const { return ToDouble(std::as_const(mesh->data()).rest.view()); }
};

TEST(Sculpt, TheHandlePlacesTheSphere) {
  SculptRig rig({{"radius", 0.25}, {"dropoffType", "none"}});
  const Double3 center{0.3, -0.2, 0.05};
  rig.g.set("s.matrix", Translation(center) * Scaling({2, 2, 2}));
  const std::vector<Double3> rest = rig.Rest(), points = rig.Points();
  int moved = 0;
  for (std::size_t i = 0; i < rest.size(); ++i) {
    const double before = Length(rest[i] - center);
    if (before >= 0.5) {
      EXPECT_EQ(points[i], rest[i]);
      continue;
    }
    ++moved;
    EXPECT_NEAR(Length(points[i] - center), 0.5, 1e-6);
    EXPECT_LT(Length(points[i] - center - (rest[i] - center) * (0.5 / before)), 1e-6);
  }
  EXPECT_GT(moved, 100);
  // An ellipsoid: twice as wide along x
  rig.g.set("s.matrix", Translation(center) * Scaling({2, 1, 1}));
  for (const Double3& p : rig.Points()) {
    const Double3 local = p - center;
    EXPECT_GT(std::hypot(local.x / 0.5, local.y / 0.25, local.z / 0.25), 1 - 1e-5);
  }
}

// However the handle scales the sphere; around 1, where the mean radius is told by a series.
TEST(Sculpt, TheLargestDisplacementIsAWorldLength) {
  for (const double scale : {0.5, 1 - 4e-6, 1 - 3e-6, 1.0, 1 + 3e-6, 1 + 4e-6, 2.0}) {
    SculptRig rig({{"radius", 0.25}, {"dropoffType", "none"}, {"maximumDisplacement", 0.01}});
    rig.g.set("s.matrix", Translation({0.3, -0.2, 0.05}) * Scaling({scale, scale, scale}));
    EXPECT_NEAR(MaxDistance(rig.Points(), rig.Rest()), 0.01, 1e-7) << scale;
  }
}

TEST(Sculpt, InWorldSpaceTheParentSaysNothingAndInMeshSpaceItsMotionIsTakenOut) {
  const Matrix4 handle = Translation({0.3, 0.2, 0}),
                motion = ComposeTrs({0, 3, 1}, Random(2).Rotation(), {1, 1, 1});
  SculptRig world({{"radius", 0.4}});
  world.g.set("s.matrix", handle);
  const std::vector<Double3> expected = world.Points();
  EXPECT_GT(MaxDistance(expected, world.Rest()), 0.1);
  world.g.set("s.parentMatrix", motion);
  EXPECT_EQ(MaxDistance(world.Points(), expected), 0);
  SculptRig before_skin({{"radius", 0.4}, {"space", "mesh"}});
  before_skin.g.set("s.matrix", motion * handle);
  before_skin.g.set("s.parentMatrix", motion);
  EXPECT_LT(MaxDistance(before_skin.Points(), expected), 1e-6);
  // A mesh whose stage lies elsewhere at rest
  SculptRig placed({{"radius", 0.4}, {"space", "mesh"}});
  placed.g.hold("s.geometryMatrix[0]", motion);
  placed.g.set("s.matrix", motion * handle);
  EXPECT_LT(MaxDistance(placed.Points(), expected), 1e-6);
}

TEST(Sculpt, EnvelopeWeightsSubsetsAndNoSphere) {
  for (const char* mode : {"flip", "project", "stretch"}) {
    const std::vector<std::pair<std::string, Value>> values = {
        {"radius", 0.4}, {"mode", mode}, {"dropoffDistance", 0.3}, {"stretchOrigin", Double3{0, 0, -2}}};
    SculptRig rig(values);
    const std::vector<Double3> rest = rig.Rest(), whole = rig.Points();
    EXPECT_GT(MaxDistance(whole, rest), 0.05) << mode;
    SculptRig half(values);
    half.g.hold("s.envelope", 0.5);
    const std::vector<Double3> middle = half.Points();
    for (std::size_t i = 0; i < rest.size(); ++i)
      EXPECT_LT(Length(middle[i] - (rest[i] + whole[i]) * 0.5), 1e-6);
    half.g.hold("s.envelope", 0.0);
    EXPECT_EQ(MaxDistance(half.Points(), rest), 0);
    SculptRig flat(values);
    flat.g.set("s.matrix", Scaling({1, 0, 1}));
    EXPECT_EQ(MaxDistance(flat.Points(), rest), 0);

    const PointSet some = PointSet::Of({3, 480, 481, 500, 777}, rig.mesh->point_count());
    SculptRig part(values, some);
    const std::vector<Double3> few = part.Points();
    ASSERT_EQ(few.size(), some.size());
    for (Index i = 0; i < some.size(); ++i) EXPECT_EQ(few[i], whole[some[i]]);
  }
}

}  // namespace
}  // namespace kpsa::engine
