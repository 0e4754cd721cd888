#include "gltf/import.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/gltf_builder.h"
#include "tests/support/gltf_reference.h"
#include "tests/support/temporary_folder.h"

namespace kpsa::engine::gltf {
namespace {

using nlohmann::json;

Result<Character> Load(const std::string& bytes, const std::string& folder = "/nonexistent") {
  return LoadGltfFromMemory({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()}, folder,
                            "test.gltf");
}

Character MustLoad(const std::string& bytes, const std::string& folder = "/nonexistent") {
  Result<Character> character = Load(bytes, folder);
  if (!character.ok()) {
    ADD_FAILURE() << character.status().ToString();
    return {};
  }
  return std::move(*character);
}

// One mesh node with one primitive of these attributes.
GltfBuilder WithPrimitive(GltfBuilder b, const json& primitive) {
  b.Push("meshes", {{"primitives", {primitive}}});
  b.Push("nodes", {{"mesh", 0}});
  return b;
}

TEST(GltfImport, EverySectionOfACharacter) {
  const GltfBuilder builder = GltfBuilder::Character();
  for (const std::string& bytes : {builder.Text(), builder.Glb()}) {
    const Character c = MustLoad(bytes);
    ASSERT_EQ(c.nodes.size(), 4u);
    EXPECT_EQ(c.nodes[0].name, "body");
    EXPECT_EQ(c.nodes[3].parent, 1u);
    EXPECT_EQ(c.nodes[2].parent, 3u);
    EXPECT_TRUE(c.nodes[3].has_matrix);
    EXPECT_EQ(c.nodes[3].LocalMatrix()(2, 3), 5);
    EXPECT_EQ(c.order, (std::vector<Index>{0, 1, 3, 2}));
    const Mesh& mesh = c.meshes.at(0);
    EXPECT_EQ(mesh.vertex_count(), 3u);
    EXPECT_EQ(mesh.primitives.at(0).triangles, (std::vector<Index>{0, 1, 2}));
    EXPECT_TRUE(mesh.primitives[0].skinned);
    EXPECT_EQ(mesh.influence_offsets, (std::vector<Index>{0, 2, 3, 4}));
    EXPECT_EQ(mesh.influences[1].joint, 1u);
    EXPECT_EQ(mesh.influences[1].weight, 0.75f);
    ASSERT_EQ(mesh.targets.size(), 1u);
    EXPECT_EQ(mesh.targets[0].name, "up");
    EXPECT_EQ(mesh.targets[0].vertices, (std::vector<Index>{1}));
    EXPECT_EQ(mesh.targets[0].deltas, (std::vector<float>{0, 0, 2}));
    EXPECT_EQ(mesh.weights, (std::vector<double>{0.5}));
    EXPECT_EQ(c.skins.at(0).joints, (std::vector<Index>{1, 2}));
    EXPECT_EQ(c.materials.at(0).name, "Skin");
    EXPECT_EQ(c.materials[0].base_color[1], 0.5);
    const Clip& clip = c.clips.at(0);
    EXPECT_EQ(clip.id, "wave");
    EXPECT_EQ(clip.duration, 3);
    EXPECT_EQ(clip.channels.at(1).interpolation, Interpolation::kStep);
    EXPECT_EQ(clip.channels[1].path, Path::kWeights);
    EXPECT_TRUE(c.warnings.empty());
    // Rest: morph 0.5 lifts vertex 1 by 1; it follows the tip at (0, 1, 5)
    const auto points = gltf_reference::Points(c, gltf_reference::Evaluate(c, nullptr, 0), 0);
    EXPECT_EQ(points[1], (Double3{1, 1, 6}));
    EXPECT_EQ(points[0], (Double3{0, 1, 3.75}));
  }
}

TEST(GltfImport, OddButValidDocuments) {
  const Character empty = MustLoad(R"({"asset":{"version":"2.0"}})");
  EXPECT_TRUE(empty.nodes.empty());
  MustLoad(
      "\xef\xbb\xbf  {\"asset\":{\"version\":\"2.1\",\"minVersion\":\"2.0\"},\"meshes\":[],\"scenes\":[]}");
  // Extras and unknown extensions anywhere, unused data with absurd counts, missing images
  GltfBuilder b = GltfBuilder::Character();
  b.root["extras"] = {1, {2, {3}}};
  b.root["nodes"][0]["extras"] = "text";
  b.root["nodes"][1]["extensions"] = {{"VENDOR_thing", {{"a", 1}}}};
  b.root["meshes"][0]["extras"]["other"] = nullptr;
  b.root["accessors"].push_back({{"componentType", 5126}, {"count", 9007199254740992}, {"type", "VEC3"}});
  b.root["images"] = {{{"uri", "missing.png"}}, {{"uri", "../../etc/passwd"}}};
  b.root["textures"] = {{{"source", 99}}};
  b.root["cameras"] = {3};
  b.root["extensionsUsed"] = {"VENDOR_thing", "KHR_draco_mesh_compression"};
  b.root["extensionsRequired"] = {"KHR_texture_transform", "KHR_materials_unlit", "KHR_mesh_quantization",
                                  "KHR_lights_punctual", "EXT_texture_webp"};
  EXPECT_EQ(MustLoad(b.Text()).meshes.at(0).vertex_count(), 3u);
}

TEST(GltfImport, ScenesAndNames) {
  json root = {{"asset", {{"version", "2.0"}}},
               {"meshes", {{{"primitives", json::array({{{"attributes", json::object()}}})}}}},
               {"nodes",
                {{{"name", "Head"}, {"mesh", 0}, {"children", {1}}},
                 {{"name", "Head"}, {"mesh", 0}},
                 {{"name", "Head"}},
                 {{"mesh", 0}},
                 {{"name", "M\xc3\xbcnd/\xe5\x8f\xa3"}, {"mesh", 0}},
                 {{"name", ""}}}},
               {"scenes", {{{"nodes", {3}}}, {{"nodes", {0}}}}},
               {"scene", 1}};
  Character c = MustLoad(root.dump());
  const std::vector<std::string> names = {"Head#0", "Head#1", "Head#2", "node3", "M\xc3\xbcnd/\xe5\x8f\xa3",
                                          "node5"};
  EXPECT_EQ(c.UniqueNames(), names);
  for (Index i = 0; i < names.size(); ++i) EXPECT_EQ(c.UniqueName(i), names[i]);
  EXPECT_EQ(c.MeshNodes(), (std::vector<Index>{0, 1}));
  root["nodes"][1].erase("mesh");  // now one mesh node is named Head, and two others
  EXPECT_EQ(MustLoad(root.dump()).UniqueNames()[0], "Head");
  EXPECT_EQ(MustLoad(root.dump()).UniqueNames()[1], "Head#1");
  root.erase("scene");
  EXPECT_EQ(MustLoad(root.dump()).MeshNodes(), (std::vector<Index>{3}));
  root.erase("scenes");
  c = MustLoad(root.dump());
  EXPECT_EQ(c.scene_roots, (std::vector<Index>{0, 2, 3, 4, 5}));
  EXPECT_EQ(c.MeshNodes(), (std::vector<Index>{0, 3, 4}));
}

// KHR_node_visibility: hidden nodes hide all that is below them, also what says otherwise.
TEST(GltfImport, HiddenNodes) {
  GltfBuilder builder;
  const json hidden = {{"KHR_node_visibility", {{"visible", false}}}},
             shown = {{"KHR_node_visibility", {{"visible", true}}}},
             silent = {{"KHR_node_visibility", json::object()}};
  builder.Push("nodes", {{"extensions", hidden}, {"children", {1}}});
  builder.Push("nodes", {{"extensions", shown}, {"children", {2}}});
  builder.Push("nodes", {{"name", "below"}});
  builder.Push("nodes", {{"extensions", shown}});
  builder.Push("nodes", {{"extensions", silent}});
  builder.root["extensionsRequired"] = {"KHR_node_visibility"};
  const Character c = MustLoad(builder.Text());
  ASSERT_EQ(c.nodes.size(), 5u);
  const bool visible[] = {false, false, false, true, true};
  for (std::size_t i = 0; i < 5; ++i) EXPECT_EQ(c.nodes[i].visible, visible[i]) << i;

  builder.root["nodes"][3]["extensions"]["KHR_node_visibility"]["visible"] = 0;
  const Result<Character> wrong = Load(builder.Text(), "/nonexistent");
  ASSERT_FALSE(wrong.ok());
  EXPECT_NE(wrong.status().ToString().find("nodes[3].extensions.KHR_node_visibility.visible"),
            std::string::npos)
      << wrong.status().ToString();
}

TEST(GltfImport, PrimitiveModes) {
  const std::map<int, std::vector<Index>> triangles = {{0, {}},
                                                       {1, {}},
                                                       {3, {}},
                                                       {4, {0, 1, 2}},
                                                       {5, {0, 1, 2, 1, 3, 2, 2, 3, 4}},
                                                       {6, {1, 2, 0, 2, 3, 0, 3, 4, 0}}};
  for (const auto& [mode, expected] : triangles) {
    GltfBuilder b;
    const int position = b.Accessor(std::vector<float>(15, 1.f), "VEC3");
    const json attributes = {{"POSITION", position}};
    b.Push("meshes", {{"primitives", {{{"attributes", attributes}, {"mode", mode}}}}});
    const int indices = b.Accessor<std::uint8_t>({0, 1, 2, 3, 4}, "SCALAR");
    b.root["meshes"][0]["primitives"].push_back(
        {{"attributes", attributes}, {"mode", mode}, {"indices", indices}});
    b.root["meshes"][0]["primitives"].push_back({{"attributes", json::object()}});
    const Character c = MustLoad(b.Text());
    const Mesh& mesh = c.meshes.at(0);
    EXPECT_EQ(mesh.vertex_count(), 10u);  // shared accessors give vertices to each primitive
    EXPECT_EQ(mesh.primitives.at(0).triangles, expected) << mode;
    std::vector<Index> moved = expected;
    for (Index& index : moved) index += 5;
    EXPECT_EQ(mesh.primitives.at(1).triangles, moved) << mode;
    EXPECT_EQ(mesh.primitives.at(2).vertex_count, 0u);
  }
}

TEST(GltfImport, InterleavedViewsAndOffsets) {
  GltfBuilder b;
  // x y z and a normal, interleaved behind 8 bytes that belong to nobody
  const int view = b.View<float>({9, 9, 1, 2, 3, 0, 0, 1, 4, 5, 6, 0, 0, 1}, 24);
  b.Push("accessors",
         {{"bufferView", view}, {"byteOffset", 8}, {"componentType", 5126}, {"type", "VEC3"}, {"count", 2}});
  b = WithPrimitive(b, {{"attributes", {{"POSITION", 0}}}});
  EXPECT_EQ(MustLoad(b.Text()).meshes.at(0).positions, (std::vector<float>{1, 2, 3, 4, 5, 6}));
}

TEST(GltfImport, SparseAccessors) {
  GltfBuilder b;
  const int base = b.Accessor<float>({0, 0, 0, 1, 1, 1, 2, 2, 2}, "VEC3");
  const auto sparse = [&](const std::vector<std::uint16_t>& at, const std::vector<float>& values) -> json {
    return {{"count", at.size()},
            {"indices", {{"bufferView", b.View(at)}, {"componentType", 5123}}},
            {"values", {{"bufferView", b.View(values)}}}};
  };
  b.root["accessors"][static_cast<std::size_t>(base)]["sparse"] = sparse({1}, {7, 8, 9});
  const json no_base = {{"componentType", 5126},
                        {"type", "VEC3"},
                        {"count", 3},
                        {"sparse", sparse({0, 2}, {0, 0, 0, 1, 2, 3})}};
  const int target = b.Push("accessors", no_base);
  const int zeros = b.Push("accessors", {{"componentType", 5126}, {"type", "VEC3"}, {"count", 3}});
  const int indices = b.Push(
      "accessors", {{"componentType", 5123},
                    {"type", "SCALAR"},
                    {"count", 3},
                    {"sparse",
                     {{"count", 1},
                      {"indices", {{"bufferView", b.View<std::uint8_t>({1})}, {"componentType", 5121}}},
                      {"values", {{"bufferView", b.View<std::uint16_t>({2})}}}}}});
  b = WithPrimitive(
      b, {{"attributes", {{"POSITION", base}}},
          {"indices", indices},
          {"targets",
           {{{"POSITION", target}}, {{"POSITION", zeros}}, {{"NORMAL", zeros}}, {{"POSITION", base}}}}});
  const Character c = MustLoad(b.Text());
  const Mesh& mesh = c.meshes.at(0);
  EXPECT_EQ(mesh.positions, (std::vector<float>{0, 0, 0, 7, 8, 9, 2, 2, 2}));
  EXPECT_EQ(mesh.primitives[0].triangles, (std::vector<Index>{0, 2, 0}));
  ASSERT_EQ(mesh.targets.size(), 4u);
  EXPECT_EQ(mesh.targets[0].vertices, (std::vector<Index>{2}));  // the stored zero is dropped
  EXPECT_EQ(mesh.targets[0].deltas, (std::vector<float>{1, 2, 3}));
  EXPECT_TRUE(mesh.targets[1].vertices.empty());
  EXPECT_TRUE(mesh.targets[2].vertices.empty());
  EXPECT_EQ(mesh.targets[3].vertices, (std::vector<Index>{1, 2}));
  EXPECT_EQ(mesh.targets[3].deltas, (std::vector<float>{7, 8, 9, 2, 2, 2}));
  EXPECT_EQ(mesh.weights, (std::vector<double>(4, 0.0)));
}

TEST(GltfImport, QuantizedPositions) {
  for (const bool normalized : {false, true}) {
    GltfBuilder b;
    const int position = b.Push("accessors", {{"bufferView", b.View<std::int16_t>({-32768, 0, 32767, 0}, 8)},
                                              {"componentType", 5122},
                                              {"type", "VEC3"},
                                              {"count", 1},
                                              {"normalized", normalized}});
    const int delta = b.Push("accessors", {{"bufferView", b.View<std::int8_t>({-128, 0, 127, 0}, 4)},
                                           {"componentType", 5120},
                                           {"type", "VEC3"},
                                           {"count", 1},
                                           {"normalized", normalized}});
    b.root["extensionsRequired"] = {"KHR_mesh_quantization"};
    b = WithPrimitive(b, {{"attributes", {{"POSITION", position}}}, {"targets", {{{"POSITION", delta}}}}});
    const Character c = MustLoad(b.Text());
    const float p = normalized ? 1.f : 32767.f, d = normalized ? 1.f : 127.f;
    EXPECT_EQ(c.meshes.at(0).positions, (std::vector<float>{normalized ? -1.f : -32768.f, 0, p}));
    EXPECT_EQ(c.meshes[0].targets.at(0).deltas, (std::vector<float>{normalized ? -1.f : -128.f, 0, d}));
  }
}

TEST(GltfImport, TextureCoordinates) {
  GltfBuilder b;
  const int position = b.Accessor<float>({0, 0, 0, 1, 0, 0, 0, 1, 0}, "VEC3");
  const json plain = {{"attributes", {{"POSITION", position}}}};
  const auto with = [&](int uvs) {
    return json{{"attributes", {{"POSITION", position}, {"TEXCOORD_0", uvs}}}};
  };
  const int floats = b.Accessor<float>({0, 0, 1, 0, 0.5f, 2}, "VEC2");
  const int bytes = b.Accessor<std::uint16_t>({0, 0, 65535, 0, 0, 65535}, "VEC2", true);
  const int few = b.Accessor<float>({0, 0, 1, 0}, "VEC2");
  b.Push("meshes", {{"primitives", {plain, with(floats), plain, with(bytes)}}});
  b.Push("meshes", {{"primitives", {plain}}});
  b.Push("nodes", {{"mesh", 0}});
  const Character c = MustLoad(b.Text());
  const std::vector<float>& uvs = c.meshes.at(0).uvs;
  ASSERT_EQ(uvs.size(), 24u);
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_TRUE(std::isnan(uvs[i]) && std::isnan(uvs[12 + i])) << i;  // primitives without any
  }
  EXPECT_EQ(std::vector<float>(uvs.begin() + 6, uvs.begin() + 12), (std::vector<float>{0, 0, 1, 0, 0.5f, 2}));
  EXPECT_EQ(std::vector<float>(uvs.begin() + 18, uvs.end()), (std::vector<float>{0, 0, 1, 0, 0, 1}));
  EXPECT_TRUE(c.meshes.at(1).uvs.empty());
  b.root["meshes"][1]["primitives"][0] = with(few);
  const Result<Character> refused = Load(b.Text(), "/nonexistent");
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.status().ToString().find("TEXCOORD_0 (accessors[3]) has 2 elements, POSITION has 3"),
            std::string::npos)
      << refused.status().ToString();
}

