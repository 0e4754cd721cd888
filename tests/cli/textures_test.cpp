// kpsa render: textures of base colours, and edges that the file shades hard.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "files/png.h"
#include "picture/decode.h"
#include "tests/cli/process.h"
#include "tests/support/gltf_builder.h"
#include "tests/support/temporary_folder.h"

namespace kpsa::engine {
namespace {

using nlohmann::json;

std::vector<std::uint8_t> FourTexels() {
  return *EncodePng(2, 2, std::vector<std::uint8_t>{255, 0, 0, 0, 255, 0, 0, 0, 255, 255, 255, 255});
}

// A sheet from -1 to 1, seen from +z, that shows a picture of four texels, once.
GltfBuilder Sheet(const json& image = json()) {
  GltfBuilder b;
  const int position = b.Accessor<float>({-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0}, "VEC3");
  const int uv = b.Accessor<float>({0, 1, 1, 1, 1, 0, 0, 0}, "VEC2");
  const int twice = b.Accessor<float>({0, 2, 2, 2, 2, 0, 0, 0}, "VEC2");
  const int indices = b.Accessor<std::uint16_t>({0, 1, 2, 0, 2, 3}, "SCALAR");
  const int view = b.View(FourTexels());
  b.Push("images", image.is_null() ? json{{"bufferView", view}, {"mimeType", "image/png"}} : image);
  b.Push("samplers", {{"magFilter", 9728}});
  b.Push("textures", {{"source", 0}, {"sampler", 0}});
  b.Push("materials", {{"name", "cloth"}, {"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}});
  b.Push("meshes", {{"primitives",
                     {{{"attributes", {{"POSITION", position}, {"TEXCOORD_0", uv}, {"TEXCOORD_1", twice}}},
                       {"indices", indices},
                       {"material", 0}}}}});
  b.Push("nodes", {{"name", "sheet"}, {"mesh", 0}});
  b.Push("scenes", {{"nodes", {0}}});
  return b;
}

class TexturesTest : public ::testing::Test {
 protected:
  // From the front, 80 by 80, with what was said.
  Image Draw(const std::string& file, std::vector<std::string> more = {}) {
    const std::string out = folder_ / "a.png";
    std::vector<std::string> arguments = {"render", file,      "--rest", "--size", "80x80",       "--azimuth",
                                          "0",      "--force", "-o",     out,      "--elevation", "0"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const ProcessResult run = RunKpsa(arguments);
    EXPECT_EQ(run.exit_code, 0) << run.err;
    said_ = run.err;
    const std::string bytes = TemporaryFolder::Read(out);
    const Result<Image> image =
        DecodePicture({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()}, 1 << 20);
    EXPECT_TRUE(image.ok());
    return image.ok() ? *image : Image(80, 80, {0, 0, 0});
  }
  Image DrawSheet(const GltfBuilder& b, std::vector<std::string> more = {}) {
    return Draw(folder_.Write("sheet.glb", b.Glb()), std::move(more));
  }
  // Which channels are bright there: "r", "rgb", "".
  static std::string Bright(const Image& image, int x, int y) {
    const Rgb c = image.At(x, y);
    std::string out;
    for (std::size_t k = 0; k < 3; ++k) {
      if (c[k] > 150) out += "rgb"[k];
    }
    return out;
  }
  // Of the four quarters of the sheet, from the upper left by rows.
  static std::vector<std::string> Quarters(const Image& image) {
    return {Bright(image, 25, 32), Bright(image, 55, 32), Bright(image, 25, 60), Bright(image, 55, 60)};
  }
  TemporaryFolder folder_;
  std::string said_;
};

const std::vector<std::string> kFour = {"r", "g", "b", "rgb"};

TEST_F(TexturesTest, EmbeddedBesideAndOfDataUris) {
  EXPECT_EQ(Quarters(DrawSheet(Sheet())), kFour);
  EXPECT_EQ(said_.find("warning"), std::string::npos) << said_;
  const std::vector<std::uint8_t> png = FourTexels();
  folder_.Write("cloth.png", std::string(png.begin(), png.end()));
  EXPECT_EQ(Quarters(DrawSheet(Sheet({{"uri", "cloth.png"}}))), kFour);
  GltfBuilder data;
  data.buffer = png;
  EXPECT_EQ(Quarters(DrawSheet(Sheet({{"uri", "data:image/png;base64," + data.Base64()}}))), kFour);
  EXPECT_EQ(Quarters(Draw(folder_.Write("sheet.gltf", Sheet().Text()))), kFour);
}

TEST_F(TexturesTest, BaseColourIsMultipliedAndAloneWithoutThem) {
  GltfBuilder b = Sheet();
  b.root["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] = {1, 0, 0.9, 1};
  EXPECT_EQ(Quarters(DrawSheet(b)), (std::vector<std::string>{"r", "", "b", "rb"}));
  EXPECT_EQ(Quarters(DrawSheet(b, {"--no-textures"})), (std::vector<std::string>{"rb", "rb", "rb", "rb"}));
}

TEST_F(TexturesTest, OtherCoordinatesSamplersAndTransforms) {
  GltfBuilder b = Sheet();
  json& info = b.root["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"];
  info["texCoord"] = 1;  // four times the picture: a quarter of the sheet shows all of it
  const Image repeated = DrawSheet(b);
  EXPECT_EQ(Bright(repeated, 14, 14), "r");
  EXPECT_EQ(Bright(repeated, 31, 14), "g");
  EXPECT_EQ(Bright(repeated, 48, 14), "r");
  b.root["samplers"][0]["wrapS"] = 33071;
  EXPECT_EQ(Bright(DrawSheet(b), 48, 14), "g");
  b.root["samplers"][0]["wrapS"] = 33648;
  EXPECT_EQ(Bright(DrawSheet(b), 48, 14), "g");
  EXPECT_EQ(Bright(DrawSheet(b), 66, 14), "r");
  info["texCoord"] = 0;
  info["extensions"]["KHR_texture_transform"] = {{"offset", {0.5, 0}}};
  b.root["samplers"][0]["wrapS"] = 10497;
  b.root["extensionsUsed"] = b.root["extensionsRequired"] = {"KHR_texture_transform"};
  EXPECT_EQ(Quarters(DrawSheet(b)), (std::vector<std::string>{"g", "r", "rgb", "b"}));
}

// One warning, which says where, and the base colour.
TEST_F(TexturesTest, BrokenPicturesAreToldAndLeftOut) {
  const auto told = [&](const GltfBuilder& b, const std::string& message) {
    EXPECT_EQ(Quarters(DrawSheet(b)), (std::vector<std::string>{"rgb", "rgb", "rgb", "rgb"})) << message;
    EXPECT_NE(said_.find("warning: "), std::string::npos) << said_;
    EXPECT_NE(said_.find(message), std::string::npos) << said_;
    DrawSheet(b, {"-q"});
    EXPECT_EQ(said_, "");
  };
  folder_.Write("cut.png", "\x89PNG\r\n\x1a\n");
  folder_.Write("text.png", "no picture");
  told(Sheet({{"uri", "cut.png"}}), "images[0] is a damaged PNG");
  told(Sheet({{"uri", "text.png"}}), "images[0] is neither PNG nor JPEG");
  told(Sheet({{"uri", "none.png"}}), "images[0]: \"none.png\"");
  GltfBuilder b = Sheet();
  b.root["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["texCoord"] = 2;
  told(b, "no TEXCOORD_2 for its texture");
  b.root["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = {{"index", 7}};
  told(b, "baseColorTexture.index is no index");
}

TEST_F(TexturesTest, ManyWarningsAreCounted) {
  GltfBuilder b = Sheet({{"uri", "none.png"}});
  const json material = b.root["materials"][0], primitive = b.root["meshes"][0]["primitives"][0];
  for (int m = 1; m < 30; ++m) {
    b.root["materials"].push_back(material);
    b.root["meshes"][0]["primitives"].push_back(primitive);
    b.root["meshes"][0]["primitives"].back()["material"] = m;
  }
  DrawSheet(b);
  std::size_t count = 0;
  for (std::size_t at = said_.find("warning: "); at != std::string::npos;
       at = said_.find("warning: ", at + 1))
    ++count;
  EXPECT_EQ(count, 21u) << said_;
  EXPECT_NE(said_.find("... and 10 more"), std::string::npos) << said_;
}

// Two characters, each with the pictures of its own file.
TEST_F(TexturesTest, OfReferences) {
  folder_.Write("one.glb", Sheet().Glb());
  GltfBuilder other = Sheet();
  other.root["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["extensions"]
            ["KHR_texture_transform"] = {{"offset", {0.5, 0}}};
  folder_.Write("two.glb", other.Glb());
  const std::string rig =
      folder_.Write("both.yaml", "kpsa: 1\nreferences:\n  a: {file: one.glb}\n  b: {file: two.glb}\n");
  EXPECT_EQ(Quarters(Draw(rig, {"--mesh", "a:sheet"})), kFour);
  EXPECT_EQ(Quarters(Draw(rig, {"--mesh", "b:sheet"})), (std::vector<std::string>{"g", "r", "rgb", "b"}));
}

// The picture of a camera of the rig, by its light.
TEST_F(TexturesTest, ThroughACamera) {
  folder_.Write("sheet.glb", Sheet().Glb());
  const std::string rig =
      folder_.Write("camera.yaml",
                    "kpsa: 1\ncharacter: sheet.glb\nnodes:\n  eye: {type: transform, translate: [0, 0, 4]}\n"
                    "  front: {type: camera, matrix: eye.worldMatrix}\n");
  const std::string out = folder_ / "camera.png";
  for (const bool textures : {true, false}) {
    std::vector<std::string> arguments = {"render", rig, "--rest", "--camera", "front", "--force", "-o", out};
    if (!textures) arguments.emplace_back("--no-textures");
    const ProcessResult run = RunKpsa(arguments);
    ASSERT_EQ(run.exit_code, 0) << run.err;
    const std::string bytes = TemporaryFolder::Read(out);
    const Result<Image> image =
        DecodePicture({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()}, 1 << 20);
    ASSERT_TRUE(image.ok());
    const int w = image->width, h = image->height;
    const auto dominant = [&](int x, int y) {
      const Rgb c = image->At(x, y);
      return std::string(c[0] > 2 * c[1] ? "r" : c[1] > 2 * c[0] ? "g" : c[2] > 2 * c[0] ? "b" : "grey");
    };
    const std::vector<std::string> seen = {dominant(w / 2 - w / 16, h / 2 - h / 16),
                                           dominant(w / 2 + w / 16, h / 2 - h / 16),
                                           dominant(w / 2 - w / 16, h / 2 + h / 16)};
    EXPECT_EQ(seen, textures ? (std::vector<std::string>{"r", "g", "b"})
                             : (std::vector<std::string>{"grey", "grey", "grey"}));
  }
}

}  // namespace
}  // namespace kpsa::engine
