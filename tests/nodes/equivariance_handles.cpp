// Deformers that handles, joints, shapes, curves and control points move.
#include <cmath>

#include "tests/nodes/equivariance.h"

namespace kpsa::engine {
namespace {

// The points come in where the mesh is; where that lies in the world is no matter.
void InMeshSpace(NodeSetUp* s) {
  s->given[0].moves = Moves::kNot;
  s->given.push_back({"geometryMatrix[0]", Moves::kFrame, Translation({0.1, 0.2, 0.3}), {}, true});
}

// Joints that share the points; bound where they are at rest, which is mesh space.
NodeSetUp SkinSetUp(const char* method) {
  RandomFrames random(21);
  const auto sheet = EquivarianceSheet();
  std::vector<Index> offsets = {0}, joints;
  std::vector<float> weights;
  for (Index i = 0; i < sheet->point_count(); ++i) {
    const float first = static_cast<float>(i % 9) / 8;
    for (const auto& [joint, weight] : {std::pair{i % 3, first}, std::pair{(i + 1) % 3, 1 - first}}) {
      joints.push_back(joint);
      weights.push_back(weight);
    }
    offsets.push_back(static_cast<Index>(joints.size()));
  }
  NodeSetUp s = AfterSkin(
      "skinCluster", method,
      {Setting("skinningMethod", method),
       Setting("influences[0]", std::make_shared<const Influences>(offsets, joints, weights, Index{3})),
       Setting("blendWeights[0]", std::make_shared<const WeightMap>(
                                      NumberedPoints(sheet->point_count(), 0.07).points()->Interleaved()))});
  for (const char* element : {"[0]", "[1]", "[2]"}) {
    const Matrix4 bind = random.Rigid(0.5);
    s.given.push_back(Setting(std::string("bindPreMatrix") + element, InverseOrIdentity(bind)));
    s.given.push_back({std::string("matrix") + element, Moves::kFrame, bind, bind * random.Rigid(0.2)});
  }
  s.given.push_back({"offset", Moves::kDirection, Double3(), Double3{0.1, -0.2, 0.3}});
  InMeshSpace(&s);
  return s;
}

void AddSkins(std::vector<NodeSetUp>* all) {
  for (const char* method : {"classicLinear", "dualQuaternion", "weightBlended"})
    all->push_back(SkinSetUp(method));
  NodeSetUp half = SkinSetUp("classicLinear");
  half.what = "envelope 0.5";
  half.given.push_back(Setting("envelope", 0.5));
  half.unless = kEveryTrial;
  half.why = "half of each point stays in mesh space";
  all->push_back(half);
  RandomFrames random(22);
  NodeSetUp placed = AfterSkin("transformGeometry", "", {WorldMatrix("matrix", &random)});
  InMeshSpace(&placed);
  all->push_back(placed);
  all->push_back(AfterSkin("tripwire", "", {}));
  all->push_back(BeforeSkin("tripwire", "", {}));
}

Value ShapesOf(Index points) {
  MorphTargets::Target up{"up", {}, {}}, side{"side", {}, {}};
  for (Index i = 0; i < points; ++i) {
    up.points.push_back(i);
    for (float d : {0.01f * static_cast<float>(i), 0.3f, 0.2f}) up.deltas.push_back(d);
    if (i % 2 == 1) continue;
    side.points.push_back(i);
    for (float d : {-0.2f, 0.1f, 0.005f * static_cast<float>(i)}) side.deltas.push_back(d);
  }
  return std::make_shared<const MorphTargets>(std::vector<MorphTargets::Target>{up, side}, points);
}

void AddBlendShapes(std::vector<NodeSetUp>* all) {
  const Index count = EquivarianceSheet()->point_count();
  const GivenInput smile{"weight[0]", Moves::kNot, 0.0, 0.8}, open{"weight[1]", Moves::kNot, 0.2, 0.6};
  const GivenInput shapes{"targets[0]", Moves::kDirection, ShapesOf(count), {}};
  all->push_back(AfterSkin("blendShape", "", {smile, open, shapes}, false));
  all->push_back(
      AfterSkin("blendShape", "factors and a falloff",
                {smile, open, shapes, Setting("pointWeights[0]", NumberedPoints(count, 0.03)),
                 Setting("falloffWeights[0]", NumberedPoints(count, 0.05)), Setting("envelope", 0.7)},
                false));
  all->push_back(BeforeSkin("blendShape", "", {smile, open, Setting("targets[0]", shapes.rest)}));
}

void AddClusters(std::vector<NodeSetUp>* all) {
  RandomFrames random(23);
  const GivenInput handle{"matrix", Moves::kFrame, random.Scaled(), random.Scaled()};
  const GivenInput center{"falloffCenter", Moves::kPlace, Double3{0.3, -0.2, 0.1}, {}};
  const GivenInput radius = Setting("falloffRadius", 2.0);
  all->push_back(AfterSkin("cluster", "", {handle}, false));
  all->push_back(BeforeSkin("cluster", "", {handle}, false));
  all->push_back(AfterSkin("softMod", "", {handle, center, radius}, false));
  all->push_back(BeforeSkin("softMod", "", {handle, center, radius}, false));
  all->push_back(AfterSkin("softMod", "about its handle", {handle, radius}, false));
  for (const char* type : {"cluster", "softMod"}) {
    const GivenInput bind{"bindPreMatrix", Moves::kInverse, random.Scaled(), random.Scaled()};
    all->push_back(AfterSkin(type, "bindPreMatrix", {handle, bind, Setting("falloffRadius", 2.0)}));
    if (std::string(type) == "cluster") all->back().given.pop_back();
  }
}

void AddNonLinears(std::vector<NodeSetUp>* all) {
  const std::vector<std::pair<std::string, std::vector<GivenInput>>> settings = {
      {"bend", {Setting("curvature", 0.9)}},
      {"twist", {Setting("startAngle", -0.4), Setting("endAngle", 1.1)}},
      {"squash", {Setting("factor", 0.6), Setting("startSmoothness", 0.5), Setting("endSmoothness", 0.2)}},
      {"flare", {Setting("startFlareX", 1.5), Setting("endFlareZ", 0.5), Setting("curve", 0.3)}},
      {"sine", {Setting("amplitude", 0.2), Setting("wavelength", 0.7), Setting("dropoff", 0.5)}},
      {"wave", {Setting("amplitude", 0.2), Setting("wavelength", 0.6), Setting("dropoff", -0.5)}}};
  for (const auto& [type, own] : settings) {
    RandomFrames random(24);
    std::vector<GivenInput> given = own;
    given.push_back({"matrix", Moves::kFrame, random.Scaled(), random.Scaled()});
    all->push_back(AfterSkin(type, "", given));
    all->push_back(BeforeSkin(type, "", given, false));
  }
}

void AddSculpts(std::vector<NodeSetUp>* all) {
  RandomFrames random(25);
  const GivenInput handle{"matrix", Moves::kFrame, ComposeTrs({0.2, 0.1, -0.1}, random.Turn(), {1, 0.8, 1.3}),
                          ComposeTrs({0.1, -0.1, 0.15}, random.Turn(), {1, 0.9, 1.2})};
  const GivenInput origin{"stretchOrigin", Moves::kPlace, Double3{0.1, 0.2, -1}, Double3{-0.3, 0, -1}};
  for (const char* mode : {"flip", "project", "stretch"}) {
    std::vector<GivenInput> own = {handle, Setting("mode", mode), Setting("radius", 0.4),
                                   Setting("dropoffDistance", 0.3), Setting("maximumDisplacement", 0.5)};
    if (std::string(mode) == "stretch") own.push_back(origin);
    all->push_back(AfterSkin("sculpt", mode, own));
    all->push_back(BeforeSkin("sculpt", mode, own, false));
  }
}

void AddLattices(std::vector<NodeSetUp>* all) {
  std::vector<float> rest, now;
  for (int i = 0; i < 18; ++i) {
    const float s = static_cast<float>(i % 3) / 2, t = static_cast<float>(i / 3 % 3) / 2,
                u = static_cast<float>(i / 9);
    rest.insert(rest.end(), {s, t, u});
    now.insert(now.end(), {s + 0.2f * t, t - 0.1f * u * s, u + 0.3f * s * t});
  }
  const GivenInput controls{"points", Moves::kNot, PointsOf(rest), PointsOf(now)};
  const GivenInput divisions = Setting("divisions", std::vector<std::int64_t>{3, 3, 2});
  GivenInput low{"boxMin", Moves::kShift, Double3{-0.6, -0.7, -0.4}, {}},
      high{"boxMax", Moves::kShift, Double3{0.7, 0.8, 0.5}, {}};
  low.fits = high.fits = true;  // a box with one corner elsewhere is inside out
  for (const char* interpolation : {"linear", "bspline", "bernstein"}) {
    for (const char* outside : {"inside", "all", "falloff"}) {
      NodeSetUp s = AfterSkin("lattice", std::string(interpolation) + ", " + outside,
                              {controls, divisions, low, high, Setting("interpolation", interpolation),
                               Setting("outside", outside), Setting("outsideFalloffDist", 0.5)},
                              false);
      s.unless = kAllTurned;
      s.why = "a box at rest lies along the axes of its stage";
      all->push_back(s);
    }
  }
  all->push_back(BeforeSkin(
      "lattice", "", {controls, divisions, Setting("boxMin", low.rest), Setting("boxMax", high.rest)}));
}

Value CurveOf(std::vector<Double3> vertices) {
  return std::make_shared<const class Curve>(std::move(vertices), false);
}

void AddWires(std::vector<NodeSetUp>* all) {
  RandomFrames random(26);
  const GivenInput along{"curve", Moves::kPlace, CurveOf({{-1, 0.1, 0}, {0, -0.2, 0.3}, {1, 0.3, 0.2}}), {}};
  const GivenInput moved{"displacements", Moves::kDirection, PointsOf({0, 0, 0, 0, 0, 0, 0, 0, 0}),
                         PointsOf({0.1f, 0.3f, 0, -0.2f, 0.1f, 0.5f, 0, 0.2f, -0.3f})};
  const GivenInput dropoff = Setting("dropoff", 0.9);
  all->push_back(AfterSkin("wire", "", {along, moved, dropoff}));
  all->push_back(BeforeSkin("wire", "", {along, moved, dropoff}, false));
  const GivenInput across{
      "baseWire[1]", Moves::kPlace, CurveOf({{0.2, -1, 0}, {0, 0, 0.2}, {0.1, 1, 0}}), {}};
  GivenInput first = along, first_moved = moved, second_moved = moved;
  first.input = "baseWire[0]", first_moved.input = "deformedWire[0]", second_moved.input = "deformedWire[1]";
  second_moved.now = PointsOf({0, 0.1f, 0.4f, 0.3f, 0, 0.2f, 0.1f, -0.2f, 0.2f});
  all->push_back(AfterSkin("wire", "several",
                           {first, across, first_moved, second_moved, dropoff,
                            Setting("dropoffDistance[1]", 0.6), Setting("crossingEffect", 0.4)}));
  GivenInput line = along;
  line.idle = true;
  all->push_back({"curve",
                  "",
                  {line, WorldMatrix("parentMatrix", &random), {"cv", Moves::kNot, moved.rest, moved.now}},
                  {{"displacements", Moves::kDirection}, {"worldMatrix", Moves::kFrame}},
                  0,
                  ""});
}

}  // namespace

std::vector<NodeSetUp> HandleSetUps() {
  std::vector<NodeSetUp> all;
  AddSkins(&all);
  AddBlendShapes(&all);
  AddClusters(&all);
  AddNonLinears(&all);
  AddSculpts(&all);
  AddLattices(&all);
  AddWires(&all);
  return all;
}

}  // namespace kpsa::engine