TEST(GltfImport, InfluencesOfAnySetAndType) {
  GltfBuilder b;
  const int position = b.Accessor(std::vector<float>(6, 0.f), "VEC3");
  json attributes = {{"POSITION", position}};
  // Twelve influences in three sets of three types; one joint occurs in two sets
  attributes["JOINTS_0"] = b.Accessor<std::uint8_t>({0, 1, 2, 3, 4, 9, 9, 9}, "VEC4");
  attributes["WEIGHTS_0"] = b.Accessor<std::uint8_t>({51, 51, 0, 0, 0, 0, 0, 0}, "VEC4", true);
  attributes["JOINTS_1"] = b.Accessor<std::uint16_t>({4, 1, 0, 0, 0, 0, 0, 0}, "VEC4");
  attributes["WEIGHTS_1"] = b.Accessor<std::uint16_t>({13107, 13107, 0, 0, 0, 0, 0, 0}, "VEC4", true);
  attributes["JOINTS_2"] = b.Accessor<std::uint8_t>({4, 0, 0, 0, 0, 0, 0, 0}, "VEC4");
  attributes["WEIGHTS_2"] = b.Accessor<float>({0.2f, 0, 0, 0, -1e-9f, 0, 0, 0}, "VEC4");
  b = WithPrimitive(b, {{"attributes", attributes}});
  b.Push("skins", {{"joints", {1, 2, 1, 2, 1}}});
  b.Push("nodes", {{"name", "a"}});
  b.Push("nodes", {{"name", "b"}});
  b.root["nodes"][0]["skin"] = 0;
  const Character c = MustLoad(b.Text());
  const auto rows = c.meshes.at(0).influence_rows();
  ASSERT_EQ(rows.rows(), 2u);
  ASSERT_EQ(rows.row(0).size(), 3u);
  EXPECT_EQ(rows.row(0)[1].joint, 1u);
  EXPECT_NEAR(rows.row(0)[0].weight, 0.2, 1e-6);
  EXPECT_NEAR(rows.row(0)[1].weight, 0.4, 1e-6);
  EXPECT_NEAR(rows.row(0)[2].weight, 0.4, 1e-6);
  ASSERT_EQ(rows.row(1).size(), 1u);  // no weight at all: the first slot's joint
  EXPECT_EQ(rows.row(1)[0].joint, 4u);
  EXPECT_EQ(rows.row(1)[0].weight, 1.f);
  EXPECT_EQ(c.skins.at(0).inverse_bind_matrices.size(), 5u);  // absent: identities
  EXPECT_EQ(c.skins[0].inverse_bind_matrices[4], Matrix4());
}

