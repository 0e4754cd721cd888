// The program on everything that may be wrong with a character, a rig or an argument.
#include <fmt/format.h>
#include <sys/stat.h>

#include <cstring>
#include <functional>
#include <limits>

#include "tests/cli/refusals.h"
#include "tests/support/gltf_builder.h"

namespace kpsa::engine {
namespace {

using nlohmann::json;

class BadCharacters : public RefusalTest {
 protected:
  // The character of GltfBuilder, changed; read alone, and by a rig.
  void ExpectDamage(const std::string& part, const std::function<void(GltfBuilder&)>& change) const {
    GltfBuilder builder = GltfBuilder::Character();
    change(builder);
    ExpectBadFile("c.gltf", builder.Text(), {"c.gltf: ", part});
    ExpectBadFile("t.yaml", "kpsa: 1\ncharacter: c.gltf\n",
                  {"t.yaml:2:12: the character cannot be read", "c.gltf: ", part});
  }
  static void SetFloat(GltfBuilder& b, std::size_t accessor, std::size_t number, float value) {
    const std::size_t view = b.root["accessors"][accessor]["bufferView"];
    std::memcpy(&b.buffer[b.root["bufferViews"][view]["byteOffset"].get<std::size_t>() + 4 * number], &value,
                4);
  }
};
// Accessors of GltfBuilder::Character
enum { kPosition, kJoints, kWeights, kIndices, kDelta, kMatrices, kTimes, kTurn, kMorph };
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

TEST_F(BadCharacters, MissingTruncatedOrNoGltf) {
  ExpectRefused({"eval", "none.glb", "-o", "out.npz"}, 3, {"none.glb: ", "No such file"});
  ExpectBadFile("t.yaml", "kpsa: 1\ncharacter: none.glb\n", {"t.yaml:2:12: ", "none.glb"});
  std::filesystem::create_directory(folder / "folder.glb");
  ExpectRefused({"eval", "folder.glb", "-o", "out.npz"}, 3, {"folder.glb: ", "folder"});
  const std::string glb = GltfBuilder::Character().Glb();
  for (std::size_t size : {std::size_t{0}, std::size_t{3}, std::size_t{11}, std::size_t{12}, std::size_t{40},
                           glb.size() / 2, glb.size() - 1}) {
    ExpectBadFile("c.glb", glb.substr(0, size), {"c.glb: "});
  }
  ExpectBadFile("c.glb", "\x89PNG\r\n\x1a\n", {"c.glb: ", "no glTF file"});
  ExpectBadFile("c.gltf", "kpsa: 1\n", {"c.gltf: ", "no glTF file"});
  ExpectBadFile("c.gltf", R"({"asset": {"version": "2.0"}, )", {"c.gltf: ", "JSON at byte"});
  ExpectBadFile("c.gltf", R"({"asset": {"version": "1.0"}})", {"c.gltf: ", "asset.version"});
}

TEST_F(BadCharacters, Accessors) {
  ExpectDamage("accessors[0]", [](GltfBuilder& b) { b.root["accessors"][kPosition]["count"] = 4; });
  ExpectDamage("accessors[0].count is -3",
               [](GltfBuilder& b) { b.root["accessors"][kPosition]["count"] = -3; });
  ExpectDamage("accessors[0]",
               [](GltfBuilder& b) { b.root["accessors"][kPosition]["count"] = 9007199254740992; });
  ExpectDamage("accessors[0].count is 18446744073709551615",
               [](GltfBuilder& b) { b.root["accessors"][kPosition]["count"] = 18446744073709551615ull; });
  ExpectDamage("meshes[0].primitives[0].POSITION would need 48000000000 bytes", [](GltfBuilder& b) {
    b.root["accessors"][kPosition].erase("bufferView");
    b.root["accessors"][kPosition]["count"] = 4000000000;
  });
  ExpectDamage("accessors[0]",
               [](GltfBuilder& b) { b.root["accessors"][kPosition]["byteOffset"] = 9007199254740992; });
  ExpectDamage("bufferViews[0]",
               [](GltfBuilder& b) { b.root["bufferViews"][0]["byteLength"] = 9007199254740992; });
  ExpectDamage("accessors[0].bufferView is 100",
               [](GltfBuilder& b) { b.root["accessors"][kPosition]["bufferView"] = 100; });
  ExpectDamage("component 1 of element 2 is not finite",
               [](GltfBuilder& b) { SetFloat(b, kPosition, 7, kNan); });
  ExpectDamage("WEIGHTS_0: component 0 of element 0 is not finite",
               [](GltfBuilder& b) { SetFloat(b, kWeights, 0, kNan); });
  ExpectDamage("vertex 1 has the negative weight", [](GltfBuilder& b) { SetFloat(b, kWeights, 4, -1); });
}

TEST_F(BadCharacters, Indices) {
  ExpectDamage("vertex 1 follows joint 200", [](GltfBuilder& b) {
    b.buffer[b.root["bufferViews"][kJoints]["byteOffset"].get<std::size_t>() + 4] = 200;
  });
  ExpectDamage("index 1 is 9, the primitive has 3", [](GltfBuilder& b) {
    b.buffer[b.root["bufferViews"][kIndices]["byteOffset"].get<std::size_t>() + 2] = 9;
  });
  ExpectDamage("skins[0].joints[1] is 4", [](GltfBuilder& b) { b.root["skins"][0]["joints"] = {1, 4}; });
  ExpectDamage("nodes[0].mesh is 1", [](GltfBuilder& b) { b.root["nodes"][0]["mesh"] = 1; });
  ExpectDamage("nodes[1].children[0] is 77", [](GltfBuilder& b) { b.root["nodes"][1]["children"] = {77}; });
  ExpectDamage("has a cycle", [](GltfBuilder& b) { b.root["nodes"][2]["children"] = {1}; });
  ExpectDamage("a node has one parent", [](GltfBuilder& b) { b.root["nodes"][0]["children"] = {3}; });
  ExpectDamage("key 2 is at 0.5 s, not after", [](GltfBuilder& b) { SetFloat(b, kTimes, 2, 0.5f); });
  ExpectDamage("key 1 is at 0 s, not after", [](GltfBuilder& b) { SetFloat(b, kTimes, 1, 0); });
}

TEST_F(BadCharacters, Depth) {
  const std::string open = R"({"asset":{"version":"2.0"},"extras":)";
  ExpectBadFile("c.gltf", open + std::string(1000000, '['), {"c.gltf: ", "nested more than"});
  ExpectBadFile("c.gltf", open + std::string(1000000, '[') + std::string(1000000, ']') + "}",
                {"c.gltf: ", "nested more than"});
  // A hierarchy of 100,000 is deep, but sound
  GltfBuilder builder = GltfBuilder::Character();
  for (int i = 4; i < 100000; ++i) builder.root["nodes"].push_back({{"children", {i + 1}}});
  builder.root["nodes"].push_back(json::object());
  builder.root["nodes"][2]["children"] = {4};
  builder.root["skins"][0]["joints"] = {1, 100000};
  folder.Write("deep.gltf", builder.Text());
  ExpectGood({"eval", "deep.gltf", "--frames", "12", "-o", "out.npz"});
  folder.Write("deep.yaml",
               "kpsa: 1\ncharacter: deep.gltf\nnodes: {mush: {type: deltaMush}, h: {type: transform, at: "
               "node100000, parent: node99999}}\n"
               "deform: [{meshes: [body], stack: [gltf, mush]}]\n");
  ExpectGood({"validate", "deep.yaml"});
}

TEST_F(BadCharacters, BuffersStayInTheFolder) {
  folder.Write("secret.bin", std::string(10000, 'x'));
  std::filesystem::create_directory(folder / "in");
  for (const std::string& uri : {std::string("../secret.bin"), std::string("a/../../secret.bin"),
                                 std::string("%2e%2e/secret.bin"), folder / "secret.bin"}) {
    GltfBuilder builder = GltfBuilder::Character();
    builder.root["buffers"] = {{{"byteLength", builder.buffer.size()}, {"uri", uri}}};
    ExpectBadFile("in/c.gltf", builder.Text(), {"in/c.gltf: ", "buffers[0]", "leaves the document's folder"});
  }
  GltfBuilder builder = GltfBuilder::Character();
  builder.root["buffers"] = {{{"byteLength", builder.buffer.size()}, {"uri", "http://example.org/a.bin"}}};
  ExpectBadFile("in/c.gltf", builder.Text(), {"in/c.gltf: ", "buffers[0]", "URI"});
  builder.root["buffers"][0]["uri"] = "none.bin";
  ExpectBadFile("in/c.gltf", builder.Text(), {"in/c.gltf: ", "buffers[0]", "none.bin"});
}

class BadRigs : public RefusalTest {
 protected:
  BadRigs() { folder.Write("c.gltf", GltfBuilder::Character().Text()); }
  // `text` follows the two lines that every rig here has: its own first line is line 3.
  void ExpectBad(const std::string& text, const std::vector<std::string>& parts) const {
    ExpectBadFile("t.yaml", "kpsa: 1\ncharacter: c.gltf\n" + text, parts);
  }
};

TEST_F(BadRigs, Yaml) {
  ExpectBad("nodes: {a: {type: transform}\n", {"t.yaml:", "YAML"});
  ExpectBad("nodes:\n  a: {type: transform\n  b: 3]\n", {"t.yaml:5:", "YAML"});
  ExpectBad("nodes:\n\ta: {type: transform}\n", {"t.yaml:4:", "tab"});
  ExpectBad("nodes: {a: {type: transform, at: lips[1]}}\n", {"t.yaml:3:", "quote plugs that contain [ ]"});
  ExpectBadFile("t.yaml", "", {"t.yaml", "no YAML document"});
  ExpectBadFile("t.yaml", "# nothing\n", {"t.yaml", "no YAML document"});
  ExpectBadFile("t.yaml", "kpsa: 1\ncharacter: c.gltf\n---\nkpsa: 1\n",
                {"t.yaml:4:1: ", "several YAML documents"});
  ExpectBadFile("t.yaml", "hello", {"t.yaml:1:1: "});
  ExpectBadFile("t.yaml", "kpsa: 2\ncharacter: c.gltf\n", {"t.yaml:1:7: ", "version 2"});
  ExpectBadFile("t.yaml", std::string("kpsa: 1\ncharacter: \xff\xfe.gltf\n"), {"t.yaml:2:", "UTF-8"});
  ExpectBadFile("t.yaml", std::string("kpsa: 1\ncharacter: c\0.gltf\n", 28), {"t.yaml:2:"});
  ExpectBad("nodes: &n {a: *n}\n", {"t.yaml:3:", "alias"});
  std::string bomb = "x0: &x0 [0, 0, 0, 0, 0, 0, 0, 0, 0, 0]\n";
  for (int i = 1; i < 12; ++i) {
    bomb += fmt::format(
        "x{0}: &x{0} [*x{1}, *x{1}, *x{1}, *x{1}, *x{1}, *x{1}, *x{1}, *x{1}, *x{1}, *x{1}]\n", i, i - 1);
  }
  ExpectBad(bomb, {"t.yaml:", "aliases"});
  ExpectBad("nodes: " + std::string(100000, '[') + "\n", {"t.yaml:3:"});
  ExpectBad("nodes: " + std::string(100000, '[') + std::string(100000, ']') + "\n",
            {"t.yaml:3:", "deeper than 64 levels"});
  ExpectBad("nodes:\n  a: {type: transform}\n  a: {type: curve}\n",
            {"t.yaml:5:3: ", "\"a\" is defined twice", "line 4"});
  ExpectBad("fps: 24\nfps: 25\n", {"t.yaml:4:1: ", "\"fps\" is defined twice"});
}

TEST_F(BadRigs, BomAndCarriageReturnsAreFine) {
  folder.Write("bom.yaml", "\xef\xbb\xbfkpsa: 1\ncharacter: c.gltf\n");
  ExpectGood({"validate", "bom.yaml"});
  folder.Write("crlf.yaml",
               "kpsa: 1\r\ncharacter: c.gltf\r\nnodes:\r\n  mush: {type: deltaMush}\r\ndeform:\r\n  - "
               "{meshes: [body], stack: [gltf, mush]}\r\n");
  ExpectGood({"validate", "crlf.yaml"});
  folder.Write("bad.yaml", "kpsa: 1\r\ncharacter: c.gltf\r\nnodes:\r\n  m: {type: deltaMsuh}\r\n");
  ExpectRefused({"validate", "bad.yaml"}, 3,
                {"bad.yaml:4:13: unknown node type \"deltaMsuh\" (did you mean \"deltaMush\"?)"});
}

TEST_F(BadRigs, WhatOnlyFollowsFromAnErrorIsNotTold) {
  const std::string rest =
      "deform: [{meshes: [body], stack: [gltf, mush]}]\naccelerate: {a: {points: [body@mush]}}\n";
  folder.Write("bad.yaml", "kpsa: 1\ncharacter: c.gltf\nnodes:\n  mush: {type: deltaMsuh}\n" + rest);
  const ProcessResult run = RunKpsa({"validate", "bad.yaml"}, kMostSeconds, folder.path());
  EXPECT_NE(run.err.find("bad.yaml:4:16: unknown node type"), std::string::npos) << run.err;
  EXPECT_EQ(run.err.find("has no stage"), std::string::npos) << run.err;
  folder.Write(
      "bad.yaml",
      "kpsa: 1\ncharacter: c.gltf\nnodes: {a: {type: choise}, b: {type: transform}}\n"
      "connections: [a.output -> b.translateX, b.translateY -> a.selector, a.output -> c.translateX]\n"
      "controls: {a.selector: {min: 0, max: 1}}\n");
  const ProcessResult plugs = RunKpsa({"validate", "bad.yaml"}, kMostSeconds, folder.path());
  EXPECT_NE(plugs.err.find("unknown node type \"choise\""), std::string::npos) << plugs.err;
  EXPECT_NE(plugs.err.find("unknown node \"c\""), std::string::npos) << plugs.err;
  EXPECT_EQ(plugs.err.find("unknown node \"a\""), std::string::npos) << plugs.err;
  ExpectBad("nodes: {mush: {type: deltaMush}}\naccelerate: {a: {points: [body@mush]}}\n",
            {"has no stage \"mush\""});
}

TEST_F(BadRigs, TypesOfOtherPrograms) {
  ExpectBad("nodes: {a: {type: correctiveSmooth}}\n",
            {"unknown node type \"correctiveSmooth\"; what other programs call so is deltaMush here"});
}

TEST_F(BadRigs, Values) {
  ExpectBad("nodes: {a: {type: deltaMush, envelope: .nan}}\n", {"t.yaml:3:40: ", "a.envelope", "not finite"});
  ExpectBad("nodes: {a: {type: deltaMush, envelope: 1e999}}\n", {"t.yaml:3:40: ", "outside of the range"});
  ExpectBad("nodes: {a: {type: softMod, falloffRadius: 0.2 parsec}}\n",
            {"t.yaml:3:43: ", "unknown unit \"parsec\"", "mm, cm, m"});
  ExpectBad("nodes: {a: {type: deltaMush, iterations: [1]}}\n",
            {"t.yaml:3:42: ", "expected a number, found a list"});
  ExpectBad("nodes: {a: {type: deltaMush, iterations: 2.5}}\n", {"t.yaml:3:42: ", "whole number"});
  ExpectBad("nodes: {a: {type: deltaMush, iterations: {}}}\n", {"t.yaml:3:42: "});
  ExpectBad("nodes: {a: {type: deltaMush, iterations: ten}}\n",
            {"t.yaml:3:42: ", "a.iterations: \"ten\" is neither a value of it nor a plug, node.attribute"});
  ExpectBad("nodes: {a: {type: transform, translate: [1, 2]}}\n", {"t.yaml:3:41: ", "3 numbers, found 2"});
  ExpectBad("controls: {tip.rotateX: {min: 3, max: -25}}\n", {"t.yaml:3:31: ", "min 3 is above max -25"});
  for (const char* tolerance : {"0", "-1mm", "0mm"}) {
    ExpectBad(std::string("accelerate: {a: {points: [body@skin], tolerance: ") + tolerance + "}}\n",
              {"t.yaml:3:50: ", "tolerance: expected a length above 0"});
  }
}

TEST_F(BadRigs, Names) {
  ExpectBad("nodes: {a: {type: deltaMesh}}\n", {"t.yaml:3:19: ", "did you mean \"deltaMush\""});
  ExpectBad("nodes: {a: {type: deltaMush, iteration: 3}}\n",
            {"t.yaml:3:30: ", "did you mean \"iterations\""});
  ExpectBad("nodes: {a: {type: transform, rotateOrder: xzz}}\n",
            {"t.yaml:3:43: ", "no choice \"xzz\"", "did you mean"});
  ExpectBad("connections: [tipp.translate -> tip.scale]\n",
            {"t.yaml:3:15: ", "unknown node \"tipp\"", "did you mean \"tip\""});
  ExpectBad("connections: [tip.translat -> root.translate]\n",
            {"t.yaml:3:15: ", "did you mean \"translate\""});
  ExpectBad("controls: {\"body.weight[upp]\": {min: 0, max: 1}}\n",
            {"t.yaml:3:12: ", "no element \"upp\"", "did you mean \"up\""});
  ExpectBad("contorls: {}\n", {"t.yaml:3:1: ", "did you mean \"controls\""});
  ExpectBad("accelerate: {a: {points: [body@skin], test: {clips: [wav]}}}\n",
            {"t.yaml:3:54: ", "did you mean \"wave\""});
  ExpectBad("deform: [{meshes: [bodi], stack: [gltf]}]\n", {"t.yaml:3:20: ", "did you mean \"body\""});
}

TEST_F(BadRigs, Cycles) {
  ExpectBad("nodes:\n  a: {type: transform, parent: b}\n  b: {type: transform, parent: a}\n",
            {"t.yaml:5:32: ", "cycle", "a.worldMatrix", "b.worldMatrix"});
  ExpectBad(
      "nodes:\n  a: {type: remapValue, input: b.outValue}\n  b: {type: remapValue, input: a.outValue}\n",
      {"t.yaml:5:32: ", "cycle"});
  folder.Write("a.yaml", "kpsa: 1\ninclude: t.yaml\n");
  ExpectBad("include: [a.yaml]\n", {"a.yaml:2:10: includes form a cycle", "t.yaml:3:11"});
  folder.Write("b.yaml", "kpsa: 1\nnodes: {a: {type: transform}}\n");
  ExpectBad("include: [b.yaml, b.yaml]\n", {"t.yaml:3:19: ", "included twice"});
  ExpectBad("include: [b.yaml]\nnodes: {a: {type: curve}}\n", {"t.yaml:4:9: ", "b.yaml:2:9"});
  ExpectBad("include: [none.yaml]\n", {"t.yaml:3:11: ", "none.yaml"});
  folder.Write("broken.yaml", "kpsa: 1\nnodes: {a: ]\n");
  ExpectBad("include: [broken.yaml]\n", {"broken.yaml:2:"});
}

TEST_F(BadRigs, Weights) {
  const auto expect = [&](const std::string& json_text, const std::vector<std::string>& parts) {
    folder.Write("w.json", json_text);
    ExpectBad(
        "nodes: {l: {type: cluster, weights: 'w.json#m'}}\ndeform: [{meshes: [body], stack: [gltf, l]}]\n",
        parts);
  };
  const std::string maps = R"("maps": {"m": {"default": 0, "indices": [], "values": []}}})";
  expect(R"({"kpsa": "weights", "version": 1, "mesh": "head", "points": 3, )" + maps,
         {"t.yaml:3:37: ", "w.json is for mesh \"head\""});
  expect(R"({"kpsa": "weights", "version": 1, "mesh": "body", "points": 4, )" + maps,
         {"t.yaml:3:37: ", "for 4 vertices; body has 3"});
  expect(R"({"kpsa": "weights", "version": 2, "mesh": "body", "points": 3, )" + maps, {"w.json", "version"});
  expect(
      R"({"kpsa": "weights", "version": 1, "mesh": "body", "points": 3, "maps": {"m": {"default": 0, "indices": [7], "values": [1]}}})",
      {"w.json", "7"});
  expect(
      R"({"kpsa": "weights", "version": 1, "mesh": "body", "points": 3, "maps": {"m": {"default": 0, "indices": [1, 1], "values": [1, 1]}}})",
      {"w.json", "1"});
  expect(
      R"({"kpsa": "weights", "version": 1, "mesh": "body", "points": 3, "maps": {"m": {"default": 0, "indices": [1], "values": [NaN]}}})",
      {"w.json:1:"});
  expect(
      R"({"kpsa": "weights", "version": 1, "mesh": "body", "points": 3, "maps": {"m": {"default": 1e999, "indices": [], "values": []}}})",
      {"w.json"});
  expect(
      R"({"kpsa": "weights", "version": 1, "mesh": "body", "points": 3, "maps": {"m": {"default": 0, "indices": [1], "values": []}}})",
      {"w.json", "values"});
  expect(
      R"({"kpsa": "weights", "version": 1, "mesh": "body", "points": 3, "maps": {"n": {"default": 0, "indices": [], "values": []}}})",
      {"t.yaml:3:37: ", "no map \"m\""});
  expect("{\"kpsa\": \"weights\",", {"w.json:1:"});
  expect(std::string(100000, '['), {"w.json"});
}

TEST_F(BadRigs, NumbersThatWouldTakeForever) {
  const std::string deform = "deform: [{meshes: [body], stack: [gltf, a]}]\n";
  ExpectBad("nodes: {a: {type: deltaMush, iterations: 1000000000}}\n",
            {"t.yaml:3:42: ", "a.iterations", "outside of 0 to"});
  ExpectBad("nodes: {a: {type: deltaMush, iterations: 99999999999999999999}}\n",
            {"t.yaml:3:42: ", "whole number"});
  ExpectBad("nodes: {a: {type: lattice, divisions: [2000000000, 2000000000, 2]}}\n" + deform,
            {"t.yaml:3:9: ", "divisions", "2 to 32"});
  ExpectBad("nodes: {a: {type: lattice, 'points[99999999999999999999,0,0]': [1, 2, 3]}}\n" + deform,
            {"t.yaml:3:28: ", "three indices"});
  ExpectBad("nodes: {a: {type: blendShape, 'weight[4000000000]': 1}}\n",
            {"t.yaml:3:31: ", "expected an index from 0 to"});
  ExpectBad("accelerate: {a: {points: [body@skin], tolerance: 1mm, train: {samples: 1e12}}}\n",
            {"t.yaml:3:72: ", "samples"});
  ExpectBad("accelerate: {a: {points: [body@skin], tolerance: .nan}}\n", {"t.yaml:3:50: ", "not finite"});
  ExpectBad("accelerate: {a: {points: [body@skin], tolerance: 1mm, violationRate: 200%}}\n",
            {"t.yaml:3:70: ", "0% to 100%"});
  ExpectBad("fps: 0\n", {"t.yaml:3:6: ", "above 0"});
  ExpectBad("controls: {tip.rotateX: {min: -.inf, max: 0}}\n", {"t.yaml:3:31: ", "not finite"});
  for (int i = 0; i < 400; ++i)
    folder.Write(fmt::format("i{}.yaml", i), fmt::format("kpsa: 1\ninclude: i{}.yaml\n", i + 1));
  ExpectBad("include: i0.yaml\n", {"more than 256 files"});
  // Many nodes are fine
  std::string chain = "kpsa: 1\ncharacter: c.gltf\nnodes:\n  n0: {type: transform}\n";
  for (int i = 1; i < 5000; ++i) chain += fmt::format("  n{}: {{type: transform, parent: n{}}}\n", i, i - 1);
  folder.Write("chain.yaml", chain);
  ExpectGood({"get", "chain.yaml", "n4999.worldMatrix", "--times", "0"});
}

TEST_F(BadRigs, TextThatIsNotWhatItSeems) {
  ExpectBadFile("t.yaml", std::string("\xff\xfek\0p\0s\0a\0:\0 \0001\0\n\0", 18), {"t.yaml:1:1: ", "UTF-8"});
  ExpectBad("x: &b {type: transform}\nnodes: {a: {<<: *b}}\n", {"t.yaml:4:13: ", "merges"});
  ExpectBad("include: t.yaml\n", {"t.yaml:3:10: ", "cycle"});
  ExpectBad("include: c.gltf\n", {"c.gltf:1:"});
  ExpectBadFile("t.yaml", "kpsa: one\ncharacter: c.gltf\n", {"t.yaml:1:7: ", "no number"});
  ExpectBadFile("t.yaml", "kpsa: 1.5\ncharacter: c.gltf\n", {"t.yaml:1:7: ", "whole number"});
  ExpectBadFile("t.yaml", "kpsa: 1\n", {"t.yaml:1:1: ", "names no character"});
  ExpectBadFile("t.yaml", "kpsa: 1\ncharacter: [a, b]\n",
                {"t.yaml:2:12: ", "expected a string, found a list"});
  folder.Write("other.yaml", "kpsa: 1\n");
  ExpectBadFile("t.yaml", "kpsa: 1\ncharacter: other.yaml\n",
                {"t.yaml:2:12: ", "other.yaml: is no glTF file"});
  // What a terminal would obey is not printed
  folder.Write("t.yaml", "kpsa: 1\ncharacter: c.gltf\nnodes: {a: {type: \"\\e[31mred\"}}\n");
  const ProcessResult run = RunKpsa({"validate", "t.yaml"}, kMostSeconds, folder.path());
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_NE(run.err.find("[31mred"), std::string::npos) << run.err;
  EXPECT_EQ(run.err.find('\x1b'), std::string::npos);
}

// Nobody writes to these pipes, and the device never ends.
TEST_F(BadRigs, PipesDevicesAndHugeFiles) {
  for (const char* kind : {"pipe", "device", "huge"}) {
    const auto make = [&](const std::string& suffix) {
      const std::string name = kind + suffix, path = folder / name;
      if (name.starts_with("pipe")) {
        EXPECT_EQ(::mkfifo(path.c_str(), 0600), 0);
      } else if (name.starts_with("device")) {
        std::filesystem::create_symlink("/dev/zero", path);
      } else {
        folder.Write(name, "");
        std::filesystem::resize_file(path, std::uintmax_t{40} << 30);  // takes no room
      }
      return name;
    };
    // The folder is not compared here: its files cannot be read
    const auto expect = [&](const std::vector<std::string>& arguments, const std::string& name) {
      SCOPED_TRACE(arguments[0] + " " + name);
      const ProcessResult run = RunKpsa(arguments, kMostSeconds, folder.path());
      ExpectBounded(run);
      EXPECT_EQ(run.exit_code, 3) << run.err;
      EXPECT_NE(run.err.find(name), std::string::npos) << run.err;
      EXPECT_LE(run.error_lines(), 5u) << run.err;
    };
    for (const char* suffix : {".yaml", ".glb", ".gltf", ".npz", ".pc2", ".kpsa", ".json"}) {
      const std::string name = make(suffix);
      expect({"inspect", name}, name);
    }
    const std::string k = kind;
    expect({"eval", kHello, "--pose", k + ".yaml", "-o", "out.npz"}, k + ".yaml");
    expect({"eval", kHello, "--kpsa", k + ".kpsa", "-o", "out.npz"}, k + ".kpsa");
    folder.Write("t.yaml", "kpsa: 1\ncharacter: " + k + ".glb\n");
    expect({"validate", "t.yaml"}, k + ".glb");
    folder.Write("t.yaml", "kpsa: 1\ncharacter: c.gltf\ninclude: " + k + ".yaml\n");
    expect({"validate", "t.yaml"}, k + ".yaml");
    folder.Write("t.yaml", "kpsa: 1\ncharacter: c.gltf\nnodes: {l: {type: cluster, weights: '" + k +
                               ".json#m'}}\n"
                               "deform: [{meshes: [body], stack: [gltf, l]}]\n");
    expect({"validate", "t.yaml"}, k + ".json");
    for (const auto& entry : std::filesystem::directory_iterator(folder.path())) {
      if (entry.path().filename().string().starts_with(kind)) std::filesystem::remove(entry.path());
    }
  }
  EXPECT_EQ(folder.FileCount(), 2u);  // c.gltf and t.yaml
}

using BadArguments = RefusalTest;

TEST_F(BadArguments, AreRefusedBeforeAnythingIsWritten) {
  const auto eval = [&](std::vector<std::string> more, const std::vector<std::string>& parts) {
    more.insert(more.begin(), {"eval", kHello, "-o", "out.npz"});
    ExpectRefused(more, 2, parts);
  };
  eval({"--frames", "10:1"}, {"--frames \"10:1\"", "before the first"});
  eval({"--frames", "0:10:0"}, {"--frames \"0:10:0\"", "step of 1 or more"});
  eval({"--frames", "0:1e12"}, {"--frames", "whole numbers", "1e12"});
  eval({"--frames", "0:1000000000000"}, {"--frames", "more than"});
  eval({"--times", "nan"}, {"--times \"nan\"", "finite"});
  eval({"--threads", "0"}, {"--threads", "1 to 1024"});
  for (const char* name : {"out.xyz", "out", "out.npz.bak", ".npz"})
    ExpectRefused({"eval", kHello, "-o", name}, 2, {name, ".npz"});
  std::filesystem::copy_file(kHelloGlb, folder / "hello.glb");
  std::filesystem::copy_file(kHello, folder / "hello.yaml");
  ExpectRefused({"eval", "hello.glb", "-o", "hello.glb", "--force"}, 2, {"hello.glb", "is the input"});
  ExpectRefused({"eval", "hello.yaml", "-o", "hello.glb", "--force"}, 2, {"hello.glb", "is the input"});
  ExpectRefused({"eval", "hello.yaml", "-o", "./hello.glb", "--force"}, 2, {"hello.glb", "is the input"});
  ExpectRefused({"get", "hello.yaml", "column", "-o", "hello.yaml", "--force"}, 2,
                {"hello.yaml", "is the input"});
  std::filesystem::create_hard_link(folder / "hello.glb", folder / "hard.glb");
  ExpectRefused({"eval", "hello.yaml", "-o", "hard.glb", "--force"}, 2, {"hard.glb", "is the input"});
  std::filesystem::create_symlink("hello.glb", folder / "soft.glb");
  ExpectRefused({"eval", "hello.yaml", "-o", "soft.glb", "--force"}, 2, {"soft.glb", "is the input"});
  ExpectRefused({"init", "hello.glb", "-o", "hello.yaml"}, 2, {"hello.yaml", "--force"});
  std::filesystem::create_directory(folder / "out.npz");
  eval({}, {"out.npz", "folder"});
  eval({"--force"}, {"out.npz", "folder"});
  std::filesystem::remove(folder / "out.npz");
  folder.Write("out.npz", "precious");
  eval({}, {"out.npz", "--force"});
  ExpectRefused({"eval", kHello, "-o", "none/out.npz"}, 2, {"none/out.npz", "no folder"});
  for (const std::string& command :
       {std::string("eval '") + kHello + "' -o -", "get '" + kHello + "' column", std::string("nodes")}) {
    const ProcessResult run =
        RunShell("'" KPSA_PROGRAM "' " + command + " > /dev/full", kMostSeconds, folder.path());
    EXPECT_EQ(run.exit_code, 3) << command;
    EXPECT_NE(run.err.find("stdout cannot be written"), std::string::npos) << run.err;
  }
  ExpectRefused({"eval", kHello, "-o", "/proc/out.npz"}, 2, {"/proc/out.npz", "cannot be written"});
}

}  // namespace
}  // namespace kpsa::engine
