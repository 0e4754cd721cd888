// kpsa eval -o x.glb with joints: what is written is evaluated by kpsa and by the naive reference, and is what the rig
// gives.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <random>

#include "files/npz.h"
#include "gltf/import.h"
#include "tests/cli/process.h"
#include "tests/support/gltf_builder.h"
#include "tests/support/gltf_reference.h"
#include "tests/support/temporary_folder.h"

namespace kpsa::engine {
namespace {

using Json = nlohmann::json;
using Numbers = std::vector<float>;

constexpr int kColumns = 4, kRows = 20, kJoints = 6;

// A strip of 80 vertices on a chain of five joints and one that stands alone, six of them at every vertex, bound in
// another pose than its rest; the targets `few` and `many`; a cube-like `hat` without a skin at the end of the chain;
// the clip `move`.
GltfBuilder Limb() {
  std::mt19937 random(11);
  const auto number = [&](double low, double high) {
    return static_cast<float>(std::uniform_real_distribution<double>(low, high)(random));
  };
  GltfBuilder b;
  Numbers positions, weights[2], few, many;
  std::vector<std::uint8_t> joints[2];
  std::vector<std::uint16_t> indices;
  for (int v = 0; v < kColumns * kRows; ++v) {
    const int column = v % kColumns, row = v / kColumns;
    positions.insert(positions.end(), {0.1f * static_cast<float>(column), 0.1f * static_cast<float>(row),
                                       number(-0.02, 0.02)});
    Numbers shares;
    float sum = 0;
    for (int j = 0; j < kJoints; ++j) sum += shares.emplace_back(number(0.05, 1));
    for (int j = 0; j < 8; ++j) {
      joints[j / 4].push_back(static_cast<std::uint8_t>(j < kJoints ? j : 0));
      weights[j / 4].push_back(j < kJoints ? shares[static_cast<std::size_t>(j)] / sum : 0);
    }
    const float lift = row == 7 ? 0.05f : 0;
    few.insert(few.end(), {0, 0, lift});
    many.insert(many.end(), {number(-0.02, 0.02), number(-0.02, 0.02), number(-0.02, 0.02)});
    if (column + 1 == kColumns || row + 1 == kRows) continue;
    for (const int corner : {v, v + 1, v + kColumns, v + 1, v + kColumns + 1, v + kColumns})
      indices.push_back(static_cast<std::uint16_t>(corner));
  }
  Numbers binds;
  for (int j = 0; j < kJoints; ++j) {
    for (int i = 0; i < 16; ++i)
      binds.push_back(i % 5 == 0 ? 1 : i == 13 ? -0.35f * static_cast<float>(j) : i == 12 ? 0.02f : 0);
  }
  const int position = b.Accessor(positions, "VEC3"), index = b.Accessor(indices, "SCALAR");
  Json attributes = {{"POSITION", position}};
  for (int set = 0; set < 2; ++set) {
    attributes[fmt::format("JOINTS_{}", set)] = b.Accessor(joints[set], "VEC4");
    attributes[fmt::format("WEIGHTS_{}", set)] = b.Accessor(weights[set], "VEC4");
  }
  b.Push("meshes",
         {{"extras", {{"targetNames", {"few", "many"}}}},
          {"weights", {0.25, 0}},
          {"primitives",
           {{{"attributes", attributes},
             {"indices", index},
             {"targets",
              {{{"POSITION", b.Accessor(few, "VEC3")}}, {{"POSITION", b.Accessor(many, "VEC3")}}}}}}}});
  b.Push("meshes", {{"primitives", {{{"attributes", {{"POSITION", position}}}, {"indices", index}}}}});
  b.Push("nodes", {{"name", "limb"}, {"mesh", 0}, {"skin", 0}});
  for (int j = 0; j < 5; ++j) {  // nodes 1 to 5
    Json node = {{"name", fmt::format("joint{}", j)}, {"translation", {0, j == 0 ? 0.1 : 0.35, 0}}};
    if (j == 2) node["scale"] = {1, 1.5, 0.75};
    if (j == 3) node["rotation"] = {0.1, 0.2, 0.3, std::sqrt(1 - 0.14)};
    node["children"] = {j + 2};
    b.Push("nodes", node);
  }
  b.Push("nodes", {{"name", "hat"}, {"mesh", 1}, {"translation", {0, 0.4, 0}}});
  b.Push("nodes", {{"name", "loose"}, {"translation", {0.3, 0.2, 0.1}}});
  b.Push("skins", {{"joints", {1, 2, 3, 4, 5, 7}}, {"inverseBindMatrices", b.Accessor(binds, "MAT4")}});
  b.Push("scenes", {{"nodes", {0, 1, 7}}});
  Numbers times, turns, slides, weight_keys;
  for (int k = 0; k < 9; ++k) {
    times.push_back(0.125f * static_cast<float>(k));
    const double angle = number(-1.2, 1.2);
    turns.insert(turns.end(),
                 {static_cast<float>(std::sin(angle)), 0, 0, static_cast<float>(std::cos(angle))});
    slides.insert(slides.end(), {number(-0.3, 0.3), number(-0.3, 0.3), number(-0.3, 0.3)});
    weight_keys.insert(weight_keys.end(), {number(0, 1), number(0, 1)});
  }
  const int input = b.Accessor(times, "SCALAR");
  const Json samplers = {{{"input", input}, {"output", b.Accessor(turns, "VEC4")}},
                         {{"input", input}, {"output", b.Accessor(slides, "VEC3")}},
                         {{"input", input}, {"output", b.Accessor(weight_keys, "SCALAR")}}};
  const auto channel = [](int sampler, int node, const char* path) {
    return Json{{"sampler", sampler}, {"target", {{"node", node}, {"path", path}}}};
  };
  b.Push("animations", {{"name", "move"},
                        {"samplers", samplers},
                        {"channels",
                         {channel(0, 2, "rotation"), channel(0, 4, "rotation"), channel(1, 1, "translation"),
                          channel(1, 7, "translation"), channel(2, 0, "weights")}}});
  return b;
}

class SkinnedCaches : public ::testing::Test {
 protected:
  SkinnedCaches() { folder.Write("limb.glb", Limb().Glb()); }
  ProcessResult Eval(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), "eval");
    return RunKpsa(arguments, 60, folder.path());
  }
  std::string Rig(const std::string& text) const {
    return folder.Write("t.yaml", "kpsa: 1\ncharacter: limb.glb\n" + text);
  }
  Npz Frames(const std::vector<std::string>& arguments) const {
    std::vector<std::string> all = arguments;
    all.insert(all.end(), {"-o", "frames.npz", "--force"});
    const ProcessResult run = Eval(all);
    EXPECT_EQ(run.exit_code, 0) << run.err;
    Result<Npz> npz = ReadNpz(folder / "frames.npz");
    EXPECT_TRUE(npz.ok()) << npz.status().ToString();
    return npz.ok() ? std::move(*npz) : Npz();
  }
  static Json JsonOf(const std::string& path) {
    const std::string bytes = TemporaryFolder::Read(path);
    std::uint32_t size = 0;
    if (bytes.size() > 20) std::memcpy(&size, &bytes[12], 4);
    return Json::parse(bytes.substr(std::min<std::size_t>(20, bytes.size()), size), nullptr, false);
  }
  // Writes it with joints; what kpsa and the reference make of it are the rig's frames, within 1e-5 of the diagonal.
  Json ExpectSame(const std::vector<std::string>& arguments,
                  const std::vector<std::string>& more = {"--skinned"}) const {
    std::vector<std::string> all = arguments;
    all.insert(all.end(), more.begin(), more.end());
    all.insert(all.end(), {"-o", "out.glb", "--force"});
    const ProcessResult run = Eval(all);
    EXPECT_EQ(run.exit_code, 0) << run.err;
    err = run.err;
    const Npz expected = Frames(arguments), again = Frames({"out.glb"});
    if (expected.arrays.size() < 2) return {};
    double low[3] = {1e30, 1e30, 1e30}, high[3] = {-1e30, -1e30, -1e30};
    for (const NpzArray& array : expected.arrays) {
      if (array.name == "times") continue;
      const Numbers values = array.Floats();
      for (std::size_t i = 0; i < values.size(); ++i) {
        low[i % 3] = std::min<double>(low[i % 3], values[i]);
        high[i % 3] = std::max<double>(high[i % 3], values[i]);
      }
    }
    const double diagonal = std::hypot(high[0] - low[0], high[1] - low[1], high[2] - low[2]);
    EXPECT_GT(diagonal, 0.1);
    const Result<gltf::Character> character = gltf::LoadGltf(folder / "out.glb");
    EXPECT_TRUE(character.ok()) << character.status().ToString();
    const std::vector<double> times = expected.Find("times")->Doubles();
    EXPECT_EQ(again.arrays.size(), expected.arrays.size());
    for (const NpzArray& array : expected.arrays) {
      const NpzArray* other = again.Find(array.name);
      EXPECT_NE(other, nullptr) << array.name;
      if (other == nullptr || !character.ok()) continue;
      EXPECT_EQ(other->shape, array.shape) << array.name;
      if (array.name == "times" || other->shape != array.shape) continue;
      const Numbers a = array.Floats(), b = other->Floats();
      double worst = 0, worst_reference = 0;
      const std::size_t vertices = array.shape[1];
      Index node = 0;
      const std::vector<std::string> names = character->UniqueNames();
      while (node < names.size() &&
             !(names[node] + "/0" == array.name && character->nodes[node].mesh != kNoIndex))
        ++node;
      EXPECT_LT(node, names.size()) << array.name;
      for (std::size_t t = 0; t < times.size(); ++t) {
        const gltf::Clip* clip = character->clips.empty() ? nullptr : &character->clips[0];
        const auto pose = gltf_reference::Evaluate(*character, clip, times[t] - std::min(times[0], 0.0));
        const std::vector<Double3> points = gltf_reference::Points(*character, pose, node);
        EXPECT_EQ(points.size(), vertices);
        for (std::size_t v = 0; v < vertices; ++v) {
          const std::size_t at = 3 * (t * vertices + v);
          const Double3 wanted{a[at], a[at + 1], a[at + 2]};
          worst = std::max(worst, Length(Double3{b[at], b[at + 1], b[at + 2]} - wanted));
          worst_reference = std::max(worst_reference, Length(points[v] - wanted));
        }
      }
      EXPECT_LT(worst, 1e-5 * diagonal) << array.name;
      EXPECT_LT(worst_reference, 1e-5 * diagonal) << array.name;
    }
    return JsonOf(folder / "out.glb");
  }
  TemporaryFolder folder;
  mutable std::string err;
};