TEST(GltfImport, MeshUnderSeveralNodesWithTheirWeights) {
  GltfBuilder b = GltfBuilder::Character();
  b.Push("nodes", {{"name", "twin"}, {"mesh", 0}, {"weights", {0.25}}});
  b.root["scenes"][0]["nodes"].push_back(4);
  const Character c = MustLoad(b.Text());
  EXPECT_EQ(c.MeshNodes(), (std::vector<Index>{0, 4}));
  EXPECT_TRUE(c.nodes[0].weights.empty());
  const auto points = gltf_reference::Points(c, gltf_reference::Evaluate(c, nullptr, 0), 4);
  EXPECT_EQ(points[1], (Double3{1, 0, 0.5}));  // unskinned: the node's own transform
}

TEST(GltfImport, AnimationsOfAllKinds) {
  GltfBuilder b;
  b.Push("nodes", {{"name", "n"}});
  const int one = b.Accessor<float>({0.5f}, "SCALAR"), two = b.Accessor<float>({0.5f, 1.5f}, "SCALAR");
  const int point = b.Accessor<float>({1, 2, 3}, "VEC3");
  const int turns = b.Accessor<std::int16_t>({0, 0, 0, 32767, 0, 0, 32767, 0}, "VEC4", true);
  const int cubic = b.Accessor<float>({0, 0, 0, 1, 1, 1, 2, 0, 0, 0, 0, 0, 3, 1, 1, 0, 0, 0}, "VEC3");
  b.Push("animations", {{"samplers",
                         {{{"input", one}, {"output", point}},
                          {{"input", two}, {"output", turns}},
                          {{"input", two}, {"output", cubic}, {"interpolation", "CUBICSPLINE"}}}},
                        {"channels",
                         {{{"sampler", 0}, {"target", {{"node", 0}, {"path", "translation"}}}},
                          {{"sampler", 0}, {"target", {{"path", "pointer"}}}},
                          {{"sampler", 1}, {"target", {{"node", 0}, {"path", "rotation"}}}},
                          {{"sampler", 2}, {"target", {{"node", 0}, {"path", "scale"}}}}}}});
  const Character c = MustLoad(b.Text());
  const Clip& clip = c.clips.at(0);
  EXPECT_EQ(clip.name, "");
  EXPECT_EQ(clip.id, "anim0");
  EXPECT_EQ(clip.duration, 1.5);
  ASSERT_EQ(clip.channels.size(), 3u);
  EXPECT_EQ(c.warnings.size(), 1u);
  const auto close = [](std::vector<double> a, const std::vector<double>& e) {
    for (std::size_t i = 0; i < e.size(); ++i) EXPECT_NEAR(a[i], e[i], 1e-12);
  };
  close(gltf_reference::Sample(clip.channels[0], 99), {1, 2, 3});
  close(gltf_reference::Sample(clip.channels[1], 1), {0, 0, std::sqrt(0.5), std::sqrt(0.5)});
  // Hermite at t = 0.5: half of both values and an eighth of the out-tangent 2
  close(gltf_reference::Sample(clip.channels[2], 1), {0.5 + 1.5 + 2 / 8.0, 1, 1});
}

