// Damaged and malicious documents: one clear error each, never a crash, a hang or a huge allocation.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <ctime>
#include <functional>
#include <limits>
#include <random>

#include "gltf/import.h"
#include "tests/support/gltf_builder.h"
#include "tests/support/temporary_folder.h"

namespace kpsa::engine::gltf {
namespace {

using nlohmann::json;

Result<Character> Load(const std::string& bytes) {
  return LoadGltfFromMemory({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()},
                            "/nonexistent", "bad.gltf");
}

void ExpectError(const std::string& bytes, const std::string& part) {
  const Result<Character> c = Load(bytes);
  ASSERT_FALSE(c.ok()) << "accepted, expected: " << part;
  ASSERT_EQ(c.status().errors().size(), 1u);
  const Error& error = c.status().errors()[0];
  EXPECT_EQ(error.where.file, "bad.gltf");
  EXPECT_EQ(error.kind, ErrorKind::kInvalidInput);
  EXPECT_NE(error.message.find(part), std::string::npos) << error.message;
  EXPECT_EQ(error.message.find('\n'), std::string::npos) << error.message;
}

struct Damage {
  const char* message;
  std::function<void(GltfBuilder&)> apply;
};

void SetFloat(GltfBuilder& b, int accessor, std::size_t number, float value) {
  const json& view =
      b.root["bufferViews"]
            [b.root["accessors"][static_cast<std::size_t>(accessor)]["bufferView"].get<std::size_t>()];
  std::memcpy(&b.buffer[view["byteOffset"].get<std::size_t>() + 4 * number], &value, 4);
}

// Accessors of GltfBuilder::Character
enum { kPosition, kJoints, kWeights, kIndices, kDelta, kMatrices, kTimes, kTurn, kMorph };
constexpr float kNan = std::numeric_limits<float>::quiet_NaN(),
                kInfinity = std::numeric_limits<float>::infinity();

TEST(GltfHostile, DamagedStructure) {
  const std::vector<Damage> damages = {
      {"asset is missing", [](GltfBuilder& b) { b.root.erase("asset"); }},
      {"asset.version is \"1.0\"", [](GltfBuilder& b) { b.root["asset"]["version"] = "1.0"; }},
      {"asset.version is 2.0, expected text", [](GltfBuilder& b) { b.root["asset"]["version"] = 2.0; }},
      {"minVersion", [](GltfBuilder& b) { b.root["asset"]["minVersion"] = "2.1"; }},
      {"nodes is an object", [](GltfBuilder& b) { b.root["nodes"] = json::object(); }},
      {"nodes[1] is 3", [](GltfBuilder& b) { b.root["nodes"][1] = 3; }},
      {"nodes[0].mesh is 1, expected an index below 1",
       [](GltfBuilder& b) { b.root["nodes"][0]["mesh"] = 1; }},
      {"nodes[0].mesh is -1", [](GltfBuilder& b) { b.root["nodes"][0]["mesh"] = -1; }},
      {"nodes[0].mesh is 4294967296", [](GltfBuilder& b) { b.root["nodes"][0]["mesh"] = 4294967296; }},
      {"nodes[0].mesh is 0.0", [](GltfBuilder& b) { b.root["nodes"][0]["mesh"] = 0.0; }},
      {"nodes[0].mesh is null", [](GltfBuilder& b) { b.root["nodes"][0]["mesh"] = nullptr; }},
      {"nodes[0].skin is 9", [](GltfBuilder& b) { b.root["nodes"][0]["skin"] = 9; }},
      {"nodes[1].children[0] is 77", [](GltfBuilder& b) { b.root["nodes"][1]["children"] = {77}; }},
      {"nodes[2].rotation must be an array of 4",
       [](GltfBuilder& b) {
         b.root["nodes"][2]["rotation"] = {0, 0, 1};
       }},
      {"nodes[3].matrix must be", [](GltfBuilder& b) { b.root["nodes"][3]["matrix"][3] = "x"; }},
      {"has a cycle", [](GltfBuilder& b) { b.root["nodes"][2]["children"] = {1}; }},
      {"has a cycle", [](GltfBuilder& b) { b.root["nodes"][0]["children"] = {0}; }},
      {"a node has one parent", [](GltfBuilder& b) { b.root["nodes"][0]["children"] = {3}; }},
      {"a node has one parent",
       [](GltfBuilder& b) {
         b.root["nodes"][1]["children"] = {3, 3};
       }},
      {"nodes[0].weights has 2",
       [](GltfBuilder& b) {
         b.root["nodes"][0]["weights"] = {0, 1};
       }},
      {"meshes[0].weights has 2",
       [](GltfBuilder& b) {
         b.root["meshes"][0]["weights"] = {0, 1};
       }},
      {"meshes[0].primitives is missing", [](GltfBuilder& b) { b.root["meshes"][0].erase("primitives"); }},
      {"attributes.POSITION is 99",
       [](GltfBuilder& b) { b.root["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = 99; }},
      {"attributes is missing",
       [](GltfBuilder& b) { b.root["meshes"][0]["primitives"][0].erase("attributes"); }},
      {"mode is 7", [](GltfBuilder& b) { b.root["meshes"][0]["primitives"][0]["mode"] = 7; }},
      {"must have a WEIGHTS_n",
       [](GltfBuilder& b) { b.root["meshes"][0]["primitives"][0]["attributes"].erase("WEIGHTS_0"); }},
      {"has 1 morph targets, primitives[0] has 0",
       [](GltfBuilder& b) {
         json& p = b.root["meshes"][0]["primitives"];
         p.push_back(p[0]);
         p[0].erase("targets");
         b.root["meshes"][0].erase("weights");
       }},
      {"scene is 1", [](GltfBuilder& b) { b.root["scene"] = 1; }},
      {"scenes[0].nodes[0] is 4", [](GltfBuilder& b) { b.root["scenes"][0]["nodes"] = {4}; }},
      {"skins[0].joints[1] is 4",
       [](GltfBuilder& b) {
         b.root["skins"][0]["joints"] = {1, 4};
       }},
      {"has 2 matrices for 3 joints",
       [](GltfBuilder& b) {
         b.root["skins"][0]["joints"] = {1, 2, 3};
       }},
      {"follows joint 1, but skins[0] of nodes[0] has 1",
       [](GltfBuilder& b) { b.root["skins"][0]["joints"] = {1}; }},
      {"VENDOR_magic", [](GltfBuilder& b) { b.root["extensionsRequired"] = {"VENDOR_magic"}; }},
      {"export the file without compression",
       [](GltfBuilder& b) { b.root["extensionsRequired"] = {"VENDOR_meshopt_compression"}; }},
      {"extensionsRequired", [](GltfBuilder& b) { b.root["extensionsRequired"] = {3}; }},
      {"KHR_draco_mesh_compression.attributes is missing",
       [](GltfBuilder& b) {
         b.root["accessors"][kPosition].erase("bufferView");
         b.root["meshes"][0]["primitives"][0]["extensions"] = {
             {"KHR_draco_mesh_compression", {{"bufferView", 0}}}};
       }},
      {"KHR_draco_mesh_compression does not begin as Draco data do",
       [](GltfBuilder& b) {
         b.root["meshes"][0]["primitives"][0]["extensions"] = {
             {"KHR_draco_mesh_compression", {{"bufferView", 0}, {"attributes", {{"POSITION", 0}}}}}};
       }},
      {"EXT_meshopt_compression.count is missing",
       [](GltfBuilder& b) {
         b.root["bufferViews"][0]["extensions"] = {
             {"EXT_meshopt_compression", {{"buffer", 0}, {"byteLength", 36}, {"byteStride", 12}}}};
         b.root["buffers"] = {{{"byteLength", 4}}};
       }},
      {"buffers[0] has no data",
       [](GltfBuilder& b) {
         b.root["buffers"] = {{{"byteLength", 4}}};
       }},
  };
  for (const Damage& damage : damages) {
    GltfBuilder b = GltfBuilder::Character();
    damage.apply(b);
    SCOPED_TRACE(damage.message);
    ExpectError(b.Text(), damage.message);
  }
}

TEST(GltfHostile, AnimationPointers) {
  const auto error = [](const json& target, const std::string& part) {
    GltfBuilder b = GltfBuilder::Character();
    b.root["animations"][0]["channels"][0]["target"] = target;
    ExpectError(b.Text(), part);
  };
  const auto to = [](const json& pointer) {
    return json{{"path", "pointer"}, {"extensions", {{"KHR_animation_pointer", {{"pointer", pointer}}}}}};
  };
  const std::string none = "names no node: there are 4";
  for (const char* pointer :
       {"/nodes/4/translation", "/nodes/-1/translation", "/nodes/00/translation", "/nodes//translation",
        "/nodes/1 /translation", "/nodes/+1/translation", "/nodes/99999999999999999999/translation",
        "/nodes/0x1/scale", "/nodes/a\n/scale"})
    error(to(pointer), none);
  error(to("/nodes/" + std::string(1 << 20, '9') + "/scale"), none);
  error(to(""), "must start with /");
  error(to("nodes/0/translation"), "must start with /");
  error(to("/nodes/0/~2"), "a ~ that is neither");
  error(to("/nodes/0/scale~"), "a ~ that is neither");
  const std::string missing = "extensions.KHR_animation_pointer.pointer must be text";
  for (const json& pointer : {json(), json(3), json::array({"/nodes/0/scale"})}) error(to(pointer), missing);
  error({{"path", "pointer"}, {"extensions", {{"KHR_animation_pointer", "/nodes/0/scale"}}}}, missing);
  json both = to("/nodes/1/translation");
  both["node"] = 1;
  error(both, "has a node beside the pointer");
  error(to("/nodes/3/translation"), "which has a matrix");
}

TEST(GltfHostile, DamagedAccessors) {
  const auto accessor = [](GltfBuilder& b, int i) -> json& {
    return b.root["accessors"][static_cast<std::size_t>(i)];
  };
  const std::vector<Damage> damages = {
      {"accessors[0].count is -3", [&](GltfBuilder& b) { accessor(b, kPosition)["count"] = -3; }},
      {"the most is", [&](GltfBuilder& b) { accessor(b, kPosition)["count"] = 9007199254740992; }},
      {"accessors[0].count is 18446744073709551615",
       [&](GltfBuilder& b) { accessor(b, kPosition)["count"] = 18446744073709551615ull; }},
      {"accessors[0].count is 1e", [&](GltfBuilder& b) { accessor(b, kPosition)["count"] = 1e30; }},
      {"3000000000 elements need", [&](GltfBuilder& b) { accessor(b, kPosition)["count"] = 3000000000; }},
      {"4 elements need 48 bytes", [&](GltfBuilder& b) { accessor(b, kPosition)["count"] = 4; }},
      {"has 2 elements, POSITION has 3", [&](GltfBuilder& b) { accessor(b, kWeights)["count"] = 2; }},
      {"the primitive has 2 vertices", [&](GltfBuilder& b) { accessor(b, kPosition)["count"] = 2; }},
      {"elements need", [&](GltfBuilder& b) { accessor(b, kPosition)["byteOffset"] = 9007199254740992; }},
      {"elements need", [&](GltfBuilder& b) { accessor(b, kPosition)["byteOffset"] = 4; }},
      {"is no valid glTF", [&](GltfBuilder& b) { accessor(b, kPosition)["componentType"] = 12; }},
      {"component type 5125", [&](GltfBuilder& b) { accessor(b, kPosition)["componentType"] = 5125; }},
      {"is no valid glTF", [&](GltfBuilder& b) { accessor(b, kPosition)["type"] = "VEC9"; }},
      {"wrong type", [&](GltfBuilder& b) { accessor(b, kPosition)["type"] = "VEC2"; }},
      {"wrong type", [&](GltfBuilder& b) { accessor(b, kWeights)["type"] = "MAT2"; }},
      {"must not be normalized", [&](GltfBuilder& b) { accessor(b, kJoints)["normalized"] = true; }},
      {"must have a WEIGHTS_n for each JOINTS_n",  // -0 is a number, and no set
       [](GltfBuilder& b) {
         json& attributes = b.root["meshes"][0]["primitives"][0]["attributes"];
         attributes["WEIGHTS_-0"] = attributes["WEIGHTS_0"];
         attributes.erase("WEIGHTS_0");
       }},
      {"must have a WEIGHTS_n for each JOINTS_n",
       [](GltfBuilder& b) {
         json& attributes = b.root["meshes"][0]["primitives"][0]["attributes"];
         attributes["JOINTS_00"] = attributes["JOINTS_0"];
         attributes.erase("JOINTS_0");
       }},
      {"bufferView is 100", [&](GltfBuilder& b) { accessor(b, kPosition)["bufferView"] = 100; }},
      {"ends at byte", [](GltfBuilder& b) { b.root["bufferViews"][0]["byteLength"] = 9007199254740992; }},
      {"ends at byte", [](GltfBuilder& b) { b.root["bufferViews"][0]["byteOffset"] = 9007199254740992; }},
      {"byteStride", [](GltfBuilder& b) { b.root["bufferViews"][0]["byteStride"] = 8; }},
      {"byteStride", [](GltfBuilder& b) { b.root["bufferViews"][0]["byteStride"] = 9007199254740992; }},
      {"elements need", [](GltfBuilder& b) { b.root["bufferViews"][0]["byteStride"] = 16; }},
      {"far more than",
       [&](GltfBuilder& b) {
         accessor(b, kPosition).erase("bufferView");
         accessor(b, kPosition)["count"] = 4000000000;
       }},
      {"sparse",
       [&](GltfBuilder& b) {
         accessor(b, kDelta)["sparse"] = {{"count", 1}};
       }},
      {"4 sparse elements of 3",
       [&](GltfBuilder& b) {
         accessor(b, kDelta)["sparse"] = {{"count", 4},
                                          {"indices", {{"bufferView", 0}, {"componentType", 5121}}},
                                          {"values", {{"bufferView", 0}}}};
       }},
      {"they must ascend",
       [&](GltfBuilder& b) {
         accessor(b, kDelta)["sparse"] = {{"count", 2},
                                          {"indices", {{"bufferView", 0}, {"componentType", 5121}}},
                                          {"values", {{"bufferView", 4}}}};
       }},
      {"sparse indices have",
       [&](GltfBuilder& b) {
         accessor(b, kDelta)["sparse"] = {{"count", 1},
                                          {"indices", {{"bufferView", 0}, {"componentType", 5126}}},
                                          {"values", {{"bufferView", 0}}}};
       }},
      {"component 1 of element 2 is not finite", [](GltfBuilder& b) { SetFloat(b, kPosition, 7, kNan); }},
      {"is not finite", [](GltfBuilder& b) { SetFloat(b, kPosition, 0, kInfinity); }},
      {"WEIGHTS_0: component 0 of element 0 is not finite",
       [](GltfBuilder& b) { SetFloat(b, kWeights, 0, kNan); }},
      {"vertex 1 has the negative weight", [](GltfBuilder& b) { SetFloat(b, kWeights, 4, -1); }},
      {"targets[0].POSITION: component 2 of element 1 is not finite",
       [](GltfBuilder& b) { SetFloat(b, kDelta, 5, kNan); }},
      {"inverseBindMatrices: component 3 of element 1 is not finite",
       [](GltfBuilder& b) { SetFloat(b, kMatrices, 19, -kInfinity); }},
      {"samplers[0].input: component 0 of element 1 is not finite",
       [](GltfBuilder& b) { SetFloat(b, kTimes, 1, kNan); }},
      {"samplers[0].output: component", [](GltfBuilder& b) { SetFloat(b, kTurn, 1, kNan); }},
      {"key 2 is at 0.5 s, not after", [](GltfBuilder& b) { SetFloat(b, kTimes, 2, 0.5); }},
      {"key 1 is at 0 s, not after", [](GltfBuilder& b) { SetFloat(b, kTimes, 1, 0); }},
      {"before 0", [](GltfBuilder& b) { SetFloat(b, kTimes, 0, -1); }},
      {"index 1 is 9, the primitive has 3",
       [&](GltfBuilder& b) {
         b.buffer[b.root["bufferViews"][kIndices]["byteOffset"].get<std::size_t>() + 2] = 9;
       }},
      {"vertex 1 follows joint 200",
       [](GltfBuilder& b) {
         b.buffer[b.root["bufferViews"][kJoints]["byteOffset"].get<std::size_t>() + 4] = 200;
       }},
      {"has no keys", [&](GltfBuilder& b) { accessor(b, kTimes)["count"] = 0; }},
      {"has 8 numbers, 3 keys need 12", [&](GltfBuilder& b) { accessor(b, kTurn)["count"] = 2; }},
      {"3 keys need 36",
       [](GltfBuilder& b) { b.root["animations"][0]["samplers"][0]["interpolation"] = "CUBICSPLINE"; }},
      {"interpolation is \"BEZIER\"",
       [](GltfBuilder& b) { b.root["animations"][0]["samplers"][0]["interpolation"] = "BEZIER"; }},
      {"sampler is 5", [](GltfBuilder& b) { b.root["animations"][0]["channels"][0]["sampler"] = 5; }},
      {"target.path is \"spin\"",
       [](GltfBuilder& b) { b.root["animations"][0]["channels"][0]["target"]["path"] = "spin"; }},
      {"target is missing", [](GltfBuilder& b) { b.root["animations"][0]["channels"][0].erase("target"); }},
      {"target.node is 8",
       [](GltfBuilder& b) { b.root["animations"][0]["channels"][0]["target"]["node"] = 8; }},
      {"which has a matrix",
       [](GltfBuilder& b) { b.root["animations"][0]["channels"][0]["target"]["node"] = 3; }},
      {"as a channel before does",
       [](GltfBuilder& b) {
         b.root["animations"][0]["channels"].push_back(b.root["animations"][0]["channels"][0]);
       }},
  };
  for (const Damage& damage : damages) {
    GltfBuilder b = GltfBuilder::Character();
    damage.apply(b);
    SCOPED_TRACE(damage.message);
    ExpectError(b.Text(), damage.message);
  }
}

TEST(GltfHostile, BuffersStayInTheFolder) {
  const TemporaryFolder folder;
  folder.Write("secret.bin", std::string(1000, 'x'));
  GltfBuilder b = GltfBuilder::Character();
  const auto error_of = [&](const std::string& uri) {
    b.root["buffers"] = {{{"byteLength", b.buffer.size()}, {"uri", uri}}};
    const Result<Character> c = LoadGltf(folder.Write("in/c.gltf", b.Text()));
    return c.ok() ? std::string("accepted") : c.status().ToString();
  };
  for (const std::string& uri :
       {std::string("../secret.bin"), std::string("a/../../secret.bin"), std::string("%2e%2e/secret.bin"),
        std::string("..%2fsecret.bin"), folder / "secret.bin", std::string("%2Fetc/passwd")}) {
    EXPECT_NE(error_of(uri).find("leaves the document's folder"), std::string::npos) << error_of(uri);
  }
  for (const char* uri : {"http://example.org/a.bin", "file:///etc/passwd", "HTTPS:a"}) {
    EXPECT_NE(error_of(uri).find("no relative URI"), std::string::npos) << error_of(uri);
  }
  EXPECT_NE(error_of("missing.bin").find("No such file"), std::string::npos) << error_of("missing.bin");
  EXPECT_NE(error_of("").find("empty"), std::string::npos);
  EXPECT_NE(error_of("a%00b").find("zero byte"), std::string::npos);
  EXPECT_NE(error_of(".").find("is not a file"), std::string::npos) << error_of(".");
  folder.Write("in/short.bin", "abc");
  EXPECT_NE(error_of("short.bin").find("holds 3 bytes"), std::string::npos);
  ASSERT_EQ(mkfifo((folder / "in/pipe.bin").c_str(), 0600), 0);
  EXPECT_NE(error_of("pipe.bin").find("is not a file"), std::string::npos);  // would block
  EXPECT_NE(error_of("data:;base64,AA!A").find("base64"), std::string::npos);
  EXPECT_NE(error_of("data:;base64,AAAAA").find("is cut"), std::string::npos);
  EXPECT_NE(error_of("data:;base64").find("no comma"), std::string::npos);
}

TEST(GltfHostile, FilesThatAreNoGltf) {
  const TemporaryFolder folder;
  EXPECT_NE(LoadGltf(folder / "none.glb").status().ToString().find("none.glb: cannot be read: No such file"),
            std::string::npos);
  EXPECT_NE(LoadGltf(folder.path()).status().ToString().find("is a folder"), std::string::npos);
  ExpectError("", "is empty");
  ExpectError("   \n", "is no glTF file");
  ExpectError("\x89PNG\r\n", "is no glTF file");
  ExpectError("{", "is no valid JSON at byte");
  ExpectError("{}", "asset is missing");
  ExpectError("{\"asset\":{\"version\":\"2.0\"}} x", "is no valid JSON at byte");
  ExpectError("{\"asset\":{\"version\":\"\xff\"}}", "is no valid JSON at byte");
  ExpectError(R"({"asset":{"version":"2.0"},"nodes":[{"scale":[1e999,1,1]}]})", "is no valid glTF");
}

TEST(GltfHostile, Containers) {
  const std::string glb = GltfBuilder::Character().Glb();
  ASSERT_TRUE(Load(glb).ok());
  const auto patched = [&](std::size_t at, std::size_t value) {
    std::string copy = glb;
    return copy.replace(at, 4, GltfBuilder::U32(value));
  };
  ExpectError(glb.substr(0, 8), "truncated");
  ExpectError(glb.substr(0, glb.size() - 1), "is truncated: its header says");
  ExpectError(glb + "x", "is damaged: its header says");
  ExpectError(patched(4, 1), "version 1");
  ExpectError(patched(8, 0xffffffff), "truncated");
  ExpectError(patched(12, 0xffffffff), "bytes, ");
  ExpectError(patched(16, 0x004e4942), "first .glb chunk must be JSON");
  ExpectError("glTF" + GltfBuilder::U32(2) + GltfBuilder::U32(12), "without a JSON chunk");
  ExpectError("glTF" + GltfBuilder::U32(2) + GltfBuilder::U32(15) + "abc", "chunk header is cut");
  for (std::size_t size = 0; size < glb.size(); size += 7) {  // every truncation, header corrected
    std::string copy = glb.substr(0, size);
    if (size >= 12) copy.replace(8, 4, GltfBuilder::U32(size));
    EXPECT_FALSE(Load(copy).ok()) << size;
  }
}

TEST(GltfHostile, DeepJson) {
  constexpr std::size_t kDepth = 1000000;
  const std::string open = R"({"asset":{"version":"2.0"},"extras":)";
  ExpectError(open + std::string(kDepth, '['), "nested more than");
  ExpectError(open + std::string(kDepth, '[') + std::string(kDepth, ']') + "}", "nested more than");
  std::string objects = open;
  for (std::size_t i = 0; i < kDepth; ++i) objects += "{\"a\":";
  ExpectError(objects, "nested more than");
  EXPECT_TRUE(Load(open + std::string(400, '[') + std::string(400, ']') + "}").ok());
  EXPECT_TRUE(Load(open + "\"" + std::string(kDepth, '[') + "\\\"[\"}").ok());  // brackets in texts are none
}

TEST(GltfHostile, SharingCannotMultiplyMemoryOrTime) {
  // A few kilobytes of text that name one accessor many times
  GltfBuilder b;
  const int zeros = b.Push("accessors", {{"componentType", 5126}, {"type", "VEC3"}, {"count", 10000000}});
  json primitives = json::array();
  for (int i = 0; i < 2000; ++i) primitives.push_back({{"attributes", {{"POSITION", zeros}}}});
  b.Push("meshes", {{"primitives", primitives}});
  const std::clock_t start = std::clock();  // processor time: the machine may be busy
  ExpectError(b.Text(), "far more than the file's own data");
  // As many targets of zeros cost nothing
  b.root["accessors"][0]["count"] = 1000;
  json targets = json::array();
  for (int i = 0; i < 20000; ++i) targets.push_back({{"POSITION", zeros}});
  b.root["meshes"][0]["primitives"] = {{{"attributes", {{"POSITION", zeros}}}, {"targets", targets}}};
  EXPECT_TRUE(Load(b.Text()).ok());
  EXPECT_LT(std::clock() - start, 20 * CLOCKS_PER_SEC);
}

// Random damage of valid documents: any outcome but a crash (run under sanitizers, too).
TEST(GltfHostile, RandomDamage) {
  std::mt19937 random(20240117);
  const GltfBuilder builder = GltfBuilder::Character();
  const std::vector<std::string> documents = {builder.Text(), builder.Glb()};
  std::size_t accepted = 0, refused = 0;
  static const std::string kSpecial = "0123456789-.eE[]{}\",:\\";
  for (int round = 0; round < 6000; ++round) {
    std::string bytes = documents[static_cast<std::size_t>(round) % 2];
    for (std::uint32_t edits = 1 + random() % 4; edits > 0; --edits) {
      const std::size_t at = random() % bytes.size();
      switch (random() % 6) {
        case 0:
          bytes[at] = static_cast<char>(random());
          break;
        case 1:
          bytes[at] = static_cast<char>(bytes[at] ^ (1 << random() % 8));
          break;
        case 2:
          bytes[at] = kSpecial[random() % kSpecial.size()];
          break;
        case 3:
          bytes.insert(at, 1, kSpecial[random() % kSpecial.size()]);
          break;
        case 4:
          bytes.erase(at, 1 + random() % 8);
          break;
        default: {  // a digit becomes another: stays valid JSON, and names something else
          const std::size_t digit = bytes.find_first_of("0123456789", at);
          if (digit != std::string::npos) bytes[digit] = static_cast<char>('0' + random() % 10);
        }
      }
      if (bytes.empty()) bytes = " ";
    }
    if (random() % 20 == 0) bytes.resize(random() % bytes.size());
    if (bytes.starts_with("glTF") && bytes.size() >= 12) bytes.replace(8, 4, GltfBuilder::U32(bytes.size()));
    const Result<Character> c = Load(bytes);
    ++(c.ok() ? accepted : refused);
    if (!c.ok()) {
      ASSERT_FALSE(c.status().errors().empty());
      continue;
    }
    for (const Mesh& mesh : c->meshes) {
      for (const Primitive& primitive : mesh.primitives) {
        for (const Index index : primitive.triangles) ASSERT_LT(index, mesh.vertex_count());
      }
    }
  }
  EXPECT_GT(accepted, 100u);
  EXPECT_GT(refused, 100u);
}

}  // namespace
}  // namespace kpsa::engine::gltf