bool Says(const std::string& text, std::string_view part) { return text.find(part) != std::string::npos; }

TEST_F(SkinnedCaches, ACharacterComesBackAsItIs) {
  const Json root = ExpectSame({"limb.glb"});
  ASSERT_EQ(root["skins"].size(), 1u);
  EXPECT_EQ(root["skins"][0]["joints"].size(), 6u);
  const Json& limb = root["meshes"][0];
  EXPECT_EQ(limb["extras"]["targetNames"], (Json{"few", "many"}));
  for (const char* name : {"JOINTS_0", "JOINTS_1", "WEIGHTS_0", "WEIGHTS_1"})
    EXPECT_TRUE(limb["primitives"][0]["attributes"].contains(name)) << name;
  EXPECT_FALSE(limb["primitives"][0]["attributes"].contains("NORMAL")) << "it has none, and is flat";
  // What few vertices of a target move takes little
  const auto accessor = [&](int target) {
    return root["accessors"][limb["primitives"][0]["targets"][static_cast<std::size_t>(target)]["POSITION"]
                                 .get<std::size_t>()];
  };
  EXPECT_EQ(accessor(0)["sparse"]["count"], kColumns);
  EXPECT_FALSE(accessor(1).contains("sparse"));
  // The hat hangs where it did, and only what moves has keys
  EXPECT_EQ(root["animations"].size(), 1u);
  EXPECT_EQ(root["animations"][0]["name"], "move");
  std::vector<std::string> moved;
  for (const Json& channel : root["animations"][0]["channels"]) {
    const Json& target = channel["target"];
    moved.push_back(fmt::format("{} {}",
                                root["nodes"][target["node"].get<std::size_t>()]["name"].get<std::string>(),
                                target["path"].get<std::string>()));
  }
  std::sort(moved.begin(), moved.end());
  EXPECT_EQ(moved, (std::vector<std::string>{"joint0 translation", "joint1 rotation", "joint3 rotation",
                                             "limb weights", "loose translation"}));
  std::size_t hats = 0;
  for (const Json& node : root["nodes"]) {
    if (node["name"] != "hat") continue;
    ++hats;
    EXPECT_TRUE(node.contains("mesh"));
    EXPECT_FALSE(node.contains("skin"));
  }
  EXPECT_EQ(hats, 1u);
  // Joints of several roots get one
  EXPECT_EQ(root["nodes"][0]["name"], "joints");
  EXPECT_EQ(root["nodes"][0]["children"].size(), 2u);
  EXPECT_TRUE(Says(err, "2 meshes by joints and the rig's own morph targets; against the frames: max "))
      << err;
  EXPECT_TRUE(Says(err, "up to 6 joints move a vertex")) << err;
  // Smaller than the shapes of the frames
  ASSERT_EQ(Eval({"limb.glb", "--no-skinned", "-o", "morph.glb"}).exit_code, 0);
  EXPECT_LT(std::filesystem::file_size(folder / "out.glb"), std::filesystem::file_size(folder / "morph.glb"));
  EXPECT_FALSE(JsonOf(folder / "morph.glb").contains("skins"));
}