json PointerTarget(const std::string& pointer) {
  return {{"path", "pointer"}, {"extensions", {{"KHR_animation_pointer", {{"pointer", pointer}}}}}};
}

TEST(GltfImport, AnimationPointersToNodes) {
  GltfBuilder plain = GltfBuilder::Character(), pointed = plain;
  std::size_t channels = 0;
  for (json& animation : pointed.root["animations"]) {
    for (json& channel : animation["channels"]) {
      json& target = channel["target"];
      target = PointerTarget(
          fmt::format("/nodes/{}/{}", target["node"].get<int>(), target["path"].get<std::string>()));
      ++channels;
    }
  }
  ASSERT_GE(channels, 2u);
  pointed.root["extensionsUsed"] = pointed.root["extensionsRequired"] = {"KHR_animation_pointer"};
  const Character a = MustLoad(plain.Text()), b = MustLoad(pointed.Text());
  EXPECT_EQ(b.warnings, a.warnings);
  ASSERT_EQ(a.clips.size(), b.clips.size());
  for (std::size_t c = 0; c < a.clips.size(); ++c) {
    ASSERT_EQ(a.clips[c].channels.size(), b.clips[c].channels.size());
    for (std::size_t i = 0; i < a.clips[c].channels.size(); ++i) {
      const Channel &one = a.clips[c].channels[i], &other = b.clips[c].channels[i];
      EXPECT_EQ(one.node, other.node);
      EXPECT_EQ(one.path, other.path);
      EXPECT_EQ(one.values, other.values);
    }
  }
  // What cannot be read moves nothing, and is said
  json& all = pointed.root["animations"][0]["channels"];
  const std::size_t before = b.clips[0].channels.size();
  for (const char* other :
       {"/materials/0/pbrMetallicRoughness/baseColorFactor", "/nodes/0/weights/0", "/nodes/0", "/"}) {
    all.push_back({{"sampler", 0}, {"target", PointerTarget(other)}});
  }
  const Character c = MustLoad(pointed.Text());
  EXPECT_EQ(c.clips[0].channels.size(), before);
  ASSERT_EQ(c.warnings.size(), a.warnings.size() + 1);
  EXPECT_EQ(
      c.warnings[0],
      "animations[0] animates \"/materials/0/pbrMetallicRoughness/baseColorFactor\" and 3 more by pointers, "
      "which is not supported; ignored");
}

