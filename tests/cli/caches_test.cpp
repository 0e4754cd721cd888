// What eval writes for other programs, beside the points.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "files/npz.h"
#include "gltf/import.h"
#include "tests/cli/hello_folder.h"
#include "tests/cli/process.h"
#include "tests/support/gltf_builder.h"
#include "tests/support/gltf_reference.h"
#include "tests/support/temporary_folder.h"

namespace kpsa::engine {
namespace {

using Json = nlohmann::json;

Json GlbJson(const std::string& path) {
  const std::string bytes = TemporaryFolder::Read(path);
  std::uint32_t size = 0;
  std::memcpy(&size, &bytes[12], 4);
  return Json::parse(bytes.substr(20, size));
}

// Programs that clamp weights to 0 and 1 show the frames that eval computes.
TEST(Caches, GlbOfClampedWeights) {
  const TemporaryFolder folder;
  for (const char* name : {"a.glb", "a.npz"}) {
    const ProcessResult run = RunKpsa({"eval", kHello, "-o", folder / name});
    ASSERT_EQ(run.exit_code, 0) << run.err;
  }
  const Result<gltf::Character> character = gltf::LoadGltf(folder / "a.glb");
  ASSERT_TRUE(character.ok()) << character.status().ToString();
  ASSERT_EQ(character->clips.size(), 1u);
  EXPECT_EQ(character->clips[0].name, "wave");
  for (const double weight : character->clips[0].channels.at(0).values) {
    EXPECT_GE(weight, 0);
    EXPECT_LE(weight, 1);
  }
  EXPECT_EQ(character->meshes[0].targets.at(0).name, "shape1");
  const Result<Npz> npz = ReadNpz(folder / "a.npz");
  ASSERT_TRUE(npz.ok());
  const std::vector<double> times = npz->arrays.at(0).Doubles();
  const std::vector<float> frames = npz->arrays.at(1).Floats();
  const std::size_t vertices = npz->arrays[1].shape[1];
  double worst = 0, largest = 0;
  for (std::size_t t = 0; t < times.size(); ++t) {
    const auto pose =
        gltf_reference::Evaluate(*character, &character->clips[0], static_cast<float>(times[t]));
    const auto points = gltf_reference::Points(*character, pose, 0);
    ASSERT_EQ(points.size(), vertices);
    for (std::size_t v = 0; v < vertices; ++v) {
      const float* p = &frames[3 * (t * vertices + v)];
      worst = std::max(worst, Length(points[v] - Double3{p[0], p[1], p[2]}));
      largest = std::max(largest, Length(Double3{p[0], p[1], p[2]}));
    }
  }
  EXPECT_LT(worst, 2e-4 * largest);
}

TEST(Caches, LookOfTheCharacter) {
  const TemporaryFolder folder;
  for (const char* name : {"a.glb", "a.usda"})
    ASSERT_EQ(RunKpsa({"eval", kHello, "--frames", "0:3", "-o", folder / name}).exit_code, 0);
  const Json root = GlbJson(folder / "a.glb");
  EXPECT_EQ(root["materials"][0]["name"], "surface");
  EXPECT_EQ(root["materials"][0]["pbrMetallicRoughness"]["roughnessFactor"], 0.6);
  EXPECT_TRUE(root["meshes"][0]["primitives"][0]["attributes"].contains("NORMAL"));
  const std::string usda = TemporaryFolder::Read(folder / "a.usda");
  for (const char* part :
       {"custom string kpsa:rig = \"hello.yaml\"", "def Material \"surface\"", "normals.timeSamples",
        "extent.timeSamples", "rel material:binding = </cache/Looks/surface>"})
    EXPECT_NE(usda.find(part), std::string::npos) << part;
}

// The image of the base colour comes along; one that is not in the file is a note.
TEST(Caches, ImagesOfTheCharacter) {
  GltfBuilder b = GltfBuilder::Character();
  const int uvs = b.Accessor<float>({0, 0, 1, 0, 0, 1}, "VEC2");
  b.View(std::vector<std::uint8_t>{1, 2, 3});
  b.root["images"] = {{{"bufferView", b.root["bufferViews"].size() - 1}, {"mimeType", "image/png"}},
                      {{"uri", "no.png"}}};
  b.root["textures"] = {{{"source", 0}}, {{"source", 1}}};
  b.root["materials"] = {
      {{"name", "paint"}, {"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}}};
  Json& primitive = b.root["meshes"][0]["primitives"][0];
  primitive["attributes"]["TEXCOORD_0"] = uvs;
  primitive["material"] = 0;
  const TemporaryFolder folder;
  folder.Write("a.glb", b.Glb());
  ASSERT_EQ(RunKpsa({"eval", folder / "a.glb", "-o", folder / "out.glb"}).exit_code, 0);
  Json root = GlbJson(folder / "out.glb");
  EXPECT_EQ(root["images"].size(), 1u);
  EXPECT_EQ(root["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["index"], 0);
  EXPECT_TRUE(root["meshes"][0]["primitives"][0]["attributes"].contains("TEXCOORD_0"));
  b.root["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["index"] = 1;
  folder.Write("b.glb", b.Glb());
  const ProcessResult run = RunKpsa({"eval", folder / "b.glb", "-o", folder / "out2.glb"});
  EXPECT_EQ(run.exit_code, 0);
  EXPECT_NE(run.err.find("material \"paint\" goes without its image, which is not in the file's binary part"),
            std::string::npos)
      << run.err;
  EXPECT_FALSE(GlbJson(folder / "out2.glb").contains("images"));
  b.root["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["index"] = 0;
  b.root["samplers"] = {{{"wrapS", 33071}}};
  b.root["textures"][0]["sampler"] = 0;
  folder.Write("c.glb", b.Glb());
  EXPECT_NE(RunKpsa({"eval", folder / "c.glb", "-o", folder / "out3.glb"})
                .err.find("where the character's ends otherwise"),
            std::string::npos);
}

TEST(Caches, OfPointsThatAreNotFiniteAreRefused) {
  const TemporaryFolder folder;
  for (const char* name : {"a.npz", "a.glb", "a.usda", "a.pc2", "a.mdd"}) {
    const ProcessResult run =
        RunKpsa({"eval", kHello, "--set", "upper.translateX=1e36", "--frames", "0:1", "-o", folder / name});
    EXPECT_EQ(run.exit_code, 4) << name << run.err;
    EXPECT_NE(run.err.find("not finite after node \"mush\" (deltaMush)"), std::string::npos)
        << name << run.err;
    EXPECT_FALSE(std::filesystem::exists(folder / name)) << name;
  }
}

// `fine` is said of a first frame that could be written.
TEST(Caches, ValidateRefusesPointsThatAreNotFinite) {
  const HelloFolder folder;
  const std::string rig =
      folder.Edit("nodes:\n", "nodes:\n  odd: {type: expression, expression: \"sqrt(0 - 1)\"}\n");
  EXPECT_EQ(RunKpsa({"validate", rig}).exit_code, 0) << "nothing reads it";
  const std::string bad = folder.Edit("connections:\n", "connections:\n  - odd.output -> upper.translateX\n");
  const ProcessResult run = RunKpsa({"validate", bad});
  EXPECT_EQ(run.exit_code, 4) << run.err;
  EXPECT_NE(run.err.find("not finite after node"), std::string::npos) << run.err;
}

}  // namespace
}  // namespace kpsa::engine
