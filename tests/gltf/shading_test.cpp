#include "gltf/shading.h"

#include <gtest/gtest.h>

#include "tests/support/gltf_builder.h"
#include "tests/support/temporary_folder.h"

namespace kpsa::engine::gltf {
namespace {

using nlohmann::json;

json Textured(int texture) {
  return {{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", texture}}}}}};
}

// Materials 0 and 1 show one image; what 2 and 3 show is elsewhere.
GltfBuilder Painted() {
  GltfBuilder b;
  b.View(std::vector<std::uint8_t>{7, 8, 9});
  b.root["images"] = {{{"bufferView", 0}, {"mimeType", "image/png"}}, {{"uri", "a.png"}}};
  b.root["textures"] = {{{"source", 0}}, {{"source", 1}}};
  b.root["materials"] = {Textured(0), Textured(0), Textured(1), Textured(0)};
  b.root["materials"][0]["pbrMetallicRoughness"]["metallicFactor"] = 0.25;
  b.root["materials"][0]["doubleSided"] = true;
  b.root["materials"][0]["alphaMode"] = "MASK";
  b.root["materials"][3]["pbrMetallicRoughness"]["baseColorTexture"]["texCoord"] = 1;
  return b;
}

std::vector<std::string> Read(const std::string& bytes, std::size_t materials, PointCache* cache) {
  const TemporaryFolder folder;
  *cache = {};
  cache->materials.resize(materials);
  std::vector<std::string> notes;
  ReadShading(folder.Write("a.glb", bytes), cache, &notes);
  return notes;
}

TEST(GltfShading, FactorsAndImages) {
  PointCache cache;
  const std::vector<std::string> notes = Read(Painted().Glb(), 4, &cache);
  ASSERT_EQ(cache.images.size(), 1u);  // once for both
  EXPECT_EQ(cache.images[0].bytes, (std::vector<std::uint8_t>{7, 8, 9}));
  EXPECT_EQ(cache.images[0].type, "image/png");
  EXPECT_EQ(cache.materials[0].image, 0u);
  EXPECT_EQ(cache.materials[1].image, 0u);
  EXPECT_EQ(cache.materials[0].metallic, 0.25);
  EXPECT_EQ(cache.materials[1].metallic, 1);
  EXPECT_TRUE(cache.materials[0].double_sided);
  EXPECT_EQ(cache.materials[0].alpha_mode, "MASK");
  EXPECT_EQ(cache.materials[1].alpha_mode, "OPAQUE");
  ASSERT_EQ(notes.size(), 2u);
  EXPECT_NE(notes[0].find("is not in the file's binary part"), std::string::npos) << notes[0];
  EXPECT_NE(notes[1].find("other texture coordinates"), std::string::npos) << notes[1];
  EXPECT_EQ(cache.materials[3].image, kNoIndex);
}

// A note, and no image that is not there.
TEST(GltfShading, DamagedFiles) {
  PointCache cache;
  const auto damaged = [&](const char* pointer, const json& value) {
    GltfBuilder b = Painted();
    b.root[json::json_pointer(pointer)] = value;
    const std::vector<std::string> notes = Read(b.Glb(), 4, &cache);
    EXPECT_FALSE(notes.empty()) << pointer;
    EXPECT_TRUE(cache.images.empty()) << pointer;
  };
  for (const json& value : {json(9), json(-1), json("0"), json(), json::array()}) {
    damaged("/materials/0/pbrMetallicRoughness/baseColorTexture/index", value);
    damaged("/textures/0/source", value);
    damaged("/images/0/bufferView", value);
    damaged("/bufferViews/0/buffer", value);
    damaged("/bufferViews/0/byteOffset", value);
  }
  damaged("/bufferViews/0/byteLength", std::uint64_t{0} - 1);
  damaged("/bufferViews/0/byteLength", 5);
  damaged("/bufferViews/0/extensions", {{"EXT_meshopt_compression", json::object()}});
  damaged("/images/0/mimeType", "text/html");
  damaged("/materials", 3);
  damaged("/materials/0", 3);
  EXPECT_EQ(Read(Painted().Glb(), 5, &cache).size(), 3u);  // more than the file has
  EXPECT_EQ(Read("no glTF", 1, &cache).size(), 1u);
  EXPECT_EQ(Read("", 1, &cache).size(), 1u);
  EXPECT_EQ(Read("{\"materials\":" + std::string(100000, '['), 1, &cache).size(), 1u);
  EXPECT_TRUE(Read("", 0, &cache).empty());
}

}  // namespace
}  // namespace kpsa::engine::gltf
