// Transforms, matrices, vectors, lights; and nodes that know no world.
#include "tests/nodes/equivariance.h"

namespace kpsa::engine {
namespace {

void AddTransforms(std::vector<NodeSetUp>* all) {
  for (const char* type : {"transform", "joint"}) {
    RandomFrames random(51);
    all->push_back({type,
                    "",
                    {{"parentMatrix", Moves::kFrame, random.Scaled(), random.Scaled()},
                     Setting("offsetParentMatrix", random.Rigid()),
                     Setting("restMatrix", random.Rigid()),
                     Setting("translate", Double3{0.3, 0.1, -0.2}),
                     Setting("rotate", Double3{0.2, -0.4, 0.1}),
                     Setting("scale", Double3{1.2, 0.9, 1})},
                    {{"matrix", Moves::kNot},
                     {"worldMatrix", Moves::kFrame},
                     {"worldInverseMatrix", Moves::kInverse},
                     {"poseRotate", Moves::kNot},
                     {"poseRotateVector", Moves::kNot},
                     {"poseTranslate", Moves::kNot},
                     {"poseScale", Moves::kNot},
                     {"swing", Moves::kNot},
                     {"twist", Moves::kNot}},
                    0,
                    ""});
  }
}

void AddMatrices(std::vector<NodeSetUp>* all) {
  RandomFrames random(52);
  const auto frame = [&](const char* name) {
    return GivenInput{name, Moves::kFrame, random.Scaled(), random.Scaled()};
  };
  all->push_back({"multMatrix",
                  "",
                  {frame("matrixIn[0]"), Setting("matrixIn[1]", random.Scaled())},
                  {{"matrixSum", Moves::kFrame}},
                  0,
                  ""});
  all->push_back({"composeMatrix",
                  "",
                  {{"inputTranslate", Moves::kPlace, Double3{1, 2, 3}, Double3{0.5, -1, 0}},
                   {"inputRotate", Moves::kTurn, Double3{0.3, 0.7, -0.4}, Double3{-1, 0.2, 0.9}},
                   Setting("inputScale", Double3{1, 2, 0.5})},
                  {{"outputMatrix", Moves::kFrame}},
                  0,
                  ""});
  all->push_back({"decomposeMatrix",
                  "",
                  {frame("inputMatrix")},
                  {{"outputTranslate", Moves::kPlace},
                   {"outputRotate", Moves::kTurn},
                   {"outputScale", Moves::kNot},
                   {"outputQuat", Moves::kTurn}},
                  0,
                  ""});
  all->push_back({"inverseMatrix", "", {frame("inputMatrix")}, {{"outputMatrix", Moves::kInverse}}, 0, ""});
  NodeSetUp blend{
      "blendMatrix",
      "part by part",
      {frame("inputMatrix"), frame("targetMatrix[0]"), frame("targetMatrix[1]"),
       Setting("targetWeight[0]", 0.7), Setting("targetWeight[1]", 0.4), Setting("translateWeight", 0.6),
       Setting("rotateWeight", 0.9), Setting("scaleWeight", 0.3)},
      {{"outputMatrix", Moves::kFrame}},
      0,
      ""};
  all->push_back(blend);
  all->push_back({"pickMatrix",
                  "translation",
                  {frame("inputMatrix"), Setting("useRotate", false)},
                  {{"outputMatrix", Moves::kFrame}},
                  kAllTurned | kNowTurned,
                  "the identity takes the place of the rotation"});
  all->push_back({"pickMatrix",
                  "rotation",
                  {frame("inputMatrix"), Setting("useTranslate", false)},
                  {{"outputMatrix", Moves::kFrame}},
                  kEveryTrial,
                  "the origin takes the place of the translation"});
}

void AddVectors(std::vector<NodeSetUp>* all) {
  RandomFrames random(53);
  const auto vector = [&](const char* name, Moves moves) {
    return GivenInput{name, moves, random.Vector(), random.Vector()};
  };
  const auto product = [&](const char* operation, std::vector<GivenInput> given, Moves gives) {
    given.push_back(Setting("operation", operation));
    all->push_back({"vectorProduct", operation, std::move(given), {{"output", gives}}, 0, ""});
  };
  const auto first = vector("input1", Moves::kDirection), second = vector("input2", Moves::kDirection);
  const GivenInput frame = WorldMatrix("matrix", &random), local = Setting("input1", Double3{1, 2, 3});
  product("noOperation", {first}, Moves::kDirection);
  product("dotProduct", {first, second}, Moves::kNot);
  product("crossProduct", {first, second}, Moves::kDirection);
  product("vectorMatrixProduct", {local, frame}, Moves::kDirection);
  product("pointMatrixProduct", {local, frame}, Moves::kPlace);
  const auto from = vector("vector1", Moves::kDirection), to = vector("vector2", Moves::kDirection);
  all->push_back(
      {"angleBetween", "", {from, to}, {{"angle", Moves::kNot}, {"axis", Moves::kDirection}}, 0, ""});
  GivenInput shifted = from, shifted_to = to;  // a shift does nothing to them
  shifted.idle = shifted_to.idle = true;
  all->push_back({"angleBetween",
                  "angles",
                  {shifted, shifted_to},
                  {{"euler", Moves::kTurn}},
                  kAllTurned | kNowTurned,
                  "a turn in the world, seen in its axes, is no frame in it"});
  all->push_back({"blendColors",
                  "",
                  {vector("color1", Moves::kPlace), vector("color2", Moves::kPlace), Setting("blender", 0.3)},
                  {{"output", Moves::kPlace}},
                  0,
                  ""});
  all->push_back({"condition",
                  "",
                  {vector("colorIfTrue", Moves::kPlace),
                   vector("colorIfFalse", Moves::kPlace),
                   {"firstTerm", Moves::kNot, 0.0, 1.0}},
                  {{"outColor", Moves::kPlace}},
                  0,
                  ""});
  all->push_back({"distanceBetween",
                  "",
                  {WorldMatrix("inMatrix1", &random), vector("point2", Moves::kPlace),
                   Setting("point1", Double3{0.1, 0.2, 0.3})},
                  {{"distance", Moves::kNot}},
                  0,
                  ""});
}

void AddLights(std::vector<NodeSetUp>* all) {
  for (const char* type : {"pointLight", "sphereLight", "areaLight", "sunLight"}) {
    RandomFrames random(54);
    all->push_back({type,
                    "",
                    {WorldMatrix("matrix", &random), Setting("color", Double3{1, 0.5, 0.2})},
                    {{"outMatrix", Moves::kFrame}, {"outColor", Moves::kNot}},
                    0,
                    ""});
  }
  RandomFrames random(55);
  all->push_back({"camera",
                  "",
                  {WorldMatrix("matrix", &random), Setting("verticalFieldOfView", 0.9)},
                  {{"worldFromScreen", Moves::kFrame}},
                  0,
                  ""});
}

// A square of 3 x 3 points, flat: what rays meet is not for rounding to decide.
std::shared_ptr<const Mesh> PaintedSquare(float width) {
  Mesh::Data data;
  data.name = "square";
  std::vector<float> xyz;
  for (Index i = 0; i < 9; ++i) {
    xyz.push_back(width * (static_cast<float>(i % 3) - 1) / 2);
    xyz.push_back(width * (static_cast<float>(i / 3) - 1) / 2);
    xyz.push_back(0);
    data.vertex_to_point.push_back(i);
    if (i % 3 < 2 && i < 6) data.triangles.insert(data.triangles.end(), {i, i + 1, i + 4, i, i + 4, i + 3});
  }
  data.rest = PointBuffer::FromInterleaved(xyz);
  data.triangle_vertices = data.triangles;
  data.primitives = {{0, 9, 0, 8, "paint", {0.8f, 0.5f, 0.3f}}};
  return std::make_shared<const Mesh>(std::move(data));
}

// A floor that is carried along, under a lamp and a ceiling that tilts.
void AddIllumination(std::vector<NodeSetUp>* all) {
  const auto floor = PaintedSquare(1), ceiling = PaintedSquare(8);
  const auto above = [&](double height, double tilt) {
    return MovedValue(BentPoints(*ceiling, 0),
                      Translation({0, 0, height}) * RotationFromEuler({tilt, 0, 0}, RotateOrder::kXyz),
                      Moves::kPlace);
  };
  NodeSetUp lit{"indirectIllumination",
                "",
                {{"points[0]", Moves::kPlace, BentPoints(*floor, 0), {}},
                 {"points[1]", Moves::kPlace, above(2, 0), above(1.8, 0.2)},
                 {"lightMatrix[0]", Moves::kFrame, Translation({0.2, 0.4, 1}), Translation({-0.1, 0, 0.9})},
                 {"worldFromScreen",
                  Moves::kFrame,
                  Translation({0, 0, 0.1}) * RotationFromEuler({2.8, 0.1, 0.3}, RotateOrder::kXyz),
                  {}},
                 Setting("mesh[0]", floor),
                 Setting("mesh[1]", ceiling),
                 Setting("carriedMeshes", std::vector<std::int64_t>{0}),
                 Setting("lightColor[0]", Double3{1, 1, 1}),
                 Setting("lightKinds", std::vector<std::int64_t>{0}),
                 Setting("width", 6),
                 Setting("height", 4),
                 Setting("samples", 4),
                 Setting("keySamples", 16)},
                {{"irradiance", Moves::kNot}, {"keyIrradiance", Moves::kNot}},
                kAllTurned | kNowTurned,
                "the few samples of a pixel lie about the world's axes"};
  all->push_back(lit);
  lit.given[3].idle = true;
  lit.given.push_back(
      Setting("bounces", 1));  // those of points turn with the surface, but not what they meet
  lit.what = "at points",
  lit.gives = {{"pointIrradiance[0]", Moves::kNot}, {"keyPointIrradiance[0]", Moves::kNot}};
  lit.unless = 0, lit.why = "";
  all->push_back(lit);
}

}  // namespace

std::vector<NodeSetUp> FrameSetUps() {
  std::vector<NodeSetUp> all;
  AddTransforms(&all);
  AddMatrices(&all);
  AddVectors(&all);
  AddLights(&all);
  AddIllumination(&all);
  return all;
}

const std::map<std::string, std::string>& NodesWithoutWorld() {
  static const std::map<std::string, std::string> nodes = {
      {"clamp", "components are cut one by one"},
      {"setRange", "components are mapped one by one"},
      {"multiplyDivide", "components are multiplied one by one"},
      {"clipTransform", "its keys are local to a parent"},
      {"layeredTransform", "its keys are local to a parent"},
      {"mesh", "its points are in mesh space, as the file has them"},
      {"weightMap", "its weights are numbers of points"},
      {"combineFalloff", "its weights are numbers of points"},
      {"vrmRollConstraint", "all its matrices are local to parents"},
      {"vrmRotationConstraint", "all its matrices are local to parents"}};
  return nodes;
}

}  // namespace kpsa::engine
