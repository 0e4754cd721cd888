// Documents that look odd and that glTF 2.0 allows: the program reads, inspects and evaluates them.
#include <fmt/format.h>

#include <functional>

#include "files/npz.h"
#include "tests/cli/refusals.h"
#include "tests/support/gltf_builder.h"

namespace kpsa::engine {
namespace {

using nlohmann::json;

class OddGltf : public RefusalTest {
 protected:
  // Evaluates a document at two times. Array `key`, if one is named, must hold these positions at the first
  // of them.
  Npz Evaluate(const GltfBuilder& builder,
               const std::vector<std::string>& more = {"--times", "0,0.5"}) const {
    folder.Write("c.gltf", builder.Text());
    ExpectGood({"inspect", "c.gltf"});
    ExpectGood({"validate", "c.gltf", "-q"});
    std::vector<std::string> words = {"eval", "c.gltf", "-o", "out.npz", "--force", "-q"};
    words.insert(words.end(), more.begin(), more.end());
    ExpectGood(words);
    Result<Npz> npz = ReadNpz(folder / "out.npz");
    EXPECT_TRUE(npz.ok()) << npz.status().ToString();
    return npz.ok() ? std::move(*npz) : Npz();
  }
  static std::vector<float> Frame(const Npz& npz, const std::string& key, std::size_t frame = 0) {
    const NpzArray* array = npz.Find(key);
    EXPECT_NE(array, nullptr) << key;
    if (array == nullptr || array->shape.size() != 3) return {};
    const std::vector<float> all = array->Floats();
    const auto size = static_cast<std::ptrdiff_t>(array->shape[1] * 3);
    return {all.begin() + static_cast<std::ptrdiff_t>(frame) * size,
            all.begin() + static_cast<std::ptrdiff_t>(frame + 1) * size};
  }
  static std::vector<std::string> Keys(const Npz& npz) {
    std::vector<std::string> keys;
    for (const NpzArray& array : npz.arrays) keys.push_back(array.name);
    std::sort(keys.begin(), keys.end());
    return keys;
  }
  using Keys_ = std::vector<std::string>;
  // A square of four vertices, an unskinned mesh on the node "square".
  static GltfBuilder Square(int mode, const std::vector<std::uint16_t>& indices) {
    GltfBuilder b;
    json primitive = {{"attributes", {{"POSITION", b.Accessor<float>(kSquare, "VEC3")}}}, {"mode", mode}};
    if (!indices.empty()) primitive["indices"] = b.Accessor(indices, "SCALAR");
    b.Push("meshes", {{"primitives", {primitive}}});
    b.Push("nodes", {{"name", "square"}, {"mesh", 0}});
    b.Push("scenes", {{"nodes", {0}}});
    return b;
  }
  std::uint64_t Triangles(const GltfBuilder& builder) const {
    folder.Write("c.gltf", builder.Text());
    std::string out;
    ExpectGood({"inspect", "c.gltf", "--json"}, &out);
    const json facts = json::parse(out, nullptr, false);
    if (facts.is_discarded() || !facts.contains("meshes") || facts["meshes"].empty()) return 999;
    return facts["meshes"][0].value("triangles", std::uint64_t{999});
  }
  static const std::vector<float> kSquare;
};
const std::vector<float> OddGltf::kSquare = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0};

TEST_F(OddGltf, HardlyAnything) {
  GltfBuilder b;
  EXPECT_EQ(Keys(Evaluate(b)), Keys_{"times"});
  b.Push("nodes", {{"name", "alone"}});  // no scene
  EXPECT_EQ(Keys(Evaluate(b)), Keys_{"times"});
  b.root["scenes"] = json::array({json::object()});  // an empty one
  EXPECT_EQ(Keys(Evaluate(b)), Keys_{"times"});
  b.Push("animations", {{"name", "still"}, {"channels", json::array()}, {"samplers", json::array()}});
  EXPECT_EQ(Keys(Evaluate(b)), Keys_{"times"});
  std::string out;
  ExpectGood({"get", "c.gltf", "alone.worldMatrix", "--times", "0"}, &out);
}

TEST_F(OddGltf, WithoutScenesAllRootsAreShown) {
  GltfBuilder b = GltfBuilder::Character();
  b.root.erase("scenes");
  b.root.erase("scene");
  EXPECT_EQ(Keys(Evaluate(b)), (Keys_{"body/0", "times"}));
  b.root["scenes"] = {{{"nodes", {1}}}};  // the mesh is in no scene
  EXPECT_EQ(Keys(Evaluate(b)), Keys_{"times"});
}

TEST_F(OddGltf, AMeshWithoutSkinUnderAJointFollowsIt) {
  GltfBuilder b = GltfBuilder::Character();
  b.root["nodes"].push_back({{"name", "hat"}, {"mesh", 1}});
  b.root["nodes"][2]["children"] = {4};
  b.Push("meshes",
         {{"primitives",
           {{{"attributes", {{"POSITION", b.Accessor<float>({1, 0, 0, 0, 1, 0, 0, 0, 1}, "VEC3")}}}}}}});
  const Npz npz = Evaluate(b, {"--times", "0,1"});
  EXPECT_EQ(Frame(npz, "hat/0"), (std::vector<float>{1, 1, 5, 0, 2, 5, 0, 1, 6}));  // tip stands at (0, 1, 5)
  const std::vector<float> turned = Frame(npz, "hat/0", 1);                         // by 180 degrees about Z
  const std::vector<float> expected = {-1, 1, 5, 0, 0, 5, 0, 1, 6};
  for (std::size_t i = 0; i < expected.size(); ++i) EXPECT_NEAR(turned[i], expected[i], 1e-6) << i;
}

TEST_F(OddGltf, SkinsWithoutWhatIsOptional) {
  GltfBuilder b = GltfBuilder::Character();
  const std::vector<float> plain = Frame(Evaluate(b), "body/0", 1);
  b.root["skins"][0].erase("skeleton");
  EXPECT_EQ(Frame(Evaluate(b), "body/0", 1), plain);
  b.root["skins"][0].erase("inverseBindMatrices");  // identities, as they are in the file
  EXPECT_EQ(Frame(Evaluate(b), "body/0", 1), plain);
  b.root["skins"][0]["skeleton"] = 3;  // a hint
  EXPECT_EQ(Frame(Evaluate(b), "body/0", 1), plain);
}

TEST_F(OddGltf, NormalizedWeights) {
  GltfBuilder b = GltfBuilder::Character();
  const std::vector<float> plain = Frame(Evaluate(b), "body/0", 1);
  b.root["meshes"][0]["primitives"][0]["attributes"]["WEIGHTS_0"] =
      b.Accessor<std::uint8_t>({64, 191, 0, 0, 255, 0, 0, 0, 255, 0, 0, 0}, "VEC4", true);
  std::vector<float> result = Frame(Evaluate(b), "body/0", 1);
  ASSERT_EQ(result.size(), plain.size());
  for (std::size_t i = 0; i < result.size(); ++i) EXPECT_NEAR(result[i], plain[i], 0.02) << i;
  b.root["meshes"][0]["primitives"][0]["attributes"]["WEIGHTS_0"] =
      b.Accessor<std::uint16_t>({16384, 49151, 0, 0, 65535, 0, 0, 0, 65535, 0, 0, 0}, "VEC4", true);
  result = Frame(Evaluate(b), "body/0", 1);
  ASSERT_EQ(result.size(), plain.size());
  for (std::size_t i = 0; i < result.size(); ++i) EXPECT_NEAR(result[i], plain[i], 1e-4) << i;
}

TEST_F(OddGltf, AccessorsOfAllShapes) {
  // Sparse on zeros: no bufferView of its own
  GltfBuilder b = Square(4, {0, 1, 2});
  const int indices = b.View<std::uint8_t>({1, 3}), values = b.View<float>({7, 8, 9, -1, -2, -3});
  b.root["accessors"][0].erase("bufferView");
  b.root["accessors"][0]["sparse"] = {{"count", 2},
                                      {"indices", {{"bufferView", indices}, {"componentType", 5121}}},
                                      {"values", {{"bufferView", values}}}};
  EXPECT_EQ(Frame(Evaluate(b), "square/0"), (std::vector<float>{0, 0, 0, 7, 8, 9, 0, 0, 0, -1, -2, -3}));
  // Interleaved: position and something else in one view
  GltfBuilder interleaved = Square(4, {0, 1, 2});
  std::vector<float> mixed;
  for (std::size_t v = 0; v < 4; ++v) {
    for (std::size_t i = 0; i < 3; ++i) mixed.push_back(kSquare[3 * v + i]);
    mixed.insert(mixed.end(), {99, 98});
  }
  interleaved.root["accessors"][0]["bufferView"] = interleaved.View(mixed, 20);
  EXPECT_EQ(Frame(Evaluate(interleaved), "square/0"), kSquare);
}

TEST_F(OddGltf, PercentEncodedNamesOfBuffers) {
  GltfBuilder b = Square(4, {0, 1, 2});
  folder.Write("a b%ü.bin", std::string(b.buffer.begin(), b.buffer.end()));
  b.root["buffers"] = {{{"byteLength", b.buffer.size()}, {"uri", "a%20b%25%C3%BC.bin"}}};
  EXPECT_EQ(Frame(Evaluate(b), "square/0"), kSquare);
  folder.Write("sub/x.bin", std::string(b.buffer.begin(), b.buffer.end()));
  b.root["buffers"][0]["uri"] = "./sub/../sub/x.bin";
  EXPECT_EQ(Frame(Evaluate(b), "square/0"), kSquare);
}

TEST_F(OddGltf, NamesThatAreSharedOrMissing) {
  GltfBuilder b = GltfBuilder::Character();
  b.root["nodes"][0]["name"] = "root";  // as its joint
  b.Push("nodes", {{"name", "twin"}, {"mesh", 0}, {"skin", 0}});
  b.Push("nodes", {{"name", "twin"}, {"mesh", 0}, {"skin", 0}});
  b.Push("nodes", {{"mesh", 0}, {"skin", 0}});
  b.root["scenes"][0]["nodes"] = {0, 1, 4, 5, 6};
  b.Push("animations", b.root["animations"][0]);  // the same name again
  b.root["animations"][1].erase("name");
  EXPECT_EQ(Keys(Evaluate(b)), (Keys_{"node6/0", "root/0", "times", "twin#4/0", "twin#5/0"}));
  EXPECT_EQ(Keys(Evaluate(b, {"--clip", "anim1", "--times", "0"})).size(), 5u);
}

TEST_F(OddGltf, ClipsOfOneKey) {
  for (const char* interpolation : {"LINEAR", "STEP", "CUBICSPLINE"}) {
    GltfBuilder b = GltfBuilder::Character();
    const bool cubic = std::string(interpolation) == "CUBICSPLINE";
    const int time = b.Accessor<float>({0.25f}, "SCALAR");
    const int turn = b.Accessor<float>(
        cubic ? std::vector<float>{0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0} : std::vector<float>{0, 0, 1, 0},
        "VEC4");
    b.root["animations"][0]["samplers"][0] = {
        {"input", time}, {"output", turn}, {"interpolation", interpolation}};
    const Npz npz = Evaluate(b, {"--times", "0,0.25,9"});
    EXPECT_EQ(Frame(npz, "body/0", 1), Frame(npz, "body/0", 0)) << interpolation;
    // Vertex 1 follows the tip alone, which is turned about Z by 180 degrees; the morph adds at 9 s
    EXPECT_NEAR(Frame(npz, "body/0", 2)[3], -1, 1e-6) << interpolation;
    ExpectGood({"eval", "c.gltf", "-o", "whole.npz", "--force", "-q"});
  }
}

TEST_F(OddGltf, Primitives) {
  EXPECT_EQ(Triangles(Square(4, {0, 1, 2, 2, 1, 3})), 2u);
  EXPECT_EQ(Triangles(Square(4, {})), 1u);  // not indexed: vertex 3 is left over
  EXPECT_EQ(Triangles(Square(5, {})), 2u);
  EXPECT_EQ(Triangles(Square(5, {0, 1, 2, 3})), 2u);
  EXPECT_EQ(Triangles(Square(6, {0, 1, 3, 2})), 2u);
  EXPECT_EQ(Triangles(Square(6, {})), 2u);
  EXPECT_EQ(Triangles(Square(4, {0, 0, 1, 1, 1, 1, 0, 1, 2})), 3u);  // without area, but there
  for (int mode = 0; mode <= 6; ++mode) {
    SCOPED_TRACE(mode);
    for (const bool indexed : {false, true}) {
      const GltfBuilder b =
          Square(mode, indexed ? std::vector<std::uint16_t>{0, 1, 2, 3} : std::vector<std::uint16_t>{});
      EXPECT_EQ(Frame(Evaluate(b), "square/0"), kSquare);
      // Points and lines have no surface, and deformers live with that
      folder.Write("t.yaml",
                   "kpsa: 1\ncharacter: c.gltf\nnodes: {mush: {type: deltaMush, pinBorderVertices: off}, "
                   "cage: {type: lattice}}\n"
                   "deform: [{meshes: [square], stack: [gltf, cage, mush]}]\n");
      ExpectGood({"eval", "t.yaml", "--times", "0", "-o", "rig.npz", "--force", "-q"});
      ExpectGood({"render", "t.yaml", "-o", "rig.png", "--force", "-q", "--size", "32x32"});
    }
  }
}

TEST_F(OddGltf, SurfacesWithoutArea) {
  for (const std::vector<std::uint16_t>& indices :
       {std::vector<std::uint16_t>{0, 0, 0}, std::vector<std::uint16_t>{0, 1, 1, 2, 2, 3}}) {
    EXPECT_EQ(Frame(Evaluate(Square(4, indices)), "square/0"), kSquare);
  }
  GltfBuilder b = Square(4, {0, 1, 2, 1, 3, 2});
  for (std::size_t i = 0; i < 48; ++i) b.buffer[i] = 0;  // all vertices at the origin: one point
  EXPECT_EQ(Frame(Evaluate(b), "square/0"), std::vector<float>(12, 0.0f));
  folder.Write("t.yaml",
               "kpsa: 1\ncharacter: c.gltf\nnodes: {mush: {type: deltaMush}, cage: {type: lattice}}\n"
               "deform: [{meshes: [square], stack: [gltf, cage, mush]}]\n");
  ExpectGood({"eval", "t.yaml", "--times", "0", "-o", "rig.npz", "--force", "-q"});
}

TEST_F(OddGltf, UnusedParts) {
  GltfBuilder b = GltfBuilder::Character();
  b.root["cameras"] = {{{"type", "perspective"}, {"perspective", {{"yfov", 1}, {"znear", 0.1}}}}};
  b.root["images"] = {{{"uri", "none.png"}}};
  b.root["textures"] = {{{"source", 0}}};
  b.root["extensionsUsed"] = {"VENDOR_magic"};
  b.root["nodes"][0]["extensions"] = {{"VENDOR_magic", {{"a", 1}}}};
  b.root["nodes"][0]["extras"] = {{"anything", {1, "x", nullptr}}};
  b.Push("meshes", {{"primitives", {{{"attributes", {{"POSITION", 0}}}}}}});  // no node has it
  b.Push("skins", {{"joints", {1}}});
  EXPECT_EQ(Keys(Evaluate(b)), (Keys_{"body/0", "times"}));
}

// A hidden mesh is evaluated where somebody asks for it by name, or where there is no other.
TEST_F(OddGltf, HiddenMeshesAreNoOutputs) {
  GltfBuilder b = Square(4, {0, 1, 2});
  b.Push("nodes", {{"name", "helper"}, {"mesh", 0}, {"translation", {1, 0, 0}}});
  b.root["scenes"][0]["nodes"] = {0, 1};
  EXPECT_EQ(Keys(Evaluate(b)), (Keys_{"helper/0", "square/0", "times"}));
  const json hidden = {{"KHR_node_visibility", {{"visible", false}}}};
  b.root["nodes"][1]["extensions"] = hidden;
  EXPECT_EQ(Keys(Evaluate(b)), (Keys_{"square/0", "times"}));
  std::string out;
  ExpectGood({"compile", "c.gltf", "--want", "helper"}, &out);
  EXPECT_NE(out.find("helper"), std::string::npos) << out;
  ExpectGood({"render", "c.gltf", "-o", "c.png", "--size", "60x60", "-q"});
  GltfBuilder alone = Square(4, {0, 1, 2});
  folder.Write("alone.gltf", alone.Text());
  ExpectGood({"render", "alone.gltf", "-o", "alone.png", "--size", "60x60", "-q"});
  EXPECT_EQ(TemporaryFolder::Read(folder / "c.png"), TemporaryFolder::Read(folder / "alone.png"));
  ExpectGood({"eval", "c.gltf", "-o", "out.usda", "-q"});
  EXPECT_EQ(TemporaryFolder::Read(folder / "out.usda").find("helper"), std::string::npos);
  b.root["nodes"][0]["extensions"] = hidden;
  EXPECT_EQ(Keys(Evaluate(b)), (Keys_{"helper/0", "square/0", "times"}));
}

}  // namespace
}  // namespace kpsa::engine