TEST(GltfImport, BuffersBesideTheDocument) {
  const TemporaryFolder folder;
  GltfBuilder b;
  const int position = b.Accessor<float>({1, 2, 3}, "VEC3");
  b = WithPrimitive(b, {{"attributes", {{"POSITION", position}}}});
  const std::string data(b.buffer.begin(), b.buffer.end());
  folder.Write("sub dir/\xc3\xa4%1.bin", data + "trailing bytes are legal");
  for (const char* uri :
       {"sub%20dir/%C3%A4%251.bin", "sub dir/\xc3\xa4%251.bin", "./sub%20dir/../sub%20dir/%c3%a4%251.bin"}) {
    b.root["buffers"] = {{{"uri", uri}, {"byteLength", 12}}};
    const Result<Character> c = LoadGltf(folder.Write("c.gltf", b.Text()));
    ASSERT_TRUE(c.ok()) << c.status().ToString();
    EXPECT_EQ(c->meshes.at(0).positions, (std::vector<float>{1, 2, 3}));
  }
  // Data URIs of any media type, and without base64; a second buffer in a .glb
  for (const std::string& uri :
       {"data:;base64," + b.Base64(), "DATA:;base64," + b.Base64(),
        "data:application/gltf-buffer;base64," + b.Base64(),
        std::string("data:application/octet-stream,%00%00%80%3F%00%00%00%40%00%00%40%40")}) {
    b.root["buffers"] = {{{"uri", uri}, {"byteLength", 12}}};
    EXPECT_EQ(MustLoad(b.Text()).meshes.at(0).positions, (std::vector<float>{1, 2, 3})) << uri;
  }
  b.root["buffers"] = {{{"byteLength", 12}}, {{"uri", "data:;base64," + b.Base64()}, {"byteLength", 12}}};
  b.root["bufferViews"][0]["buffer"] = 1;
  EXPECT_EQ(MustLoad(b.Glb()).meshes.at(0).positions, (std::vector<float>{1, 2, 3}));
}

TEST(GltfImport, DeepHierarchiesAreNoProblem) {
  json nodes = json::array();
  constexpr int kDepth = 100000;
  for (int i = 0; i < kDepth; ++i) {
    nodes.push_back({{"translation", {1, 0, 0}}});
    if (i + 1 < kDepth) nodes.back()["children"] = {i + 1};
  }
  const Character c = MustLoad(json{{"asset", {{"version", "2.0"}}}, {"nodes", nodes}}.dump());
  ASSERT_EQ(c.order.size(), std::size_t{kDepth});
  EXPECT_TRUE(c.nodes.back().in_scene);
  EXPECT_EQ(gltf_reference::Evaluate(c, nullptr, 0).world.back()(0, 3), kDepth);
}

}  // namespace
}  // namespace kpsa::engine::gltf
