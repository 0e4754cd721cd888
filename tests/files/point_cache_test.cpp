#include "files/point_cache.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>

#include "gltf/blender_order.h"
#include "gltf/export.h"
#include "tests/support/gltf_reference.h"
#include "tests/support/temporary_folder.h"

namespace kpsa::engine {
namespace {

using nlohmann::json;

// Two meshes: a moving triangle and a still point.
PointCache Small() {
  PointCache cache;
  cache.times = {0.5, 0.75, 1};
  cache.fps = 4;
  cache.meshes.push_back({"tri", 3, {}, {0, 1, 2}});
  for (int t = 0; t < 3; ++t) {
    for (int i = 0; i < 9; ++i) cache.meshes[0].frames.push_back(static_cast<float>(10 * t + i));
  }
  cache.meshes.push_back({"dot", 1, {1, 2, 3, 1, 2, 3, 1, 2, 3}, {}});
  return cache;
}

std::string Hex(const std::string& bytes) {
  std::string text;
  for (const char c : bytes) text += fmt::format("{:02x}", static_cast<unsigned char>(c));
  return text;
}

TEST(PointCache, Pc2Bytes) {
  const TemporaryFolder folder;
  std::vector<std::string> warnings;
  ASSERT_TRUE(WritePc2(folder / "a.pc2", Small(), 1, {.axes = CacheAxes::kBlender}, &warnings).ok());
  EXPECT_TRUE(warnings.empty());
  // "POINTCACHE2\0", 1, 1 point, first frame 2, 1 frame a sample, 3 samples; (1, -3, 2) each
  std::string expected = "504f494e54434143484532000100000001000000000000400000803f03000000";
  for (int i = 0; i < 3; ++i) expected += "0000803f000040c000000040";
  EXPECT_EQ(Hex(TemporaryFolder::Read(folder / "a.pc2")), expected);
}

TEST(PointCache, MddBytes) {
  const TemporaryFolder folder;
  ASSERT_TRUE(WriteMdd(folder / "a.mdd", Small(), 1, {}).ok());
  std::string expected =
      "0000000300000001"
      "3f0000003f4000003f800000";
  for (int i = 0; i < 3; ++i) expected += "3f8000004000000040400000";
  EXPECT_EQ(Hex(TemporaryFolder::Read(folder / "a.mdd")), expected);
}

TEST(PointCache, RoundTripWithOrder) {
  const TemporaryFolder folder;
  const PointCache cache = Small();
  std::vector<std::string> warnings;
  ASSERT_TRUE(WritePc2(folder / "a.pc2", cache, 0, {}, &warnings).ok());
  ASSERT_TRUE(WriteMdd(folder / "b.mdd", cache, 0, {.order = {2, 0}}).ok());
  const Result<PointCache> a = ReadPc2(folder / "a.pc2", 4), b = ReadMdd(folder / "b.mdd");
  ASSERT_TRUE(a.ok() && b.ok());
  EXPECT_EQ(a->times, cache.times);
  EXPECT_EQ(a->meshes[0].frames, cache.meshes[0].frames);
  EXPECT_EQ(b->times, cache.times);
  EXPECT_EQ(b->meshes[0].vertex_count, 2u);
  EXPECT_EQ(std::vector<float>(b->meshes[0].frames.begin() + 6, b->meshes[0].frames.begin() + 12),
            (std::vector<float>{16, 17, 18, 10, 11, 12}));
  EXPECT_FALSE(WriteMdd(folder / "b.mdd", cache, 0, {}).ok());  // exists
  EXPECT_TRUE(WriteMdd(folder / "b.mdd", cache, 0, {.force = true}).ok());
  PointCache uneven = cache;
  uneven.times[1] = 0.6;
  ASSERT_TRUE(WritePc2(folder / "u.pc2", uneven, 0, {}, &warnings).ok());
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_NE(warnings[0].find("unevenly"), std::string::npos);
}

TEST(PointCache, RefusesDamagedFiles) {
  const TemporaryFolder folder;
  std::vector<std::string> warnings;
  ASSERT_TRUE(WritePc2(folder / "a.pc2", Small(), 0, {}, &warnings).ok());
  ASSERT_TRUE(WriteMdd(folder / "a.mdd", Small(), 0, {}).ok());
  const std::string pc2 = TemporaryFolder::Read(folder / "a.pc2"),
                    mdd = TemporaryFolder::Read(folder / "a.mdd");
  const auto pc2_error = [&](std::string bytes) {
    return ReadPc2(folder.Write("x", bytes)).status().ToString();
  };
  const auto mdd_error = [&](std::string bytes) {
    return ReadMdd(folder.Write("x", bytes)).status().ToString();
  };
  for (std::size_t size = 0; size < pc2.size(); ++size) EXPECT_NE(pc2_error(pc2.substr(0, size)), "");
  for (std::size_t size = 0; size < mdd.size(); ++size) EXPECT_NE(mdd_error(mdd.substr(0, size)), "");
  EXPECT_NE(pc2_error(mdd).find("is no PC2"), std::string::npos);
  std::string huge = pc2;
  huge.replace(16, 4, "\xff\xff\xff\xff");
  EXPECT_NE(pc2_error(huge).find("need another number"), std::string::npos);
  huge.replace(16, 4, std::string(4, '\0'));  // no points, yet data
  EXPECT_NE(pc2_error(huge).find("need another number"), std::string::npos);
  std::string nan = mdd;
  nan.replace(20, 4, std::string("\x7f\xc0\x00\x01", 4));
  EXPECT_NE(mdd_error(nan).find("not finite"), std::string::npos);
  huge = mdd;
  huge.replace(0, 8, std::string("\xff\xff\xff\xff\xff\xff\xff\xff"));
  EXPECT_NE(mdd_error(huge).find("need another number"), std::string::npos);
}

TEST(PointCache, PathsOfSeveralMeshes) {
  PointCache cache = Small();
  EXPECT_EQ(CachePathForMesh("out/a.pc2", cache, 0), "out/a.tri.pc2");
  cache.meshes[0].name = "a/b:c";
  cache.meshes[1].name = "a\\b c";
  EXPECT_EQ(CachePathForMesh("a.pc2", cache, 0), "a.a_b_c.pc2");
  EXPECT_EQ(CachePathForMesh("a.pc2", cache, 1), "a.a_b c.pc2");
  cache.meshes[1].name = "a_b_c";
  EXPECT_EQ(CachePathForMesh("a.pc2", cache, 1), "a.a_b_c-1.pc2");
  cache.meshes.resize(1);
  EXPECT_EQ(CachePathForMesh("out/a.pc2", cache, 0), "out/a.pc2");
}

TEST(PointCache, BlenderOrderKeepsUsedVerticesOfEachPrimitive) {
  gltf::Mesh mesh;
  mesh.positions.resize(3 * 9);
  mesh.primitives = {
      {.first_vertex = 0, .vertex_count = 5, .triangles = {4, 1, 2}, .material = kNoIndex},
      {.first_vertex = 5, .vertex_count = 4, .triangles = {8, 5, 6, 5, 6, 8}, .material = kNoIndex}};
  EXPECT_EQ(BlenderVertexOrder(mesh), (std::vector<Index>{1, 2, 4, 5, 6, 8}));
}

// The same with what it is shown with: the triangle has a material and texture coordinates.
PointCache Looking() {
  PointCache cache = Small();
  cache.rig = "hello.yaml";
  cache.clip = "wave";
  cache.materials.push_back(
      {.name = "red clay", .base_color = {0.5, 0.25, 0, 1}, .roughness = 0.75, .image = 0});
  cache.images.push_back({"image/png", {1, 2, 3, 4, 5}});
  cache.meshes[0].uvs = {0, 0, 1, 0, 0, 0.75f};
  cache.meshes[0].parts = {{0, 3, 0}};
  return cache;
}

// Faces and colours by part, and the same numbers for both.
TEST(PointCache, UsdaPartsAndColors) {
  const TemporaryFolder folder;
  PointCache cache;
  cache.times = {0};
  cache.materials = {{.name = "a", .base_color = {1, 0, 0, 1}}, {.name = "a", .base_color = {0, 1, 0, 1}}};
  cache.meshes.push_back(
      {"two", 6, {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 0, 1, 0, 1, 1}, {0, 1, 2, 5, 4, 3}});
  cache.meshes[0].parts = {{0, 3, 0}, {3, 3, 1}};
  std::vector<std::string> warnings;
  ASSERT_TRUE(WriteUsda(folder / "a.usda", cache, false, &warnings).ok());
  std::string text = TemporaryFolder::Read(folder / "a.usda");
  for (const char* part :
       {"int[] indices = [0]\n            rel material:binding = </cache/Looks/a>",
        "int[] indices = [1]\n            rel material:binding = </cache/Looks/a_1>",
        "displayColor = [(1, 0, 0), (1, 0, 0), (1, 0, 0), (0, 1, 0), (0, 1, 0), (0, 1, 0)] (\n",
        "0: [(0, 0, 1), (0, 0, 1), (0, 0, 1), (0, 0, -1), (0, 0, -1), (0, 0, -1)],\n"})
    EXPECT_NE(text.find(part), std::string::npos) << part;
  cache.meshes[0].colors.assign(18, 0.5f);
  ASSERT_TRUE(WriteUsda(folder / "b.usda", cache, false, &warnings).ok());
  text = TemporaryFolder::Read(folder / "b.usda");
  EXPECT_NE(text.find("(0.5, 0, 0), (0, 0.5, 0)"), std::string::npos);
  EXPECT_EQ(text.find("material:binding"), std::string::npos);
}

TEST(PointCache, UsdaText) {
  const TemporaryFolder folder;
  PointCache cache = Looking();
  cache.meshes[0].frames[0] = 0.1f;
  cache.meshes[1].name = "9 \"dots\"\n";
  std::vector<std::string> warnings;
  ASSERT_TRUE(WriteUsda(folder / "a.usda", cache, false, &warnings).ok());
  EXPECT_TRUE(warnings.empty());
  const std::string text = TemporaryFolder::Read(folder / "a.usda");
  EXPECT_TRUE(text.starts_with("#usda 1.0\n"));
  for (const char* part : {"startTimeCode = 2\n",
                           "endTimeCode = 4\n",
                           "timeCodesPerSecond = 4\n",
                           "upAxis = \"Y\"",
                           "def Mesh \"tri\"",
                           "int[] faceVertexCounts = [3]",
                           "int[] faceVertexIndices = [0, 1, 2]",
                           "2: [(0.1, 1, 2), (3, 4, 5), (6, 7, 8)],\n",
                           "4: [(20, 21, 22)",
                           "def Mesh \"_9__dots__\"",
                           "sourceName = \"9 \\\"dots\\\" \"",
                           "int[] faceVertexCounts = []",
                           "kpsa:rig = \"hello.yaml\"",
                           "2: [(0.1, 1, 2), (6, 7, 8)],\n",
                           "4: [(20, 21, 22), (26, 27, 28)],\n",
                           "texCoord2f[] primvars:st = [(0, 1), (1, 1), (0, 0.25)]",
                           "normal3f[] normals.timeSamples = {",
                           "primvars:displayColor = [(0.5, 0.25, 0)]",
                           "subdivisionScheme = \"none\"",
                           "def Material \"red_clay\"",
                           "diffuseColor = (0.5, 0.25, 0)",
                           "roughness = 0.75",
                           "rel material:binding = </cache/Looks/red_clay>"}) {
    EXPECT_NE(text.find(part), std::string::npos) << part;
  }
}

// The file's own animation, evaluated by the reference, against the cache.
void ExpectSameAsCache(const std::string& path, const PointCache& cache, const GlbReport& report) {
  const Result<gltf::Character> character = gltf::LoadGltf(path);
  ASSERT_TRUE(character.ok()) << character.status().ToString();
  const gltf::Clip* clip = character->clips.empty() ? nullptr : &character->clips[0];
  double worst = 0, sum = 0, count = 0;
  for (std::size_t t = 0; t < cache.times.size(); ++t) {
    const auto pose = gltf_reference::Evaluate(*character, clip, static_cast<float>(cache.times[t]));
    for (std::size_t m = 0; m < cache.meshes.size(); ++m) {
      const auto points = gltf_reference::Points(*character, pose, static_cast<Index>(m));
      ASSERT_EQ(points.size(), cache.meshes[m].vertex_count);
      for (std::size_t v = 0; v < points.size(); ++v) {
        const float* p = &cache.meshes[m].frames[(t * points.size() + v) * 3];
        const double distance = Length(points[v] - Double3{p[0], p[1], p[2]});
        worst = std::max(worst, distance);
        sum += distance * distance, ++count;
      }
    }
  }
  EXPECT_NEAR(worst, report.max_residual, 1e-6 * report.diagonal);
  EXPECT_NEAR(std::sqrt(sum / count), report.rms_residual, 1e-6 * report.diagonal);
}

TEST(MorphGlb, FewShapesForManyFrames) {
  // 60 frames of 200 points that are mixtures of 3 shapes, and a still mesh
  PointCache cache;
  cache.meshes.push_back({"wave", 200, {}, {0, 1, 2, 2, 1, 3}});
  cache.meshes.push_back({"still", 1, {}, {}});
  for (int t = 0; t < 60; ++t) {
    cache.times.push_back(t / 24.0);
    for (int v = 0; v < 200; ++v) {
      const double x = v / 200.0, a = std::sin(t * 0.1), b = std::cos(t * 0.23), c = t / 60.0;
      cache.meshes[0].frames.insert(cache.meshes[0].frames.end(),
                                    {static_cast<float>(x + 0.1 * a * std::sin(9 * x)),
                                     static_cast<float>(b * x * x), static_cast<float>(c * std::cos(5 * x))});
    }
    cache.meshes[1].frames.insert(cache.meshes[1].frames.end(), {1, 2, 3});
  }
  const TemporaryFolder folder;
  const Result<GlbReport> report = WriteGlb(folder / "a.glb", cache, {});
  ASSERT_TRUE(report.ok()) << report.status().ToString();
  EXPECT_EQ(report->targets, (std::vector<int>{3, 0}));
  EXPECT_LT(report->max_residual, 1e-4 * report->diagonal);
  ExpectSameAsCache(folder / "a.glb", cache, *report);
  const Result<gltf::Character> character = gltf::LoadGltf(folder / "a.glb");
  EXPECT_EQ(character->nodes[0].name, "wave");
  EXPECT_EQ(character->meshes[0].primitives[0].triangles, cache.meshes[0].triangles);
  // What clamps weights to [0, 1] shows the same; each shape uses all of it
  const std::vector<double>& weights = character->clips[0].channels[0].values;
  EXPECT_EQ(*std::min_element(weights.begin(), weights.end()), 0);
  EXPECT_EQ(*std::max_element(weights.begin(), weights.end()), 1);
  // Fewer targets than it takes: an honest residual
  const Result<GlbReport> coarse = WriteGlb(folder / "b.glb", cache, {.max_targets = 1});
  ASSERT_TRUE(coarse.ok());
  EXPECT_EQ(coarse->targets[0], 1);
  EXPECT_GT(coarse->max_residual, 1e-2 * coarse->diagonal);
  ExpectSameAsCache(folder / "b.glb", cache, *coarse);
  EXPECT_FALSE(WriteGlb(folder / "b.glb", cache, {}).ok());
}

json GlbJson(const std::string& path) {
  const std::string bytes = TemporaryFolder::Read(path);
  std::uint32_t size = 0;
  std::memcpy(&size, &bytes[12], 4);
  return json::parse(bytes.substr(20, size));
}

// The floats of an accessor.
std::vector<float> GlbFloats(const std::string& path, const json& root, const json& accessor,
                             std::size_t width) {
  const std::string bytes = TemporaryFolder::Read(path);
  std::uint32_t size = 0;
  std::memcpy(&size, &bytes[12], 4);
  const json& view =
      root["bufferViews"][root["accessors"][accessor.get<std::size_t>()]["bufferView"].get<std::size_t>()];
  std::vector<float> values(root["accessors"][accessor.get<std::size_t>()]["count"].get<std::size_t>() *
                            width);
  std::memcpy(values.data(), &bytes[28 + size + view["byteOffset"].get<std::size_t>()], 4 * values.size());
  return values;
}

TEST(MorphGlb, NamesMaterialsAndTextureCoordinates) {
  const TemporaryFolder folder;
  const std::string path = folder / "a.glb";
  ASSERT_TRUE(WriteGlb(path, Looking(), {}).ok());
  const json root = GlbJson(path);
  EXPECT_EQ(root["animations"][0]["name"], "wave");
  EXPECT_EQ(root["meshes"][0]["extras"]["targetNames"], (json{"shape1"}));
  const json& material = root["materials"][0];
  EXPECT_EQ(material["name"], "red clay");
  EXPECT_EQ(material["pbrMetallicRoughness"]["baseColorFactor"], (json{0.5, 0.25, 0, 1}));
  EXPECT_EQ(material["pbrMetallicRoughness"]["roughnessFactor"], 0.75);
  EXPECT_EQ(material["pbrMetallicRoughness"]["baseColorTexture"]["index"], 0);
  EXPECT_EQ(root["textures"][0]["source"], 0);
  EXPECT_EQ(root["images"][0]["mimeType"], "image/png");
  const json& view = root["bufferViews"][root["images"][0]["bufferView"].get<std::size_t>()];
  EXPECT_EQ(view["byteLength"], 5);
  const json& primitive = root["meshes"][0]["primitives"][0];
  EXPECT_EQ(primitive["material"], 0);
  EXPECT_EQ(GlbFloats(path, root, primitive["attributes"]["TEXCOORD_0"], 2), Looking().meshes[0].uvs);
  EXPECT_FALSE(root["meshes"][1]["primitives"][0].contains("material"));
  EXPECT_TRUE(gltf::LoadGltf(path).ok());
}

// What is flat has no normals, so that readers give it those of its faces; a usda mesh has them for all of its vertices
// or for none.
TEST(MorphGlb, FlatPartsHaveNoNormals) {
  PointCache cache;
  cache.times = {0, 1};
  cache.meshes.push_back({"roof", 6, {}, {0, 1, 2, 3, 4, 5}});
  PointCacheMesh& mesh = cache.meshes[0];
  mesh.parts = {{0, 3}, {3, 3}};
  mesh.smooth = {0, 1, 2, kNoIndex, kNoIndex, kNoIndex};
  for (const float lift : {0.0f, 1.0f})
    mesh.frames.insert(mesh.frames.end(), {0, lift, 0, 0, 0, 1, 1, 0, 0, 2, lift, 0, 2, 0, 1, 3, 0, 0});
  const TemporaryFolder folder;
  const std::string path = folder / "a.glb";
  ASSERT_TRUE(WriteGlb(path, cache, {}).ok());
  const json root = GlbJson(path);
  for (const int part : {0, 1}) {
    const json& primitive = root["meshes"][0]["primitives"][static_cast<std::size_t>(part)];
    EXPECT_EQ(primitive["attributes"].contains("NORMAL"), part == 0);
    EXPECT_EQ(primitive["targets"][0].contains("NORMAL"), part == 0);
  }
  EXPECT_TRUE(gltf::LoadGltf(path).ok());
  std::vector<std::string> warnings;
  ASSERT_TRUE(WriteUsda(folder / "some.usda", cache, false, &warnings).ok());
  EXPECT_NE(TemporaryFolder::Read(folder / "some.usda").find("normals.timeSamples"), std::string::npos);
  mesh.smooth.assign(6, kNoIndex);
  ASSERT_TRUE(WriteUsda(folder / "none.usda", cache, false, &warnings).ok());
  EXPECT_EQ(TemporaryFolder::Read(folder / "none.usda").find("normal3f"), std::string::npos);
}

// Two triangles that share an edge of doubled vertices and fold: normals of every frame are what the shapes
// come to, the doubled vertices share theirs, and each part has its own vertices.
TEST(MorphGlb, NormalsOfEveryFrame) {
  PointCache cache;
  cache.materials.resize(2);
  cache.meshes.push_back({"fold", 6, {}, {0, 2, 1, 3, 4, 5}});
  PointCacheMesh& mesh = cache.meshes[0];
  mesh.smooth = {0, 1, 2, 1, 2, 5};
  mesh.parts = {{0, 3, 0}, {3, 3, 1}};
  mesh.colors.assign(18, 0.5f);
  constexpr int kFrames = 24;
  for (int t = 0; t < kFrames; ++t) {
    cache.times.push_back(t);
    const float a = 0.02f * static_cast<float>(t);
    mesh.frames.insert(mesh.frames.end(), {-std::cos(a), std::sin(a), 0, 0, 0, -1, 0, 0, 1,  //
                                           0, 0, -1, 0, 0, 1, std::cos(a), std::sin(a), 0});
  }
  const TemporaryFolder folder;
  const std::string path = folder / "a.glb";
  ASSERT_TRUE(WriteGlb(path, cache, {.tolerance = 1e-7}).ok());
  const json root = GlbJson(path);
  const json& sampler = root["animations"][0]["samplers"][0];
  const std::size_t targets = root["meshes"][0]["primitives"][0]["targets"].size();
  const std::vector<float> weights = GlbFloats(path, root, sampler["output"], 1);
  ASSERT_EQ(weights.size(), targets * kFrames);
  for (std::size_t p = 0; p < 2; ++p) {
    const json& primitive = root["meshes"][0]["primitives"][p];
    EXPECT_EQ(primitive["material"], p);
    EXPECT_TRUE(primitive["attributes"].contains("COLOR_0"));
    const std::vector<float> rest = GlbFloats(path, root, primitive["attributes"]["NORMAL"], 3);
    ASSERT_EQ(rest.size(), 9u);
    for (std::size_t t = 0; t < kFrames; ++t) {
      std::vector<float> now = rest;
      for (std::size_t k = 0; k < targets; ++k) {
        const std::vector<float> delta = GlbFloats(path, root, primitive["targets"][k]["NORMAL"], 3);
        for (std::size_t i = 0; i < 9; ++i) now[i] += weights[t * targets + k] * delta[i];
      }
      const double a = 0.02 * static_cast<double>(t), side = p == 0 ? -1 : 1;
      for (std::size_t v = 0; v < 3; ++v) {
        const bool on_edge = p == 0 ? v > 0 : v < 2;
        const Double3 expected = on_edge ? Double3{0, 1, 0} : Double3{-side * std::sin(a), std::cos(a), 0};
        const Double3 n = {now[3 * v], now[3 * v + 1], now[3 * v + 2]};
        EXPECT_NEAR(Length(Double3{rest[3 * v], rest[3 * v + 1], rest[3 * v + 2]}), 1, 1e-6);
        EXPECT_GT(Dot(n, expected) / Length(n), 0.9999) << p << " " << t << " " << v;
      }
    }
  }
  const Result<gltf::Character> character = gltf::LoadGltf(path);
  ASSERT_TRUE(character.ok());
  EXPECT_EQ(character->meshes[0].primitives[1].triangles, (std::vector<Index>{3, 4, 5}));
}

TEST(MorphGlb, MoreFramesThanNumbersAndOtherEdges) {
  const TemporaryFolder folder;
  PointCache cache;
  cache.meshes.push_back({"dot", 1, {}, {}});
  for (int t = 0; t < 20; ++t) {
    cache.times.push_back(t);
    cache.meshes[0].frames.insert(cache.meshes[0].frames.end(),
                                  {std::sin(0.7f * static_cast<float>(t)), static_cast<float>(t % 3), 1});
  }
  Result<GlbReport> report = WriteGlb(folder / "a.glb", cache, {.tolerance = 0});
  ASSERT_TRUE(report.ok());
  EXPECT_EQ(report->targets[0], 2);
  ExpectSameAsCache(folder / "a.glb", cache, *report);
  PointCache single = Small();
  single.times.resize(1);
  for (PointCacheMesh& mesh : single.meshes) mesh.frames.resize(mesh.vertex_count * 3);
  report = WriteGlb(folder / "b.glb", single, {});
  ASSERT_TRUE(report.ok());
  EXPECT_TRUE(gltf::LoadGltf(folder / "b.glb")->clips.empty());
  ExpectSameAsCache(folder / "b.glb", single, *report);
  PointCache still = Small();
  still.meshes.erase(still.meshes.begin());
  ASSERT_TRUE(WriteGlb(folder / "c.glb", still, {}).ok());
  EXPECT_TRUE(gltf::LoadGltf(folder / "c.glb").ok());
  ASSERT_TRUE(WriteGlb(folder / "d.glb", PointCache(), {}).ok());
  EXPECT_TRUE(gltf::LoadGltf(folder / "d.glb").ok());
  cache.times[3] = cache.times[2];
  EXPECT_NE(WriteGlb(folder / "e.glb", cache, {}).status().ToString().find("ascend"), std::string::npos);
}

}  // namespace
}  // namespace kpsa::engine