// Joints below the mesh's own node, which is then the one in the file.
TEST_F(SkinnedCaches, NamesStayUnique) {
  GltfBuilder b = Limb();
  b.root["nodes"][0]["children"] = {1, 7};
  b.root["scenes"][0]["nodes"] = {0};
  folder.Write("below.glb", b.Glb());
  const Json root = ExpectSame({"below.glb"});
  std::vector<std::string> names;
  for (const Json& node : root["nodes"]) names.push_back(node["name"]);
  std::sort(names.begin(), names.end());
  EXPECT_EQ(names, (std::vector<std::string>{"hat", "joint0", "joint1", "joint2", "joint3", "joint4", "limb",
                                             "loose"}));
}

TEST_F(SkinnedCaches, ARigsShapesDriversAndPosesAreInIt) {
  std::string obj;
  for (int v = 0; v < kColumns * kRows; ++v) obj += fmt::format("v {} 0 {}\n", v % 7 * 0.01, v % 5 * 0.01);
  folder.Write("fix.obj", obj);
  const std::string rig = Rig(R"(nodes:
  fix: {type: blendShape, targets: [many, {file: fix.obj}], envelope: 0.5, members: {vertices: "8:40"}}
  turn: {type: remapValue, input: joint1.poseRotateX, inputMin: -90, inputMax: 90, outputMin: -0.5, outputMax: 1.5}
connections: ["turn.outValue -> fix.weight[fix]", "joint3.rotate -> loose.rotate"]
deform: [{meshes: [limb], stack: [morph, fix, skin]}]
controls: {joint0.rotateZ: {min: -90, max: 90}}
overrides: {"fix.weight[many]": 0.75}
)");
  const Json root = ExpectSame({rig, "--set", "joint0.rotateZ=35", "--set", "joint3.rotateY=20"});
  EXPECT_EQ(root["meshes"][0]["extras"]["targetNames"], (Json{"few", "many", "many", "fix"}));
  EXPECT_TRUE(Says(err, "weights of morph targets go from -")) << err;
}

