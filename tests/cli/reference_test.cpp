// What is generated from the registry: the JSON Schema of rig files and the node reference.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>

#include "cli/common.h"
#include "files/yaml_document.h"
#include "picture/node_pictures.h"
#include "report/rig_schema.h"
#include "rig/file/words.h"
#include "tests/cli/hello_folder.h"
#include "tests/cli/json_schema.h"
#include "tests/cli/process.h"

namespace kpsa::engine {
namespace {

using Json = nlohmann::json;

// As YAML servers read it: plain scalars are what they look like.
Json FromYaml(const YamlNode& node) {
  if (node.is_map()) {
    Json map = Json::object();
    for (std::size_t i = 0; i < node.keys.size(); ++i) map[node.keys[i].scalar] = FromYaml(node.items[i]);
    return map;
  }
  if (node.is_sequence()) {
    Json list = Json::array();
    for (const YamlNode& item : node.items) list.push_back(FromYaml(item));
    return list;
  }
  if (node.is_null()) return nullptr;
  if (node.quoted) return node.scalar;
  if (node.scalar == "true" || node.scalar == "false") return node.scalar == "true";
  const Json number = Json::parse(node.scalar, nullptr, false);
  return number.is_number() ? number : Json(node.scalar);
}

class Schema : public ::testing::Test {
 protected:
  static const Json& Document() {
    static const Json kDocument = [] {
      NodeRegistry registry;
      AddAllNodes(registry);
      return Json::parse(RigSchema(registry));
    }();
    return kDocument;
  }
  static std::vector<std::string> Problems(const std::string& yaml) {
    const Result<YamlNode> root = ParseYaml(yaml, "t.yaml");
    EXPECT_TRUE(root.ok()) << root.status().ToString();
    return root.ok() ? SchemaProblems(Document(), FromYaml(*root)) : std::vector<std::string>();
  }
  // One problem, with those words.
  static void ExpectProblem(const std::string& yaml, const std::string& place, const std::string& words) {
    SCOPED_TRACE(yaml);
    const std::vector<std::string> problems = Problems(yaml);
    ASSERT_FALSE(problems.empty());
    EXPECT_TRUE(problems[0].starts_with(place + ": ")) << problems[0];
    EXPECT_NE(problems[0].find(words), std::string::npos) << problems[0];
  }
};

TEST_F(Schema, TheBundledRigsFit) {
  std::size_t rigs = 0;
  for (const char* folder : {KPSA_SCENES_DIR, KPSA_SOURCE_DIR "/tests/rigs"}) {
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
      if (entry.path().extension() != ".yaml") continue;
      ++rigs;
      EXPECT_EQ(Problems(TemporaryFolder::Read(entry.path().string())), std::vector<std::string>())
          << entry.path();
    }
  }
  EXPECT_GE(rigs, 5u);
}

TEST_F(Schema, TheExampleOfTheFormatFits) {
  const std::string docs = TemporaryFolder::Read(KPSA_SOURCE_DIR "/docs/rig-format.md");
  std::size_t examples = 0;
  for (std::size_t at = docs.find("```yaml\nkpsa: 1"); at != std::string::npos;
       at = docs.find("```yaml\nkpsa: 1", at + 1)) {
    const std::string example = docs.substr(at + 8, docs.find("```", at + 8) - at - 8);
    if (example.find("\npose:") != std::string::npos) continue;
    EXPECT_EQ(Problems(example), std::vector<std::string>());
    ++examples;
  }
  EXPECT_GE(examples, 1u);
}

TEST_F(Schema, EveryAttributeThatCanBeWrittenIsThere) {
  NodeRegistry registry;
  AddAllNodes(registry);
  const Json& defs = Document()["$defs"];
  std::size_t attributes = 0;
  for (const std::string& name : registry.Names()) {
    const Json& node = defs.at("node." + name);
    EXPECT_EQ(node["description"], registry.Find(name)->doc);
    for (const AttributeDef& a : registry.Find(name)->attributes) {
      if (a.output || a.type >= Type::kMesh) continue;
      ASSERT_TRUE(node["properties"].contains(a.name)) << name << "." << a.name;
      const Json& schema = node["properties"][a.name];
      EXPECT_NE(schema.value("description", "").find(a.doc), std::string::npos) << name << "." << a.name;
      ++attributes;
    }
  }
  EXPECT_GT(attributes, 60u);
  const Json& mush = defs["node.deltaMush"]["properties"];
  EXPECT_EQ(mush["iterations"]["type"], Json({"integer", "string"}));
  EXPECT_EQ(mush["iterations"]["default"], 10);
  EXPECT_EQ(mush["envelope"]["maximum"], 1);
  EXPECT_EQ(mush["members"]["$ref"], "#/$defs/members");
  EXPECT_EQ(defs["node.transform"]["properties"]["rotateOrder"]["enum"][0], "xyz");
}

TEST_F(Schema, MistakesAreFound) {
  const std::string head = "kpsa: 1\ncharacter: a.glb\n";
  EXPECT_EQ(Problems(head), std::vector<std::string>());
  ExpectProblem("character: a.glb\n", "/", "lacks \"kpsa\"");
  ExpectProblem("kpsa: 2\n", "/kpsa", "expected 1");
  ExpectProblem(head + "node: {}\n", "/node", "not allowed");
  ExpectProblem(head + "units: {length: inch}\n", "/units/length", "expected one of");
  ExpectProblem(head + "nodes: {m: {}}\n", "/nodes/m", "lacks \"type\"");
  ExpectProblem(head + "nodes: {m: {type: deltaMash}}\n", "/nodes/m/type", "deltaMush");
  ExpectProblem(head + "nodes: {m: {type: deltaMush, iteration: 3}}\n", "/nodes/m/iteration", "not allowed");
  ExpectProblem(head + "nodes: {m: {type: deltaMush, iterations: 2.5}}\n", "/nodes/m/iterations", "integer");
  ExpectProblem(head + "nodes: {m: {type: deltaMush, envelope: 2}}\n", "/nodes/m/envelope", "above 1");
  ExpectProblem(head + "nodes: {t: {type: transform, rotateOrder: xyx}}\n", "/nodes/t/rotateOrder", "one of");
  ExpectProblem(head + "nodes: {t: {type: transform, translate: [1, 2]}}\n", "/nodes/t/translate",
                "fits none");
  ExpectProblem(head + "nodes: {t: {type: transform, members: all}}\n", "/nodes/t/members", "not allowed");
  ExpectProblem(head + "connections: [a.x->b.y]\n", "/connections/0", "fits none");
  ExpectProblem(head + "deform: [{meshes: [a]}]\n", "/deform/0", "lacks \"stack\"");
  ExpectProblem(head + "clips: {a: {layers: [{clip: b, weight: 2}]}}\n", "/clips/a/layers/0/weight",
                "above 1");
  ExpectProblem(head + "use: {a: {s: b}}\n", "/use/a", "lacks \"template\"");
  ExpectProblem(head + "templates: {a: {param: {}}}\n", "/templates/a/param", "not allowed");
  ExpectProblem(head + "controls: {a.x: {min: 0}}\n", "/controls/a.x", "lacks \"max\"");
}

TEST_F(Schema, AllSpellingsFit) {
  EXPECT_EQ(Problems(R"(kpsa: 1
plugins: a.so
nodes:
  a: {type: transform, translateX: 2cm, rotate: b.rotate, "scale.y": 2, parent: head, at: {vertex: 3}}
  b: {type: transform, at: "lips[2]", translate: [c.output, 0, 1mm]}
  c: {type: plusMinusAverage, operation: sum, input: [1, a.translateX], "input[2]": 3}
  d: {type: lattice, divisions: [2, 3, 2], "points[0,1,1]": [0, 1, 1], "points[0,0,0].y": c.output}
  e: {type: cluster, members: [all, {vertices: "0:3"}, {joint: a, above: 50%}], envelope: 50%}
  f: {type: multMatrix, matrixIn: [a.worldMatrix, [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]]}
connections: [a.x -> b.y, {from: a.x, to: b.y, override: yes}]
deform: [{meshes: body, stack: [gltf, e]}, {points: d.points, stack: e}]
overrides: {a.translate: [1, 2, 3]}
variants: {game: {a.translateX: 1}, none: }
templates: {t: {params: {s: string, n: number}, nodes: {x: {type: transform, parent: $(s)}}, use: {u: {template: v}}}}
use: {l: {template: t, s: L, n: 2}}
clips: {shot: {layers: [{clip: a, weight: 50%, mode: additive, mask: [oris*], start: 12, speed: 1, loop: no}], frames: [0, 9]}}
)"),
            std::vector<std::string>());
}

TEST(SchemaCheck, CanaryOfKeywordsItDoesNotKnow) {
  EXPECT_EQ(SchemaProblems({{"oneOf", Json::array()}}, 1),
            std::vector<std::string>{"/: unknown keyword oneOf"});
}

TEST(NodesCommand, PrintsTheSchemaOfPluginsToo) {
  const ProcessResult run = RunKpsa({"nodes", "--schema", "--plugin", KPSA_WOBBLE});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const Json schema = Json::parse(run.out, nullptr, false);
  EXPECT_EQ(schema["$schema"], "https://json-schema.org/draft/2020-12/schema");
  EXPECT_EQ(schema["$defs"]["node.wobble"]["properties"]["amplitude"]["default"], 1.0);
  EXPECT_EQ(RunKpsa({"nodes", "--schema", "--markdown"}).exit_code, 2);
  EXPECT_EQ(RunKpsa({"nodes", "--schema", "deltaMush"}).exit_code, 2);
}

// The first line in which two texts differ, "" where they are equal.
std::string FirstDifference(const std::string& a, const std::string& b) {
  std::size_t at = 0, line = 1;
  for (; at < a.size() && at < b.size() && a[at] == b[at]; ++at) line += a[at] == '\n';
  return a == b ? "" : fmt::format("line {}", line);
}

TEST(NodeReference, IsWhatTheProgramPrints) {
  const std::string docs = TemporaryFolder::Read(KPSA_SOURCE_DIR "/docs/nodes.md");
  const ProcessResult run = RunKpsa({"nodes", "--markdown"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(FirstDifference(docs, run.out), "") << "write it anew: kpsa nodes --markdown > docs/nodes.md";
  // Canary: one more node, and one changed word, are noticed
  const ProcessResult more = RunKpsa({"nodes", "--markdown", "--plugin", KPSA_WOBBLE});
  EXPECT_NE(FirstDifference(docs, more.out), "");
  EXPECT_EQ(
      FirstDifference(docs, Replaced(docs, "Smooths the points and gives", "Smooths the points and takes"))
          .substr(0, 5),
      "line ");
}

// What a rig may write besides attributes.
TEST(NodeReference, TellsTheKeysOfRigs) {
  const ProcessResult text = RunKpsa({"nodes", "blendShape"}), json = RunKpsa({"nodes", "curve", "--json"});
  EXPECT_NE(text.out.find("key in a rig"), std::string::npos) << text.out;
  EXPECT_NE(text.out.find("inbetweens    other targets that a target goes through"), std::string::npos)
      << text.out;
  EXPECT_EQ(RunKpsa({"nodes", "multiplyDivide"}).out.find("key in a rig"), std::string::npos);
  const Json curve = Json::parse(json.out, nullptr, false);
  std::vector<std::string> keys;
  for (const Json& key : curve["nodes"][0]["rig_keys"]) keys.push_back(key["name"].get<std::string>());
  EXPECT_EQ(keys, (std::vector<std::string>{"parent", "vertices", "mesh", "places", "closed"}));
}

// Each deformer has one, small, and as committed.
TEST(NodeReference, PicturesShowWhatEveryDeformerDoes) {
  NodeRegistry registry;
  AddAllNodes(registry);
  const std::string docs = TemporaryFolder::Read(KPSA_SOURCE_DIR "/docs/nodes.md");
  for (const std::string& name : registry.Names()) {
    EXPECT_EQ(HasNodePicture(name), IsDeformer(*registry.Find(name))) << name;
    EXPECT_EQ(docs.find("](nodes/" + name + ".png)") != std::string::npos, HasNodePicture(name)) << name;
  }
  const Result<std::vector<NodePicture>> pictures = DrawNodePictures(registry);
  ASSERT_TRUE(pictures.ok()) << pictures.status().ToString();
  EXPECT_GT(pictures->size(), 15u);
  std::set<std::string> different;
  for (const NodePicture& picture : *pictures) {
    const std::string committed =
        TemporaryFolder::Read(KPSA_SOURCE_DIR "/docs/nodes/" + picture.type + ".png");
    EXPECT_TRUE(std::equal(picture.png.begin(), picture.png.end(), committed.begin(), committed.end(),
                           [](std::uint8_t a, char b) { return a == static_cast<std::uint8_t>(b); }))
        << picture.type << ": draw it anew: kpsa nodes --pictures docs/nodes --force";
    EXPECT_LT(picture.png.size(), 20000u) << picture.type;
    different.insert(committed);
  }
  EXPECT_EQ(different.size(), pictures->size());
  // All of them or none: the last one exists
  const TemporaryFolder folder;
  folder.Write(pictures->back().type + ".png", "mine");
  EXPECT_EQ(WriteNodePictures(registry, folder.path(), false).kind(), ErrorKind::kUsage);
  EXPECT_EQ(folder.FileCount(), 1u);
  EXPECT_EQ(TemporaryFolder::Read(folder / (pictures->back().type + ".png")), "mine");
}

}  // namespace
}  // namespace kpsa::engine
