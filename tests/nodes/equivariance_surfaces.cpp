// Nodes that read the surface of their own mesh, or follow that of another one.
#include "tests/nodes/equivariance.h"

namespace kpsa::engine {
namespace {

// A driver at a stage after its skin.
std::vector<GivenInput> DriverAfterSkin(std::vector<GivenInput> own) {
  const auto surface = EquivarianceSurface();
  own.push_back({"driverPoints", Moves::kPlace, BentPoints(*surface, 0), BentPoints(*surface, 0.15)});
  own.push_back({"driverMesh", Moves::kPlace, surface, {}, true});
  return own;
}

// Before it: its points stay, their matrix at rest moves.
std::vector<GivenInput> DriverBeforeSkin(std::vector<GivenInput> own) {
  const auto surface = EquivarianceSurface();
  own.push_back(Setting("driverMesh", surface));
  own.push_back({"driverPoints", Moves::kNot, BentPoints(*surface, 0), BentPoints(*surface, 0.15)});
  own.push_back({"driverMatrix", Moves::kFrame, ComposeTrs({0.1, 0, 0.2}, {0.1, 0.2, 0, 1}, {1, 1, 1}), {}});
  return own;
}

const char* const kCarriedByNobody = "a driver before its skin is not carried by it";

void AddOwnSurfaces(std::vector<NodeSetUp>* all) {
  for (const bool before : {false, true}) {
    auto* stage = before ? BeforeSkin : AfterSkin;
    all->push_back(stage("deltaMush", "", {Setting("iterations", 4), Setting("displacement", 0.8)}, true));
    all->push_back(
        stage("deltaMush", "distanceWeight",
              {Setting("iterations", 3), Setting("distanceWeight", 1.0), Setting("pinBorderVertices", false)},
              true));
    all->push_back(
        stage("tension", "", {Setting("compressScale", 0.4), Setting("stretchScale", -0.3)}, true));
    all->back().gives.push_back({"stretch[0]", Moves::kNot});
    all->back().gives.push_back({"compress[0]", Moves::kNot});
    all->push_back(stage("jiggle", "", {{"time", Moves::kNot, 0.0, 0.25}, Setting("stiffness", 0.4)}, true));
  }
}

void AddWrapSetUps(std::vector<NodeSetUp>* all) {
  const std::vector<std::pair<std::string, GivenInput>> ways = {
      {"wrap", Setting("influences", 5)},
      {"wrap", Setting("maxDistance", 0.35)},
      {"proximityWrap", Setting("wrapMode", "offset")},
      {"proximityWrap", Setting("wrapMode", "surface")},
      {"proximityWrap", Setting("wrapMode", "snap")},
      {"proximityWrap", Setting("smoothInfluences", 2)}};
  for (const auto& [type, way] : ways) {
    const std::string what = way.input + " " + way.rest.ToString();
    const bool snaps = what == "wrapMode snap";  // onto the driver, whoever carries the points
    all->push_back(AfterSkin(type, what, DriverAfterSkin({way}), snaps));
    all->push_back(BeforeSkin(type, what, DriverBeforeSkin({way}), false));
    for (GivenInput& input : all->back().given) input.idle |= input.input == "parentMatrix";
  }
}

void AddShrinkWrapSetUps(std::vector<NodeSetUp>* all) {
  const GivenInput axis{"axis", Moves::kDirection, Double3{0.1, 0.2, 1}, {}};
  for (const char* projection : {"closest", "vertexNormals", "parallelToAxis"}) {
    const bool along = projection == std::string("parallelToAxis");
    const GivenInput way = Setting("projection", projection);
    const std::vector<std::vector<GivenInput>> settings = {
        {Setting("bidirectional", true)},
        {Setting("reverse", true), Setting("closestIfNoIntersection", true)},
        {Setting("side", "outside"), Setting("offset", 0.1), Setting("bidirectional", true)},
        {Setting("side", "inside"), Setting("offset", 0.1), Setting("bidirectional", true),
         Setting("closestIfNoIntersection", true)}};
    for (std::size_t i = 0; i < settings.size(); ++i) {
      std::vector<GivenInput> own = settings[i];
      own.push_back(way);
      if (along) own.push_back(axis);
      const std::string what = std::string(projection) + " " + std::to_string(i);
      all->push_back(AfterSkin("shrinkWrap", what, DriverAfterSkin(own), !along));
      all->push_back(BeforeSkin("shrinkWrap", what, DriverBeforeSkin(own), false));
      for (GivenInput& input : all->back().given) input.idle |= input.input == "parentMatrix";
    }
  }
}

// The weights at points after the skin and before it.
void AddFalloffs(std::vector<NodeSetUp>* all) {
  RandomFrames random(31);
  const auto place = [&](const char* name) { return WorldMatrix(name, &random); };
  const GivenInput radius = Setting("radius", 1.2);
  const GivenInput ball{"matrix", Moves::kFrame, random.Scaled(), random.Scaled()};
  const std::vector<std::pair<std::string, std::vector<GivenInput>>> shapes = {
      {"sphereFalloff", {ball, radius}},
      {"capsuleFalloff", {place("startMatrix"), place("endMatrix"), radius}},
      {"planeFalloff", {ball, Setting("start", -0.4), Setting("end", 0.5)}},
      {"proximityFalloff", DriverAfterSkin({Setting("radius", 0.6)})}};
  const auto sheet = EquivarianceSheet();
  const GivenInput points{"inPoints[0]", Moves::kPlace, BentPoints(*sheet, 0), BentPoints(*sheet, 0.2)};
  for (const auto& [type, own] : shapes) {
    NodeSetUp after{type, "after the skin", {points}, {{"outputWeights[0]", Moves::kNot}}, 0, ""};
    after.given.push_back(place("parentMatrix"));
    after.given.back().idle = true;
    after.given.insert(after.given.end(), own.begin(), own.end());
    NodeSetUp before = after;
    before.what = "before the skin";
    before.given[0].moves = Moves::kNot;
    before.given[1].idle = false;
    before.given.push_back({"geometryMatrix[0]", Moves::kFrame, random.Rigid(0.3), {}});
    all->push_back(after);
    all->push_back(before);
  }
  NodeSetUp behind{"proximityFalloff",
                   "a driver before its skin",
                   DriverBeforeSkin({points, Setting("radius", 0.6)}),
                   {{"outputWeights[0]", Moves::kNot}},
                   kFrameAlone,
                   kCarriedByNobody};
  all->push_back(behind);
  NodeSetUp carried = behind;
  carried.what = "before the skin with its driver";
  carried.given[0].moves = Moves::kNot;
  carried.given.push_back(place("parentMatrix"));
  carried.given.back().idle = true;  // it carries both
  carried.given.push_back({"geometryMatrix[0]", Moves::kFrame, random.Rigid(0.3), {}});
  carried.unless = 0;
  carried.why = "";
  all->push_back(carried);
}

void AddPins(std::vector<NodeSetUp>* all) {
  RandomFrames random(32);
  const auto& triangles = EquivarianceSurface()->data().triangles;
  std::vector<float> uvs;
  for (const Index corner : triangles) {
    uvs.push_back(static_cast<float>(corner % 6) / 5);
    uvs.push_back(static_cast<float>(corner / 6) / 4);
  }
  const GivenInput mapped = Setting("driverUvs", std::make_shared<const TriangleUvs>(uvs));
  const std::vector<GivenInput> two = {mapped, Setting("coordinateU[0]", 0.37),
                                       Setting("coordinateV[0]", 0.71), Setting("face[1]", 7),
                                       Setting("barycentric[1]", Double3{0.2, 0.5, 0.3})};
  const std::vector<GivenInput> one = {mapped, Setting("parameterU", 0.37), Setting("parameterV", 0.71)};
  const std::vector<GivenOutput> pins = {{"outputMatrix[0]", Moves::kFrame},
                                         {"outputMatrix[1]", Moves::kFrame}};
  const std::vector<GivenOutput> follows = {{"outTranslate", Moves::kPlace},
                                            {"outRotate", Moves::kTurn},
                                            {"outMatrix", Moves::kFrame},
                                            {"outNormal", Moves::kDirection},
                                            {"outTangent", Moves::kDirection}};
  all->push_back({"uvPin", "world", DriverAfterSkin(two), pins, 0, ""});
  all->push_back({"uvPin", "before the skin", DriverBeforeSkin(two), pins, kFrameAlone, kCarriedByNobody});
  NodeSetUp local{"uvPin", "local", DriverAfterSkin(two), pins, 0, ""};
  local.given.push_back(Setting("relativeSpaceMode", "local"));
  all->push_back(local);
  NodeSetUp custom{"uvPin", "custom", DriverAfterSkin(two), pins, 0, ""};
  custom.given.push_back(Setting("relativeSpaceMode", "custom"));
  custom.given.push_back(WorldMatrix("relativeSpaceMatrix", &random));
  for (GivenOutput& pin : custom.gives) pin.moves = Moves::kNot;
  all->push_back(custom);
  all->push_back({"follicle", "", DriverAfterSkin(one), follows, 0, ""});
  all->push_back(
      {"follicle", "before the skin", DriverBeforeSkin(one), follows, kFrameAlone, kCarriedByNobody});
  all->push_back({"follicle", "in a face",
                  DriverAfterSkin({Setting("face", 4), Setting("barycentric", Double3{0.6, 0.1, 0.3})}),
                  follows, 0, ""});
}

}  // namespace

std::vector<NodeSetUp> SurfaceSetUps() {
  std::vector<NodeSetUp> all;
  AddOwnSurfaces(&all);
  AddWrapSetUps(&all);
  AddShrinkWrapSetUps(&all);
  AddFalloffs(&all);
  AddPins(&all);
  return all;
}

}  // namespace kpsa::engine
