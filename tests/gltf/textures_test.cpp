#include "gltf/textures.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "gltf/import.h"
#include "tests/support/gltf_builder.h"
#include "tests/support/temporary_folder.h"

namespace kpsa::engine::gltf {
namespace {

using nlohmann::json;

json Covered(int texture) { return {{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", texture}}}}}}; }

// Material 0 shows bytes of the file, 1 those of a data URI, 2 a file beside it, 3 none.
GltfBuilder Shown() {
  GltfBuilder b;
  b.View(std::vector<std::uint8_t>{7, 8, 9});
  b.root["images"] = {{{"bufferView", 0}, {"mimeType", "image/png"}},
                      {{"uri", "data:image/png;base64,AQID"}},
                      {{"uri", "more/a%20b.png"}}};
  b.root["textures"] = {{{"source", 0}}, {{"source", 1}}, {{"source", 2}, {"sampler", 0}}};
  b.root["samplers"] = {{{"wrapS", 33648}, {"wrapT", 33071}, {"magFilter", 9728}, {"minFilter", 9987}}};
  b.root["materials"] = {Covered(0), Covered(1), Covered(2), json::object()};
  return b;
}

struct Got {
  BaseTextures textures;
  std::vector<std::string> notes;
  std::uint64_t budget = 1000;
};
Got Read(const std::string& bytes, std::vector<Index> materials = {0, 1, 2, 3}, std::uint64_t budget = 1000) {
  const TemporaryFolder folder;
  folder.Write("more/a b.png", "beside");
  folder.Write("secret.png", "secret");
  Got got;
  got.budget = budget;
  got.textures = ReadBaseTextures(folder.Write("in/a.glb", bytes), materials, &got.budget, &got.notes);
  return got;
}
Got ReadBeside(const std::string& bytes) {
  const TemporaryFolder folder;
  folder.Write("more/a b.png", "beside");
  Got got;
  got.textures = ReadBaseTextures(folder.Write("a.gltf", bytes), std::vector<Index>{0, 1, 2, 3}, &got.budget,
                                  &got.notes);
  return got;
}

TEST(GltfTextures, ImagesWithinAndBeside) {
  for (const bool binary : {true, false}) {
    const Got got = ReadBeside(binary ? Shown().Glb() : Shown().Text());
    EXPECT_TRUE(got.notes.empty()) << got.notes[0];
    ASSERT_EQ(got.textures.images.size(), 3u);
    EXPECT_EQ(got.textures.images[0].bytes, (std::vector<std::uint8_t>{7, 8, 9}));
    EXPECT_EQ(got.textures.images[1].bytes, (std::vector<std::uint8_t>{1, 2, 3}));
    EXPECT_EQ(got.textures.images[2].bytes, (std::vector<std::uint8_t>{'b', 'e', 's', 'i', 'd', 'e'}));
    EXPECT_EQ(got.budget, 1000 - 12u);
    ASSERT_EQ(got.textures.materials.size(), 4u);
    EXPECT_FALSE(got.textures.materials[3].has_value());
    const BaseTexture& usual = *got.textures.materials[0];
    EXPECT_EQ(usual.wrap_u, Wrap::kRepeat);
    EXPECT_EQ(usual.wrap_v, Wrap::kRepeat);
    EXPECT_FALSE(usual.nearest);
    const BaseTexture& sampled = *got.textures.materials[2];
    EXPECT_EQ(sampled.wrap_u, Wrap::kMirror);
    EXPECT_EQ(sampled.wrap_v, Wrap::kClamp);
    EXPECT_TRUE(sampled.nearest);
    EXPECT_NE(got.textures.images[2].where.find("images[2]"), std::string::npos);
  }
}

TEST(GltfTextures, OnlyWhatIsWantedIsRead) {
  const Got got = Read(Shown().Glb(), {1});
  ASSERT_EQ(got.textures.images.size(), 1u);
  EXPECT_TRUE(got.notes.empty());
  EXPECT_TRUE(Read("", {}).notes.empty());
}

// Two materials of one image share it.
TEST(GltfTextures, EachImageOnce) {
  GltfBuilder b = Shown();
  b.root["textures"][1]["source"] = 0;
  const Got got = Read(b.Glb(), {0, 1});
  ASSERT_EQ(got.textures.images.size(), 1u);
  EXPECT_EQ(got.textures.materials[0]->image, got.textures.materials[1]->image);
}

// The extension's own example: the lower left quadrant of the picture, turned.
TEST(GltfTextures, Transforms) {
  GltfBuilder b = Shown();
  json& info = b.root["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"];
  info["texCoord"] = 1;
  info["extensions"]["KHR_texture_transform"] = {
      {"offset", {0, 1}}, {"rotation", std::acos(0.0)}, {"scale", {0.5, 0.5}}, {"texCoord", 2}};
  const Got got = Read(b.Glb(), {0});
  ASSERT_TRUE(got.textures.materials[0].has_value()) << got.notes[0];
  const auto& [a, bb, c, d, e, f] = got.textures.materials[0]->place;
  EXPECT_EQ(got.textures.materials[0]->uv_set, 2u);
  for (const double u : {0.1, 0.9}) {
    for (const double v : {0.1, 0.9}) {
      const double x = a * u + bb * v + c, y = d * u + e * v + f;
      EXPECT_NEAR(x, v / 2, 1e-12);      // the left half
      EXPECT_NEAR(y, 1 - u / 2, 1e-12);  // the lower one
    }
  }
}

// One note, which names the place; nothing of it is kept, and the others are.
TEST(GltfTextures, WhatIsWrongIsNamed) {
  const auto wrong = [](const char* pointer, const json& value, const std::string& message) {
    GltfBuilder b = Shown();
    b.root[json::json_pointer(pointer)] = value;
    const Got got = Read(b.Glb(), {0, 1});
    ASSERT_EQ(got.notes.size(), 1u) << pointer;
    EXPECT_NE(got.notes[0].find(message), std::string::npos) << got.notes[0];
    EXPECT_NE(got.notes[0].find("a.glb"), std::string::npos) << got.notes[0];
    EXPECT_FALSE(got.textures.materials[0].has_value()) << pointer;
    EXPECT_TRUE(got.textures.materials[1].has_value()) << pointer;
  };
  const char* const kInfo = "/materials/0/pbrMetallicRoughness/baseColorTexture";
  for (const json& value : {json(9), json(-1), json("0"), json(), json::array()}) {
    wrong("/materials/0/pbrMetallicRoughness/baseColorTexture/index", value,
          "baseColorTexture.index is no index");
    wrong("/textures/0/source", value, "textures[0].source is no index");
    wrong("/textures/0/sampler", value, "textures[0].sampler is no index");
    wrong("/images/0/bufferView", value, "images[0].bufferView is no index");
    wrong("/bufferViews/0/buffer", value, "bufferViews[0].buffer is no index");
  }
  for (const json& value : {json(-1), json("0"), json(1.5), json::array()}) {
    wrong("/materials/0/pbrMetallicRoughness/baseColorTexture/texCoord", value,
          "texCoord is no whole number");
    wrong("/bufferViews/0/byteOffset", value, "byteOffset is no whole number");
  }
  wrong(kInfo, 3, "baseColorTexture has no index");
  wrong(kInfo, {{"index", 0}, {"texCoord", 4}}, "lies on TEXCOORD_4");
  wrong(kInfo, {{"index", 0}, {"extensions", {{"KHR_texture_transform", {{"scale", {1, "a"}}}}}}},
        "KHR_texture_transform.scale is not 2 finite");
  wrong("/textures/0", {{"extensions", {{"KHR_texture_basisu", {{"source", 0}}}}}},
        "only one of an extension");
  wrong("/textures/0", 3, "textures[0] is no object");
  wrong("/bufferViews/0/byteLength", 50, "goes from byte 0 for 50 bytes, its buffer has");
  wrong("/bufferViews/0/byteOffset", std::uint64_t{0} - 1, "goes from byte");
  wrong("/images/0", {{"uri", 5}}, "uri is no text");
  wrong("/images/0", json::object(), "neither uri nor bufferView");
  wrong("/images/0", {{"uri", "../secret.png"}}, "leaves the document's folder");
  wrong("/images/0", {{"uri", "https://example.org/a.png"}}, "is no relative URI");
  wrong("/images/0", {{"uri", "no.png"}}, "images[0]: \"no.png\"");
  wrong("/images/0", {{"uri", "data:image/png;base64,&&&"}}, "invalid base64");
}

TEST(GltfTextures, DamagedFilesAndBudgets) {
  EXPECT_EQ(Read("no glTF").notes.size(), 1u);
  EXPECT_EQ(Read("").notes.size(), 1u);
  EXPECT_EQ(Read("{\"materials\":" + std::string(100000, '[')).notes.size(), 1u);
  EXPECT_TRUE(Read("{\"materials\":3}").notes.empty());  // no material has a texture
  const Got got = Read(Shown().Glb(), {0, 1}, 4);
  ASSERT_EQ(got.notes.size(), 1u);
  EXPECT_NE(got.notes[0].find("images[1] has 3 bytes"), std::string::npos) << got.notes[0];
  EXPECT_TRUE(got.textures.materials[0].has_value());
  EXPECT_FALSE(got.textures.materials[1].has_value());
}

// What LoadGltf reads for them.
TEST(GltfTextures, CoordinatesAndNormals) {
  GltfBuilder b = GltfBuilder::Character();
  json& attributes = b.root["meshes"][0]["primitives"][0]["attributes"];
  attributes["TEXCOORD_1"] = b.Accessor<std::uint8_t>({0, 0, 255, 0, 0, 255}, "VEC2", true);
  attributes["NORMAL"] = b.Accessor<std::int8_t>({0, 0, 127, 0, 127, 0, 0, 0, 0}, "VEC3", true);
  const std::string text = b.Text();
  const Result<Character> good =
      LoadGltfFromMemory(std::vector<std::uint8_t>(text.begin(), text.end()), "", "a.gltf");
  ASSERT_TRUE(good.ok()) << good.status().ToString();
  const Mesh& mesh = good->meshes[0];
  EXPECT_EQ(mesh.UvSet(1), (std::vector<float>{0, 0, 1, 0, 0, 1}));
  EXPECT_TRUE(mesh.UvSet(0).empty() && mesh.UvSet(2).empty() && mesh.UvSet(99).empty());
  EXPECT_EQ(mesh.normals, (std::vector<float>{0, 0, 1, 0, 1, 0, 0, 0, 0}));
  EXPECT_EQ(good->materials[0].file, "a.gltf");
  EXPECT_EQ(good->materials[0].index, 0u);
  // Exporters write normals that are no numbers where a face has no area
  attributes["NORMAL"] = b.Accessor<float>({0, 0, 1, NAN, 1, 0, 0, INFINITY, 0}, "VEC3");
  const std::string odd = b.Text();
  const Result<Character> some =
      LoadGltfFromMemory(std::vector<std::uint8_t>(odd.begin(), odd.end()), "", "a.gltf");
  ASSERT_TRUE(some.ok()) << some.status().ToString();
  EXPECT_EQ(some->meshes[0].normals[2], 1);
  EXPECT_TRUE(std::all_of(some->meshes[0].normals.begin() + 3, some->meshes[0].normals.end(),
                          [](float value) { return std::isnan(value); }));
  attributes["NORMAL"] = b.Accessor<float>({0, 0, 1}, "VEC3");
  const std::string few = b.Text();
  EXPECT_FALSE(LoadGltfFromMemory(std::vector<std::uint8_t>(few.begin(), few.end()), "", "a.gltf").ok());
}

}  // namespace
}  // namespace kpsa::engine::gltf
