// Every diagnostic of the rig format that needs no registry: grammar, versions, includes, duplicate
// definitions.
#include "rig/file/rig_file.h"

#include "tests/rig/rig_fixture.h"

namespace kpsa::engine {
namespace {

using RigFileTest = RigFixture;

TEST_F(RigFileTest, ReadsAllSections) {
  folder.Write(
      "part.yaml",
      "kpsa: 1\nunits: {length: mm, angle: rad}\nnodes: {a: {type: transform, translate: [1, 0, 0]}}\n");
  const std::string path = folder.Write("t.yaml", R"(kpsa: 1
units: {length: cm}
fps: 48
weld: off
character: sub/c.glb
include: part.yaml
nodes:
  mush: {type: deltaMush, iterations: 10}
connections:
  - a.translate -> b.translate
  - {from: a.rotate, to: b.rotate, override: true}
deform:
  - {meshes: [body], stack: [gltf, mush]}
  - {points: cage.points, stack: [cluster1]}
controls:
  jaw.rotateX: {min: -25, max: 3}
  head_mesh.weight[mouth-open]: {min: 0, max: 1}
accelerate:
  face: {points: [body@mush], space: head, subspace: face.kpsa, tolerance: 0.2mm, violationRate: 1%, train: {clips: [a], samples: 2000}, test: {clips: [b]}}
overrides: {mush.iterations: 12}
)");
  RigFile file;
  const Status status = ReadRigFile(path, std::nullopt, &file);
  ASSERT_TRUE(status.ok()) << status.ToString();
  const RigFile* rig = &file;
  EXPECT_EQ(Short(rig->character->text), "sub/c.glb");
  EXPECT_EQ(*rig->fps, 48);
  EXPECT_FALSE(rig->weld);
  ASSERT_EQ(rig->sources.size(), 2u);
  EXPECT_DOUBLE_EQ(rig->sources[0].units.length, 0.01);
  EXPECT_DOUBLE_EQ(rig->sources[1].units.length, 0.001);
  EXPECT_DOUBLE_EQ(rig->sources[1].units.angle, 1);
  EXPECT_EQ(rig->sources[1].units.fps, 48);
  ASSERT_EQ(rig->nodes.size(), 2u);  // the included ones first
  EXPECT_EQ(rig->nodes[0].name, "a");
  EXPECT_EQ(rig->nodes[0].source, 1);
  EXPECT_EQ(rig->nodes[1].type, "deltaMush");
  EXPECT_EQ(Short(rig->nodes[1].where.ToString()), "t.yaml:8:3");
  ASSERT_EQ(rig->connections.size(), 2u);
  EXPECT_EQ(rig->connections[0].from, "a.translate");
  EXPECT_EQ(rig->connections[0].to, "b.translate");
  EXPECT_TRUE(rig->connections[1].override_clip);
  ASSERT_EQ(rig->deform.size(), 2u);
  EXPECT_EQ(rig->deform[0].stack[1].text, "mush");
  EXPECT_EQ(rig->deform[1].points->text, "cage.points");
  ASSERT_EQ(rig->controls.size(), 2u);
  EXPECT_EQ(rig->controls[1].plug.text, "head_mesh.weight[mouth-open]");
  ASSERT_EQ(rig->accelerate.size(), 1u);
  EXPECT_EQ(rig->accelerate[0].points[0].stage, "mush");
  EXPECT_DOUBLE_EQ(*rig->accelerate[0].tolerance, 0.0002);
  EXPECT_DOUBLE_EQ(rig->accelerate[0].violation_rate, 0.01);
  EXPECT_EQ(rig->accelerate[0].train_samples, 2000);
  EXPECT_EQ(Short(rig->accelerate[0].subspace), "face.kpsa");
  EXPECT_EQ(rig->overrides[0].value.scalar, "12");
}

TEST_F(RigFileTest, RefusesOtherVersionsAndOtherFiles) {
  const auto errors = [&](const std::string& text) {
    RigFile rig;
    const Status status = ReadRigFile(folder.Write("t.yaml", text), std::nullopt, &rig);
    return status.ok() ? "no error" : Short(status.ToString());
  };
  EXPECT_TRUE(Has(errors("kpsa: 2\nshiny: new\n"),
                  "t.yaml:1:7: the file is of version 2, newer than this kpsa, which reads version 1"));
  EXPECT_FALSE(Has(errors("kpsa: 2\nshiny: new\n"), "unknown key"));
  EXPECT_TRUE(Has(errors("kpsa: one\n"), "\"one\" is no number"));
  EXPECT_TRUE(
      Has(errors("character: x.glb\n"), "t.yaml:1:1: not a rig file: it must begin with \"kpsa: 1\""));
  EXPECT_TRUE(Has(errors("- kpsa\n"), "t.yaml:1:1: rig: expected a map, found a list"));
  EXPECT_TRUE(Has(errors("kpsa: 1\n"), "the rig names no character"));
  EXPECT_TRUE(Has(errors(""), "no YAML document"));
  RigFile rig;
  EXPECT_TRUE(Has(Short(ReadRigFile(folder / "nobody.yaml", std::nullopt, &rig).ToString()), "nobody.yaml"));
}

TEST_F(RigFileTest, NamesTheNearestSection) {
  const std::string text = Errors("reference: {}\n");
  EXPECT_TRUE(Has(text, "t.yaml:3:1: rig: unknown key \"reference\" (did you mean \"references\"?)")) << text;
}

TEST_F(RigFileTest, CollectsErrorsWithPlaceAndSuggestion) {
  const std::string text = Errors(R"(contrls: {}
units: {length: parsec, angel: deg}
fps: 0
connections: [a.x->b.x, a.x -> b.x -> c.x]
deform:
  - {stack: [mush]}
  - {meshes: [body], points: cage.points, stack: [mush]}
  - {meshes: [body], stack: [mush, skin, mush]}
controls:
  tip.rotateX: {min: 1}
accelerate:
  a: {points: [body], tolerance: 0, violationRate: 120%}
  b: {points: [body@skin], tolerance: 0.2 parsec, train: {samples: -1}}
  c: {points: [body@skin], train: {clips: [wave]}, test: {clips: [wave]}}
)");
  EXPECT_TRUE(Has(text, "t.yaml:3:1: rig: unknown key \"contrls\" (did you mean \"controls\"?)")) << text;
  EXPECT_TRUE(Has(text, "t.yaml:4:17: unknown unit of length \"parsec\": expected mm, cm or m")) << text;
  EXPECT_TRUE(Has(text, "t.yaml:4:25: units: unknown key \"angel\" (did you mean \"angle\"?)")) << text;
  EXPECT_TRUE(Has(text, "t.yaml:5:6: fps: expected a number above 0, found 0")) << text;
  EXPECT_TRUE(Has(text, "t.yaml:6:15: \"a.x->b.x\": expected one connection")) << text;
  EXPECT_TRUE(Has(text, "\"a.x -> b.x -> c.x\": expected one connection")) << text;
  EXPECT_TRUE(Has(text, "t.yaml:8:5: deform: expected either \"meshes\" or \"points\"")) << text;
  EXPECT_TRUE(Has(text, "t.yaml:9:5: deform: expected either")) << text;
  EXPECT_TRUE(Has(text, "t.yaml:10:42: \"mush\" is in this stack twice: first at ")) << text;
  EXPECT_TRUE(Has(text, "control \"tip.rotateX\": the key \"max\" is missing")) << text;
  EXPECT_TRUE(Has(text, "points \"body\": expected mesh@stage")) << text;
  EXPECT_TRUE(Has(text, "tolerance: expected a length above 0, found 0")) << text;
  EXPECT_TRUE(Has(text, "violationRate: expected 0% to 100%, found 120%")) << text;
  EXPECT_TRUE(
      Has(text, "\"0.2 parsec\": unknown unit \"parsec\"; the units are mm, cm, m, deg, rad, s, f, %"))
      << text;
  EXPECT_TRUE(Has(text, "samples: expected a whole number from 0")) << text;
  EXPECT_TRUE(Has(text, "clip \"wave\" is trained on at")) << text;
}

TEST_F(RigFileTest, NamesBothPlacesOfWhatIsDefinedTwice) {
  folder.Write("part.yaml",
               "kpsa: 1\nnodes: {a: {type: transform}}\ncontrols: {tip.rotateX: {min: 0, max: "
               "1}}\noverrides: {a.translateX: 1}\nfps: 25\n");
  const std::string text = Errors(
      "include: [part.yaml]\nfps: 30\nnodes:\n  a: {type: curve}\ncontrols: {tip.rotateX: {min: 0, max: "
      "2}}\noverrides: {a.translateX: 2}\n");
  EXPECT_TRUE(Has(text, "t.yaml:6:3: node \"a\" is defined twice: here and at part.yaml:2:9")) << text;
  EXPECT_TRUE(Has(text, "t.yaml:7:12: control \"tip.rotateX\" is defined twice: here and at part.yaml:3:12"))
      << text;
  EXPECT_TRUE(Has(text, "override \"a.translateX\" is defined twice: here and at part.yaml:4:13")) << text;
  EXPECT_TRUE(Has(text, "part.yaml:5:6: \"fps\" is defined twice: here and at t.yaml:4:6")) << text;
  EXPECT_TRUE(Has(Errors("nodes:\n  a: {type: curve}\n  a: {type: curve}\n"),
                  "t.yaml:5:3: \"a\" is defined twice in this map: first at line 4"));
}

TEST_F(RigFileTest, RefusesIncludesTwiceAndInCycles) {
  folder.Write("a.yaml", "kpsa: 1\ninclude: [sub/../b.yaml]\n");
  folder.Write("b.yaml", "kpsa: 1\n");
  std::filesystem::create_directories(folder / "sub");
  const std::string twice = Errors("include: [a.yaml, b.yaml]\n");
  EXPECT_TRUE(Has(twice, "t.yaml:3:19: \"b.yaml\" is included twice: here and at a.yaml:2:11")) << twice;

  folder.Write("b.yaml", "kpsa: 1\ninclude: [t.yaml]\n");
  const std::string cycle = Errors("include: [a.yaml]\n");
  EXPECT_TRUE(Has(cycle, "b.yaml:2:11: includes form a cycle: t.yaml -> a.yaml (at t.yaml:3:11) -> "))
      << cycle;
  EXPECT_TRUE(Has(cycle, "-> t.yaml (here)")) << cycle;

  folder.Write("self.yaml", "kpsa: 1\ninclude: self.yaml\n");
  RigFile rig;
  EXPECT_TRUE(Has(Short(ReadRigFile(folder / "self.yaml", std::nullopt, &rig).ToString()),
                  "self.yaml:2:10: includes form a cycle: self.yaml -> self.yaml (here)"));

  const std::string missing = Errors("include: [nobody.yaml]\n");
  EXPECT_TRUE(Has(missing, "t.yaml:3:11: ") && Has(missing, "nobody.yaml")) << missing;
}

TEST_F(RigFileTest, IncludesAreRelativeToTheFileThatNamesThem) {
  folder.Write("parts/a.yaml", "kpsa: 1\ninclude: [more/b.yaml]\n");
  folder.Write("parts/more/b.yaml", "kpsa: 1\nnodes: {x: {type: transform}}\n");
  const Rig rig = Loaded("include: [parts/a.yaml]\n");
  EXPECT_TRUE(rig.graph->FindNode("x").ok());
  EXPECT_EQ(rig.files.size(), 4u);
}

}  // namespace
}  // namespace kpsa::engine
