// wrap and proximityWrap as nodes.
#include "nodes/kernels/wrap.h"

#include <cmath>
#include <numeric>

#include "base/triangle_tree.h"
#include "tests/nodes/driver_rig.h"

namespace kpsa::engine {
namespace {

std::shared_ptr<const Mesh> Cage() {
  return GridMesh(17, 15, [](double x, double y) { return 0.3 * std::sin(2 * x) * std::cos(y); });
}
std::shared_ptr<const Mesh> Cloth(double above = 0.1) {
  return GridMesh(23, 21, [=](double x, double y) { return 0.3 * std::sin(2 * x) + 0.05 * y * y + above; });
}
std::shared_ptr<const Mesh> Flat(double height, Index n = 9) {
  return GridMesh(n, n, [=](double, double) { return height; });
}

const std::vector<std::pair<std::string, std::vector<std::pair<std::string, Value>>>> kTurning = {
    {"wrap", {}},
    {"wrap", {{"influences", 1}}},
    {"wrap", {{"maxDistance", 0.5}}},
    {"proximityWrap", {}},
    {"proximityWrap", {{"smoothInfluences", 3}}},
    {"proximityWrap", {{"wrapMode", "surface"}}}};

TEST(Wrap, RestsAtRestAndFollowsARigidDriver) {
  for (const auto& [type, values] : kTurning) {
    DriverRig rig(type, Cage(), Cloth(), values);
    EXPECT_LT(MaxDistance(rig.At(Matrix4()), rig.Rest()), 2e-7) << type;
    const Matrix4 motion = ComposeTrs({0.3, -1, 2}, Random(4).Rotation(), {1, 1, 1});
    std::vector<Double3> expected = rig.Rest();
    for (Double3& p : expected) p = TransformPoint(motion, p);
    EXPECT_LT(MaxDistance(rig.At(motion), expected), 2e-6) << type;
    // And back
    EXPECT_LT(MaxDistance(rig.At(Matrix4()), rig.Rest()), 2e-7) << type;
  }
}

TEST(Wrap, TheOffsetKeepsItsLengthOrStretchesOrGoes) {
  // A flat driver that is stretched along x: points above it, and points beside it in its plane
  const Matrix4 stretch = Scaling({3, 1, 1});
  const auto above = MeshOf({0.25f, 0.25f, 0.5f, -0.5f, 0, 0.5f, 0, 1, 0.5f}, {0, 1, 2});
  const auto beside = MeshOf({1.5f, 0, 0, 1.5f, 0.5f, 0, 2, 0, 0}, {0, 1, 2});
  const std::vector<Double3> above_there = {{0.75, 0.25, 0.5}, {-1.5, 0, 0.5}, {0, 1, 0.5}};
  for (const char* mode : {"offset", "surface"}) {
    DriverRig rig("proximityWrap", Flat(0), above, {{"wrapMode", mode}});
    EXPECT_LT(MaxDistance(rig.At(stretch), above_there), 1e-6) << mode;
  }
  DriverRig offset("proximityWrap", Flat(0), beside);
  EXPECT_LT(MaxDistance(offset.At(stretch), {{3.5, 0, 0}, {3.5, 0.5, 0}, {4, 0, 0}}), 1e-6);
  DriverRig surface("proximityWrap", Flat(0), beside, {{"wrapMode", "surface"}});
  EXPECT_LT(MaxDistance(surface.At(stretch), {{4.5, 0, 0}, {4.5, 0.5, 0}, {6, 0, 0}}), 1e-6);
  DriverRig snap("proximityWrap", Flat(0), beside, {{"wrapMode", "snap"}});
  EXPECT_LT(MaxDistance(snap.At(stretch), {{3, 0, 0}, {3, 0.5, 0}, {3, 0, 0}}), 1e-6);
}

TEST(Wrap, TheOffsetTurnsWithTheNormal) {
  // A driver of two planes that folds along x = 0: points above each half turn with it
  DriverRig rig("proximityWrap", GridMesh(3, 3, [](double, double) { return 0; }),
                MeshOf({-1, 0, 0.5f, 1, 0, 0.5f, 1, 1, 0.5f}, {0, 1, 2}));
  // The fold is a blend shape of the driver: at rest it is flat
  rig.g.add("blendShape", "fold");
  MorphTargets::Target target{"up", {0, 2, 3, 5, 6, 8}, {}};
  for (int i = 0; i < 6; ++i) target.deltas.insert(target.deltas.end(), {0, 0, 1});
  rig.g.hold("fold.targets[0]",
             std::make_shared<const MorphTargets>(std::vector<MorphTargets::Target>{target}, Index{9}));
  rig.g.connect("cage.points", "fold.inPoints[0]");
  const Status cut = rig.g.graph.Disconnect(rig.g.plug("w.driverPoints"));
  ASSERT_TRUE(cut.ok());
  rig.g.connect("fold.outPoints[0]", "w.driverPoints");
  rig.g.request.varying.clear();
  rig.g.vary("fold.weight[0]");
  rig.g.set("fold.weight[0]", 0.0);
  EXPECT_LT(MaxDistance(rig.Points(), rig.Rest()), 2e-7);
  rig.g.set("fold.weight[0]", 1.0);
  // The slopes rise outwards at 45 degrees: their normals lean inwards
  const double lean = 0.5 / std::sqrt(2.0);
  const std::vector<Double3> expected = {
      {-1 + lean, 0, 1 + lean}, {1 - lean, 0, 1 + lean}, {1 - lean, 1, 1 + lean}};
  EXPECT_LT(MaxDistance(rig.Points(), expected), 1e-6);
}

TEST(Wrap, WhatDoesNotCountIsNoInfluence) {
  // Spread over ten rings, the outer points have shares below the last digit of a float
  const TestMesh sheet = MakeSheet(41, 41);
  const TriangleTree tree(sheet.rest.view(), sheet.topology.triangles());
  const std::vector<Index> one = {20 * 41 + 20};
  const WrapInfluences spread = SurfaceInfluences(tree, sheet.topology, sheet.rest.view(), one, 1, 10);
  EXPECT_GT(spread.points.size(), 100u);
  EXPECT_LT(spread.points.size(), 300u);  // the hexagon of ten rings has 331
  EXPECT_GT(*std::min_element(spread.weights.begin(), spread.weights.end()), kLeastShare);
  EXPECT_NEAR(std::accumulate(spread.weights.begin(), spread.weights.end(), 0.0), 1, 1e-12);
  // A driver point that lies almost where influences end
  PointBuffer points = PointBuffer::FromPlaces(std::vector<Double3>{{0, 0, 0}, {0.5, 0, 0}, {0, 0.9999, 0}});
  const TriangleTree corners(std::as_const(points).view(), std::vector<Index>{0, 0, 0, 1, 1, 1, 2, 2, 2});
  const PointBuffer follower = PointBuffer::FromPlaces(std::vector<Double3>{{0, 0, 0}});
  const WrapInfluences near = NearestInfluences(corners, follower.view(), std::vector<Index>{0}, 1, 8);
  EXPECT_EQ(near.points, (std::vector<Index>{0, 1, 2}));
  points.view().y[2] = 0.99999f;
  const TriangleTree further(std::as_const(points).view(), std::vector<Index>{0, 0, 0, 1, 1, 1, 2, 2, 2});
  EXPECT_EQ(NearestInfluences(further, follower.view(), std::vector<Index>{0}, 1, 8).points,
            (std::vector<Index>{0, 1}));
}

TEST(Wrap, SnappedPointsLieOnTheDriver) {
  DriverRig rig("proximityWrap", Cage(), Cloth(), {{"wrapMode", "snap"}});
  const Matrix4 motion = ComposeTrs({0, 0, 1}, Random(6).Rotation(), {1, 0.5, 2});
  const std::vector<Double3> snapped = rig.At(motion);
  const ConstPointsView rest = rig.driver->data().rest.view();
  PointBuffer moved(rest.count);
  for (std::size_t i = 0; i < rest.count; ++i) {
    const Double3 p = TransformPoint(motion, {rest.x[i], rest.y[i], rest.z[i]});
    moved.view().x[i] = static_cast<float>(p.x);
    moved.view().y[i] = static_cast<float>(p.y);
    moved.view().z[i] = static_cast<float>(p.z);
  }
  const TriangleTree tree(moved.view(), rig.driver->data().triangles);
  for (const Double3& p : snapped) EXPECT_LT(tree.Closest(p).squared, 1e-12);
}

TEST(Wrap, EnvelopeWeightsAndDistanceLimit) {
  const Matrix4 up = Translation({0, 0, 1});
  for (const char* type : {"wrap", "proximityWrap"}) {
    DriverRig off(type, Cage(), Cloth(), {{"envelope", 0.0}});
    EXPECT_EQ(MaxDistance(off.At(up), off.Rest()), 0) << type;
    DriverRig half(type, Cage(), Cloth(), {{"envelope", 0.5}});
    std::vector<Double3> expected = half.Rest();
    for (Double3& p : expected) p.z += 0.5;
    EXPECT_LT(MaxDistance(half.At(up), expected), 1e-6) << type;

    DriverRig weighted(type, Cage(), Cloth());
    std::vector<float> weights(weighted.follower->point_count(), 0.0f);
    weights[7] = 1;
    weighted.g.hold("w.weights[0]", std::make_shared<const WeightMap>(weights));
    const std::vector<Double3> points = weighted.At(up), rest = weighted.Rest();
    for (std::size_t i = 0; i < points.size(); ++i)
      EXPECT_NEAR(points[i].z - rest[i].z, i == 7 ? 1 : 0, i == 7 ? 1e-6 : 0) << type << i;
    // What does not move asks for nothing: the rings of one point's influences are left
    EXPECT_LT(weighted.PointsOf("move"), 60u) << type;

    // One point lies beyond the distance
    DriverRig limited(type, Flat(0, 41), MeshOf({0, 0, 0.1f, 0.1f, 0, 0.1f, 0, 0, 0.5f}, {0, 1, 2}),
                      {{"maxDistance", 0.3}});
    const std::vector<Double3> near = limited.At(up);
    EXPECT_NEAR(near[0].z, 1.1, 1e-6) << type;
    EXPECT_NEAR(near[1].z, 1.1, 1e-6) << type;
    EXPECT_EQ(near[2].z, 0.5) << type;
  }
}

TEST(Wrap, SmoothInfluencesSpreadASpike) {
  // One driver point jumps up: with spread influences the point above it rises less, and neighbours more
  const auto deltas = [](int smooth) {
    DriverRig rig("proximityWrap", Flat(0, 9), Flat(0.05, 9),
                  {{"wrapMode", "snap"}, {"smoothInfluences", smooth}});
    rig.g.add("blendShape", "fold");
    rig.g.hold("fold.targets[0]", std::make_shared<const MorphTargets>(
                                      std::vector<MorphTargets::Target>{{"up", {40}, {0, 0, 1}}}, Index{81}));
    rig.g.connect("cage.points", "fold.inPoints[0]");
    EXPECT_TRUE(rig.g.graph.Disconnect(rig.g.plug("w.driverPoints")).ok());
    rig.g.connect("fold.outPoints[0]", "w.driverPoints");
    rig.g.request.varying.clear();
    rig.g.vary("fold.weight[0]");
    rig.g.set("fold.weight[0]", 1.0);
    std::vector<double> heights;
    for (const Double3& p : rig.Points()) heights.push_back(p.z);
    return heights;
  };
  const std::vector<double> sharp = deltas(0), spread = deltas(1);
  EXPECT_NEAR(sharp[40], 1, 1e-6);
  EXPECT_NEAR(sharp[41], 0, 1e-6);
  EXPECT_NEAR(spread[40], 0.5, 1e-6);       // half of the weight stays
  EXPECT_NEAR(spread[41], 1.0 / 12, 1e-6);  // a sixth of the half comes from the middle
}

TEST(Wrap, SubsetsHaveTheBitsOfTheWholeAndNeedFewDriverPoints) {
  for (const auto& [type, values] : kTurning) {
    DriverRig rig(type, GridMesh(41, 41, [](double x, double y) { return 0.2 * x * y; }), Cloth(), values);
    const Index needed = rig.ExpectSubsetsKeepTheBits(3);
    EXPECT_GT(needed, 3u) << type;
    EXPECT_LT(needed, 3u * 120u) << type;
    EXPECT_LT(needed, 41u * 41u / 4) << type;
  }
}

TEST(Wrap, FoldedDriversGiveNumbers) {
  // Flattened to a line, to a point, mirrored
  for (const auto& [type, values] : kTurning) {
    DriverRig rig(type, Cage(), Cloth(), values);
    for (const Double3& scale : {Double3{1, 0, 0}, Double3{0, 0, 0}, Double3{-1, 1, 1}, Double3{1, 1, 0}}) {
      for (const Double3& p : rig.At(Scaling(scale))) EXPECT_LT(Length(p), 10) << type;
    }
  }
}

// proximityWrap as it is defined, in double and without sharing anything.
std::vector<Double3> NaiveWrap(const TestMesh& driver, const std::vector<Double3>& rest,
                               const std::vector<Double3>& now, ConstPointsView points, bool stretched) {
  const std::span<const Index> triangles = driver.topology.triangles();
  struct Frame {
    Matrix4 f;
    Double3 normal;
  };
  const auto normal_at = [&](Index p, const std::vector<Double3>& at) {
    Double3 sum;
    for (const Index t : driver.topology.point_triangles().row(p)) {
      const Index* c = &triangles[3 * std::size_t{t}];
      sum = sum + Cross(at[c[1]] - at[c[0]], at[c[2]] - at[c[0]]);
    }
    return sum * (1 / Length(sum));
  };
  const auto frame_at = [&](Index p) {
    Matrix4 to = Scaling({0, 0, 0}), from = to;
    const auto add = [](Matrix4* m, Double3 a, Double3 b, double weight) {
      for (int r = 0; r < 3; ++r) {
        for (int c = 0; c < 3; ++c) (*m)(r, c) += weight * a[r] * b[c];
      }
    };
    double square = 0;
    const auto ring = driver.topology.neighbors().row(p);
    for (const Index j : ring) {
      const Double3 e = rest[j] - rest[p];
      add(&from, e, e, 1);
      add(&to, now[j] - now[p], e, 1);
      square += Dot(e, e);
    }
    const Double3 n = normal_at(p, rest), moved = normal_at(p, now);
    add(&from, n, n, square / static_cast<double>(ring.size()));
    add(&to, moved, n, square / static_cast<double>(ring.size()));
    return Frame{to * InverseOrIdentity(from), moved};
  };
  std::vector<Double3> result;
  for (std::size_t i = 0; i < points.count; ++i) {
    const Double3 p{points.x[i], points.y[i], points.z[i]};
    SurfacePoint best;
    for (std::size_t t = 0; t < triangles.size(); t += 3) {
      SurfacePoint one = ClosestOnTriangle(driver.rest.view(), &triangles[t], p);
      one.triangle = static_cast<Index>(t / 3);
      if (one.squared < best.squared) best = one;
    }
    Double3 anchor, anchor_now, normal, normal_now;
    Matrix4 f = Scaling({0, 0, 0});
    for (std::size_t k = 0; k < 3; ++k) {
      const Index c = triangles[3 * std::size_t{best.triangle} + k];
      const Frame frame = frame_at(c);
      anchor = anchor + rest[c] * best.weights[k];
      anchor_now = anchor_now + now[c] * best.weights[k];
      normal = normal + normal_at(c, rest) * best.weights[k];
      normal_now = normal_now + frame.normal * best.weights[k];
      for (std::size_t m = 0; m < 16; ++m) f.m[m] += frame.f.m[m] * best.weights[k];
    }
    normal = normal * (1 / Length(normal));
    normal_now = normal_now * (1 / Length(normal_now));
    const Double3 any = std::fabs(normal.x) < 0.5 ? Double3{1, 0, 0} : Double3{0, 1, 0};
    const Double3 t = Cross(normal, any) * (1 / Length(Cross(normal, any))), b = Cross(normal, t);
    Double3 t_now = TransformVector(f, t), b_now = TransformVector(f, b);
    if (!stretched) {  // the nearest rotation, by its angle in the plane
      const Double3 u = t_now - normal_now * Dot(normal_now, t_now), x = u * (1 / Length(u)),
                    y = Cross(normal_now, x);
      const double angle = std::atan2(Dot(t_now, y) - Dot(b_now, x), Dot(t_now, x) + Dot(b_now, y));
      t_now = x * std::cos(angle) + y * std::sin(angle);
      b_now = Cross(normal_now, t_now);
    }
    const Double3 o = p - anchor;
    result.push_back(anchor_now + t_now * Dot(t, o) + b_now * Dot(b, o) + normal_now * Dot(normal, o));
  }
  return result;
}

TEST(Wrap, IsWhatItsDefinitionSays) {
  const TestMesh driver = MakeSheet(15, 13);
  const std::vector<Double3> rest = ToDouble(driver.rest.view());
  const TestMesh above = MakeSheet(9, 8, 2);
  PointBuffer points(above.count()), bent(driver.count());
  for (std::size_t i = 0; i < above.count(); ++i) {
    points.view().x[i] = above.rest.view().x[i] * 0.8f;
    points.view().y[i] = above.rest.view().y[i] * 0.8f + 0.01f;
    points.view().z[i] = above.rest.view().z[i] + 0.03f;
  }
  std::vector<Double3> now;
  for (std::size_t i = 0; i < rest.size(); ++i) {
    const Double3 p = rest[i];
    const Double3 q{0.6 * std::sin(1.6 * p.x), 0.4 * p.x * p.x + 1.2 * p.y,
                    p.z + 0.6 * std::cos(1.6 * p.x) + 0.2 * p.y * p.y};
    bent.view().x[i] = static_cast<float>(q.x);
    bent.view().y[i] = static_cast<float>(q.y);
    bent.view().z[i] = static_cast<float>(q.z);
    now.push_back({bent.view().x[i], bent.view().y[i], bent.view().z[i]});
  }
  const TriangleTree tree(driver.rest.view(), driver.topology.triangles());
  std::vector<Index> all(above.count()), drivers(driver.count());
  std::iota(all.begin(), all.end(), 0u);
  std::iota(drivers.begin(), drivers.end(), 0u);
  const ConstPointsView in = std::as_const(points).view();
  const WrapInfluences influences = SurfaceInfluences(tree, driver.topology, in, all, 10, 0);
  double far = 0;
  for (const bool stretched : {false, true}) {
    const WrapKernel kernel(stretched ? WrapMode::kSurface : WrapMode::kOffset, driver.topology, rest,
                            Matrix4(), influences, in, all, drivers);
    AlignedFloats scratch(kernel.ScratchFloats());
    PointBuffer out(all.size());
    kernel.Run({1, std::as_const(bent).view()}, in, out.view(), scratch.span());
    const std::vector<Double3> got = ToDouble(std::as_const(out).view()),
                               expected = NaiveWrap(driver, rest, now, in, stretched);
    EXPECT_LT(MaxDistance(got, expected), 2e-6) << stretched;
    far = std::max(far, MaxDistance(got, ToDouble(in)));
    // At rest everything stays, to the bit
    kernel.Run({1, driver.rest.view()}, in, out.view(), scratch.span());
    EXPECT_EQ(MaxDistance(ToDouble(std::as_const(out).view()), ToDouble(in)), 0) << stretched;
  }
  EXPECT_GT(far, 0.1);
}

TEST(Wrap, ErrorsSayWhatIsMissing) {
  const auto error_of = [](DriverRig& rig) {
    const Status status = rig.g.try_pull("w.outPoints[0]");
    return status.ok() ? std::string("no error") : status.ToString();
  };
  for (const char* type : {"wrap", "proximityWrap", "shrinkWrap"}) {
    DriverRig alone(type, Cage(), Cloth());
    ASSERT_TRUE(alone.g.graph.Disconnect(alone.g.plug("w.driverPoints")).ok());
    EXPECT_NE(error_of(alone).find("it has no driver"), std::string::npos);
    DriverRig other(type, Cage(), Cloth());
    other.g.hold("w.driverMesh", Cloth());
    EXPECT_NE(error_of(other).find("driver's mesh has 483 points, driverPoints 255"), std::string::npos);
    DriverRig bare(type, MeshOf({0, 0, 0, 1, 0, 0}, {}), Cloth());
    EXPECT_NE(error_of(bare).find("has no faces"), std::string::npos);
    DriverRig flat(type, Cage(), Cloth(), {{"driverMatrix", Scaling({1, 0, 1})}});
    EXPECT_NE(error_of(flat).find("driverMatrix is singular"), std::string::npos);
  }
}

}  // namespace
}  // namespace kpsa::engine