// glTF has no in-betweens: the weights of the shapes are what comes of them.
TEST_F(SkinnedCaches, InBetweensAreWeightsOfTheirShapes) {
  const std::string rig = Rig(R"(nodes:
  fix: {type: blendShape, targets: [few, many], inbetweens: {many: {0.25: few}}, 'weight[many]': 0.6, envelope: 0.7}
overrides: {limb_blendShape.inbetweens: {many: {0.5: few}}}
deform: [{meshes: [limb], stack: [morph, fix, skin]}]
)");
  ExpectSame({rig});
}

TEST_F(SkinnedCaches, ReferencesComeAlong) {
  Rig("");
  folder.Write("two.yaml",
               "kpsa: 1\nreferences: {a: {file: limb.glb}, b: {file: t.yaml, translate: [2, 0, 1]}}\n"
               "overrides: {b.rotateY: 70, b.scale: [2, 2, 2]}\n");
  const Json root = ExpectSame({"two.yaml"});
  EXPECT_EQ(root["skins"].size(), 2u);
  EXPECT_EQ(root["meshes"].size(), 4u);
}

TEST_F(SkinnedCaches, NodesThatAreScaledToNothingOrShear) {
  // Below nothing there is no frame: what hangs there is placed in the world
  ExpectSame({"limb.glb", "--set", "joint2.scale=[0, 0, 0]"});
  // A turn below an uneven scale is sheared in the world, and not below its parent
  ExpectSame({"limb.glb", "--set", "joint2.scale=[3, 0.5, 1]", "--set", "joint3.rotate=[20, 40, 60]"});
  const std::string shear =
      Rig("overrides: {joint4.offsetParentMatrix: [1, 0, 0, 0, 0.5, 1, 0, 0, 0, 0, 1, 0, 0, 0.35, 0, 1]}\n");
  const ProcessResult refused = Eval({shear, "--skinned", "-o", "no.glb"});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_TRUE(Says(refused.err, "no.glb: mesh \"limb\" is moved by \"joint4\", which shears")) << refused.err;
  EXPECT_FALSE(std::filesystem::exists(folder / "no.glb"));
  const ProcessResult run = Eval({shear, "-o", "yes.glb"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_TRUE(Says(run.err, "mesh \"limb\" goes without joints: it is moved by \"joint4\", which shears"))
      << run.err;
}

TEST_F(SkinnedCaches, OneFrameHasNoAnimation) {
  const Json root = ExpectSame({"limb.glb", "--times", "0.4"});
  EXPECT_FALSE(root.contains("animations"));
  EXPECT_EQ(root["meshes"][0]["weights"].size(), 2u);
  const Json rest = ExpectSame({"limb.glb", "--rest"});
  EXPECT_EQ(rest["meshes"][0]["weights"], (Json{0.25, 0.0}));
}

TEST_F(SkinnedCaches, WhatJointsDoNotDoAloneIsMorphTargets) {
  const auto expect = [&](const std::string& rig, const std::string& reason) {
    SCOPED_TRACE(reason);
    const Json root = [&] {
      const ProcessResult run = Eval({Rig(rig), "-o", "out.glb", "--force"});
      EXPECT_EQ(run.exit_code, 0) << run.err;
      EXPECT_TRUE(Says(run.err, "mesh \"limb\" goes without joints: it " + reason)) << run.err;
      EXPECT_TRUE(Says(run.err, "1 mesh by joints and the rig's own morph targets, at most ")) << run.err;
      return JsonOf(folder / "out.glb");
    }();
    EXPECT_FALSE(root.contains("skins"));
    bool shapes = false;
    for (const Json& mesh : root["meshes"])
      shapes = shapes || (mesh.contains("extras") && mesh["extras"]["targetNames"][0] == "shape1");
    EXPECT_TRUE(shapes);
  };
  expect("nodes: {mush: {type: deltaMush}}\ndeform: [{meshes: [limb], stack: [gltf, mush]}]\n",
         "has \"mush\" (deltaMush) in its stack");
  expect("deform: [{meshes: [limb], stack: [morph, restSkin]}]\n",
         "has \"restSkin\" (skinCluster) in its stack");
  expect("overrides: {limb_skinCluster.skinningMethod: dualQuaternion}\n", "is ");
  expect("overrides: {limb_skinCluster.envelope: 0.5}\n", "is ");
}

TEST_F(SkinnedCaches, FlagsThatDoNotFitAreRefused) {
  const auto refused = [&](std::vector<std::string> arguments, std::string_view message) {
    const ProcessResult run = Eval(std::move(arguments));
    EXPECT_EQ(run.exit_code, 2) << run.err;
    EXPECT_TRUE(Says(run.err, message)) << run.err;
    EXPECT_FALSE(std::filesystem::exists(folder / "no.glb"));
  };
  refused({"limb.glb", "-o", "no.glb", "--skinned", "--no-skinned"}, "expected one of them");
  refused({"limb.glb", "-o", "no.npz", "--skinned"}, "--skinned is for .glb files, found no.npz");
  refused({"limb.glb", "-o", "no.usda", "--no-skinned"}, "--no-skinned is for .glb files, found no.usda");
  refused({kHello, "-o", folder / "no.glb", "--skinned"},
          "--skinned: mesh \"column\" has \"cage\" (lattice) in its stack; without it, such meshes are "
          "written as morph");
}

TEST(SkinnedScenes, ComeBackAsTheyAre) {
  const TemporaryFolder folder;
  for (const char* scene : {"hello/hello", "face/face", "gi/room"}) {
    SCOPED_TRACE(scene);
    const std::string from = fmt::format("{}/{}.glb", KPSA_SCENES_DIR, scene);
    const auto run = [&](std::vector<std::string> arguments) {
      const ProcessResult result = RunKpsa(arguments, 120, folder.path());
      EXPECT_EQ(result.exit_code, 0) << result.err;
      return result;
    };
    run({"eval", from, "--frames", "0:40:4", "-o", "a.npz", "--force"});
    run({"eval", from, "--frames", "0:40:4", "-o", "a.glb", "--skinned", "--force"});
    run({"eval", "a.glb", "--frames", "0:40:4", "-o", "b.npz", "--force"});
    // The smallest of them, the face, is 0.4 m
    run({"compare", "a.npz", "b.npz", "--tolerance", "0.004mm"});
  }
}

}  // namespace
}  // namespace kpsa::engine
