// What a rig becomes in the graph, and every diagnostic that needs the registry or the character.
#include "io/rig_builder.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "base/matrix.h"
#include "base/scalar_math.h"
#include "tests/io/rig_fixture.h"

namespace kpsa {
namespace {

using RigBuilderTest = RigFixture;

TEST_F(RigBuilderTest, ACharacterAloneIsARig) {
  Result<Rig> rig = LoadRig(StandardRegistry(), folder / "c.gltf");
  ASSERT_TRUE(rig.ok()) << rig.status().ToString();
  EXPECT_EQ(*rig->scene.clip, "wave");
  EXPECT_EQ(rig->graph->PlugName(rig->scene.meshes[0].points), "body_skinCluster.outPoints[0]");
  EXPECT_TRUE(rig->controls.empty());
  EXPECT_EQ(rig->files, std::vector<std::string>{folder / "c.gltf"});
  RigOptions options;
  options.clip = "nobody";
  EXPECT_TRUE(Has(LoadRig(StandardRegistry(), folder / "c.gltf", options).status().ToString(),
                  "has no clip \"nobody\""));
  options = {};
  options.variant = "game";
  EXPECT_EQ(LoadRig(StandardRegistry(), folder / "c.gltf", options).status().kind(), ErrorKind::kUsage);
}

TEST_F(RigBuilderTest, ReadsValuesInTheFilesUnits) {
  const Rig rig = Loaded(R"(units: {length: cm}
nodes:
  a: {type: transform, translate: [1, 2mm, 3m], rotateX: 90, rotateOrder: zyx}
  b: {type: transform, rotate: [0.5rad, 0, 0], scale: [2, 50%, 1]}
  soft: {type: softMod, falloffRadius: 2.5, falloffCurve: linear}
  mush: {type: deltaMush, iterations: 3, pinBorderVertices: no}
  cage: {type: lattice, divisions: [3, 4, 2]}
  m: {type: multMatrix, matrixIn: [a.worldMatrix, [[1, 0, 0, 7], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]]}
deform: [{meshes: [body], stack: [gltf, mush, soft, cage]}]
)");
  EXPECT_EQ(Held(rig, "a.translate").get<Double3>(), (Double3{0.01, 0.002, 3}));
  EXPECT_DOUBLE_EQ(Held(rig, "a.rotate.x").AsDouble(), kPi / 2);
  EXPECT_EQ(Held(rig, "a.rotateOrder").AsInt(), 5);
  EXPECT_DOUBLE_EQ(Held(rig, "b.rotate").get<Double3>().x, 0.5);
  EXPECT_EQ(Held(rig, "b.scale").get<Double3>(), (Double3{2, 0.5, 1}));
  EXPECT_DOUBLE_EQ(Held(rig, "soft.falloffRadius").AsDouble(), 0.025);
  EXPECT_EQ(Held(rig, "mush.iterations").AsInt(), 3);
  EXPECT_EQ(Held(rig, "mush.pinBorderVertices").AsInt(), 0);
  EXPECT_EQ(Held(rig, "cage.divisions").get<std::vector<std::int64_t>>(),
            (std::vector<std::int64_t>{3, 4, 2}));
  EXPECT_EQ(Driver(rig, "m.matrixIn[0]"), "a.worldMatrix");
  EXPECT_EQ(Held(rig, "m.matrixIn[1]").get<Matrix4>(), Translation({7, 0, 0}));  // rows as read
}

TEST_F(RigBuilderTest, CollectsErrorsOfNodes) {
  const std::string text = Errors(R"(nodes:
  a: {type: deltaMesh}
  b: {type: deltaMush, iteration: 3}
  c: {type: deltaMush, iterations: [1]}
  d: {type: deltaMush, iterations: 500, envelope: .nan}
  e: {type: transform, rotateOrder: xzz, translate: [1, 2]}
  f: {type: remapValue, input: tip.poseRotatX, inputMax: 1e999, outputMax: 010}
  g: {type: softMod, falloffRadius: 0.2 parsec}
  h: {type: softMod, falloffRadius: 3deg}
  i: {type: transform, parent: cage, worldMatrix: [1]}
  j: {iterations: 3}
  k: 7
  skin: {type: transform}
  tip: {type: transform}
  l: {type: plusMinusAverage, input: 3}
  m: {type: transform, at: nobody}
  n: {type: multMatrix, parent: tip}
)");
  EXPECT_TRUE(Has(text, "t.yaml:4:13: unknown node type \"deltaMesh\" (did you mean \"deltaMush\"?)"))
      << text;
  EXPECT_TRUE(Has(
      text,
      "t.yaml:5:24: node \"b\" (deltaMush) has no attribute \"iteration\" (did you mean \"iterations\"?)"))
      << text;
  EXPECT_TRUE(Has(text, "t.yaml:6:36: c.iterations: expected a number, found a list")) << text;
  EXPECT_TRUE(Has(text, "t.yaml:7:36: d.iterations = 500 is outside of 0 to 200")) << text;
  EXPECT_TRUE(Has(text, "t.yaml:7:51: d.envelope: \".nan\" is not finite")) << text;
  EXPECT_TRUE(Has(text, "t.yaml:8:37: e.rotateOrder has no choice \"xzz\"")) << text;
  EXPECT_TRUE(Has(text, "e.translate: expected a list of 3 numbers, found 2")) << text;
  EXPECT_TRUE(Has(text, "t.yaml:9:32: node \"tip\" (transform) has no attribute \"poseRotatX\"")) << text;
  EXPECT_TRUE(Has(text, "f.inputMax: \"1e999\" is outside of the range of numbers")) << text;
  EXPECT_TRUE(Has(text, "f.outputMax: \"010\": write numbers in decimal and without leading zeros")) << text;
  EXPECT_TRUE(Has(text, "t.yaml:10:37: g.falloffRadius: \"0.2 parsec\": unknown unit \"parsec\"")) << text;
  EXPECT_TRUE(Has(text, "h.falloffRadius: \"3deg\": expected a length (mm, cm, m)")) << text;
  EXPECT_TRUE(Has(text, "t.yaml:12:32: unknown node \"cage\"")) << text;
  EXPECT_TRUE(Has(text, "i.worldMatrix is an output and cannot be set")) << text;
  EXPECT_TRUE(Has(text, "t.yaml:13:3: node \"j\": the key \"type\" is missing")) << text;
  EXPECT_TRUE(Has(text, "t.yaml:14:6: node \"k\": expected a map with its type, found a single value"))
      << text;
  EXPECT_TRUE(Has(text, "t.yaml:15:3: \"skin\" is a word of stacks")) << text;
  EXPECT_TRUE(Has(text, "t.yaml:16:3: a node named \"tip\" exists already")) << text;
  EXPECT_TRUE(Has(text, "l.input is an array: expected a list")) << text;
  EXPECT_TRUE(Has(text, "node \"n\" (multMatrix) has no attribute \"parent\"")) << text;
}

TEST_F(RigBuilderTest, ConnectsAndConverts) {
  const Rig rig = Loaded(R"(units: {length: cm}
nodes:
  a: {type: transform}
  b: {type: transform, translate: [a.translateX, 0, r.outValue]}
  r: {type: remapValue, input: tip.poseRotateX, inputMax: -25}
  cage: {type: lattice, divisions: [3, 2, 2]}
connections:
  - r.outValue -> cage.points[2,1,0].y
  - r.outValue -> a.rotateZ
  - "a.scale -> b.scale"
deform: [{meshes: [body], stack: [gltf, cage]}]
)");
  EXPECT_EQ(Driver(rig, "b.translate.x"), "a.translate.x");
  EXPECT_DOUBLE_EQ(Held(rig, "b.translate.y").AsDouble(), 0);
  EXPECT_EQ(Driver(rig, "b.translate.z"), "unitConversion1.output");  // a number becomes centimetres
  EXPECT_EQ(Driver(rig, "unitConversion1.input"), "r.outValue");
  EXPECT_DOUBLE_EQ(Held(rig, "unitConversion1.conversionFactor").AsDouble(), 0.01);
  EXPECT_EQ(Driver(rig, "r.inputValue"), "unitConversion2.output");  // radians become degrees
  EXPECT_EQ(Driver(rig, "unitConversion2.input"), "tip.poseRotate.x");
  EXPECT_DOUBLE_EQ(Held(rig, "unitConversion2.conversionFactor").AsDouble(), 180 / kPi);
  EXPECT_EQ(Driver(rig, "cage.points[5].y"), "r.outValue");  // lattice coordinates have no unit
  EXPECT_EQ(Driver(rig, "a.rotate.z"), "unitConversion3.output");
  EXPECT_DOUBLE_EQ(Held(rig, "unitConversion3.conversionFactor").AsDouble(), kPi / 180);
  EXPECT_EQ(Driver(rig, "b.scale"), "a.scale");
}

TEST_F(RigBuilderTest, ExplainsBadConnections) {
  const std::string text = Errors(R"(nodes:
  a: {type: transform}
  b: {type: transform}
  r: {type: remapValue}
  s: {type: remapValue, input: r.outValue}
connections:
  - a.translate -> b.nothing
  - r.outValue -> b.translate
  - a.translateX -> r.outValue
  - s.outValue -> r.input
  - a.scale -> b.scale
  - a.translate -> b.scale
  - r.outValue -> body.weight[up]
  - r.outValue -> tip.offsetParentMatrix
)");
  EXPECT_TRUE(Has(text, "t.yaml:9:5: node \"b\" (transform) has no attribute \"nothing\"")) << text;
  EXPECT_TRUE(Has(text, "t.yaml:10:5: r.outValue is a double and cannot drive b.translate, a double3"))
      << text;
  EXPECT_TRUE(Has(text, "t.yaml:11:5: r.outValue is an output")) << text;
  EXPECT_TRUE(Has(text, "t.yaml:12:5: s.outValue -> r.inputValue would make a cycle: ")) << text;
  EXPECT_TRUE(Has(text, "t.yaml:14:5: b.scale is driven by a.scale already")) << text;
  EXPECT_TRUE(Has(text,
                  "t.yaml:15:5: a clip drives body_blendShape.weight[up]: write {from: r.outValue, to: "
                  "body_blendShape.weight[up], override: true}"))
      << text;
  EXPECT_TRUE(Has(text, "t.yaml:16:5: a clip drives tip.offsetParentMatrix")) << text;
}

TEST_F(RigBuilderTest, AConnectionMayOverrideAClip) {
  Rig rig = Loaded(
      "nodes: {r: {type: remapValue}}\nconnections: [{from: r.outValue, to: 'body.weight[up]', override: "
      "true}]\n");
  EXPECT_EQ(Driver(rig, "body.weight[up]"), "r.outValue");
  ASSERT_TRUE(SetClip(&rig, "wave").ok());
  EXPECT_EQ(Driver(rig, "body.weight[up]"), "r.outValue");
}

TEST_F(RigBuilderTest, ParentsThatFormACycle) {
  const std::string text =
      Errors("nodes:\n  a: {type: transform, parent: b}\n  b: {type: transform, parent: a}\n");
  EXPECT_TRUE(Has(text, "t.yaml:5:32: a.worldMatrix -> b.parentMatrix would make a cycle: ")) << text;
}

TEST_F(RigBuilderTest, PlacesHandles) {
  // At rest vertex 2 is at (0, 1, 0); it follows root, which stands at (0, 1, 0)
  const Rig rig = Loaded(R"(units: {length: cm}
nodes:
  c: {type: curve, vertices: [0, 1, 2], parent: root}
  d: {type: curve, places: [[0, 0, 0], [100, 0, 0], [0, 100, 0]], closed: true}
  mid: {type: transform, at: c, parent: tip}
  third: {type: transform, at: "c[2]", parent: root}
  cv: {type: transform, at: "d.cv[1]"}
  vertex: {type: transform, at: {vertex: 2}, parent: moved}
  moved: {type: transform, parent: root, rotateZ: 90, translate: [300, 0, 0]}
  joint: {type: transform, at: tip}
  place: {type: transform, at: [1, 2, 3]}
  chained: {type: transform, at: place, parent: place}
)");
  const auto curve = [&](const char* name) { return Held(rig, std::string(name) + ".curve").asset<Curve>(); };
  ASSERT_NE(curve("c"), nullptr);
  EXPECT_TRUE(curve("d")->closed());
  const std::vector<Double3> cvs = curve("c")->cvs();
  const auto near = [](Double3 a, Double3 b) { return Length(a - b) < 1e-9; };
  const auto at = [&](const char* name) {
    const Matrix4 m = Held(rig, std::string(name) + ".offsetParentMatrix").get<Matrix4>();
    return Double3{m(0, 3), m(1, 3), m(2, 3)};
  };
  EXPECT_TRUE(near(cvs[2], {0, 2, 0}));  // joint root: identity bind, 1 m up
  // tip is at root + (0, 0, 5)
  EXPECT_TRUE(near(at("mid"), cvs[1] - Double3{0, 1, 5}));
  EXPECT_TRUE(near(at("third"), {0, 1, 0}));
  EXPECT_TRUE(near(at("cv"), {1, 0, 0}));
  EXPECT_TRUE(near(at("vertex"), {1, 3, 0}));  // moved: rotated by 90 degrees about Z at (3, 1, 0)
  EXPECT_TRUE(near(at("joint"), {0, 1, 5}));
  EXPECT_TRUE(near(at("place"), {0.01, 0.02, 0.03}));
  EXPECT_TRUE(near(at("chained"), {0, 0, 0}));
  EXPECT_EQ(Held(rig, "vertex.restMatrix").get<Matrix4>(),
            Held(rig, "vertex.offsetParentMatrix").get<Matrix4>());
  EXPECT_EQ(Driver(rig, "mid.parentMatrix"), "tip.worldMatrix");
  EXPECT_EQ(Driver(rig, "c.parentMatrix"), "root.worldMatrix");
}

TEST_F(RigBuilderTest, ExplainsBadPlaces) {
  const std::string text = Errors(R"(nodes:
  a: {type: transform, at: b}
  b: {type: transform, at: a}
  c: {type: curve, vertices: [0, 9]}
  d: {type: curve}
  e: {type: transform, at: "f[7]"}
  f: {type: curve, vertices: "0:2"}
  g: {type: transform, at: {vertex: 0, mesh: bodi}}
  h: {type: curve, vertices: [1]}
  i: {type: transform, at: nobody}
  w: {type: wire, curve: tip}
)");
  EXPECT_TRUE(Has(text, "t.yaml:6:34: vertices: \"9\" is none of body")) << text;
  EXPECT_TRUE(Has(text, "t.yaml:7:3: curve \"d\": expected either \"vertices\"")) << text;
  EXPECT_TRUE(Has(text, "curve \"h\" has 1 points")) << text;
  EXPECT_TRUE(Has(text, "\"tip\" is a transform; expected a curve")) << text;
  const std::string places = Errors(R"(nodes:
  a: {type: transform, at: b}
  b: {type: transform, at: a}
  e: {type: transform, at: "f[7]"}
  f: {type: curve, vertices: "0:2"}
  g: {type: transform, at: {vertex: 0, mesh: bodi}}
  i: {type: transform, at: nobody}
)");
  EXPECT_TRUE(Has(places, "is placed at something that is placed at it")) << places;
  EXPECT_TRUE(Has(places, "\"f[7]\": curve \"f\" has cvs 0 to 2")) << places;
  EXPECT_TRUE(Has(places, "unknown mesh \"bodi\" (did you mean \"body\"?)")) << places;
  EXPECT_TRUE(Has(places, "t.yaml:9:28: unknown node \"nobody\"")) << places;
}

TEST_F(RigBuilderTest, BuildsStacks) {
  const Rig rig = Loaded(R"(nodes:
  c: {type: curve, vertices: [0, 1]}
  before: {type: wire, curve: c, dropoff: 1}
  cage: {type: lattice, parent: tip}
  mush: {type: deltaMush}
  idle: {type: cluster}
deform: [{meshes: body, stack: [morph, before, skin, cage, mush]}]
accelerate: {a: {points: ["body@cage"], space: tip, tolerance: 0.5mm, test: {clips: [wave]}}}
)");
  const CharacterMesh& mesh = rig.scene.meshes[0];
  std::vector<std::string> names;
  for (const Stage& stage : mesh.stages) names.push_back(stage.name + (stage.world ? "+" : "-"));
  EXPECT_EQ(names, (std::vector<std::string>{"morph-", "before-", "skin+", "cage+", "mush+"}));
  EXPECT_EQ(Driver(rig, "before.inPoints"), "body_blendShape.outPoints[0]");
  EXPECT_EQ(Driver(rig, "body_skinCluster.inPoints"), "before.outPoints[0]");
  EXPECT_EQ(Driver(rig, "cage.inPoints"), "body_skinCluster.outPoints[0]");
  EXPECT_EQ(rig.graph->PlugName(mesh.points), "mush.outPoints[0]");
  EXPECT_EQ(Held(rig, "before.space").AsInt(), 1);
  EXPECT_EQ(Held(rig, "cage.space").AsInt(), 0);
  // Vertex 0 hangs on root by 0.25 and on tip by 0.75, vertex 1 on tip
  EXPECT_EQ(Held(rig, "before.geometryMatrix[0]").get<Matrix4>(), Translation({0, 1, 0.5 * (3.75 + 5)}));
  EXPECT_TRUE(Held(rig, "cage.geometryMatrix[0]").empty());
  EXPECT_EQ(Held(rig, "mush.mesh").asset<Mesh>(), &mesh.mesh());
  EXPECT_EQ(Driver(rig, "before.displacements"), "c.displacements");
  EXPECT_NE(Held(rig, "before.curve").asset<Curve>(), nullptr);
  EXPECT_EQ(Driver(rig, "cage.parentMatrix"), "tip.worldMatrix");
  ASSERT_EQ(rig.accelerate.size(), 1u);
  EXPECT_EQ(rig.accelerate[0].points[0].stage, 3u);
  EXPECT_EQ(rig.graph->PlugName(rig.accelerate[0].points[0].points), "cage.outPoints[0]");
  EXPECT_EQ(rig.graph->name(*rig.accelerate[0].space), "tip");
  EXPECT_DOUBLE_EQ(rig.accelerate[0].tolerance, 0.0005);
  EXPECT_EQ(rig.accelerate[0].test_clips, std::vector<std::string>{"wave"});
  ASSERT_EQ(rig.notes.size(), 1u);
  EXPECT_TRUE(Has(rig.notes[0], "\"idle\" is in no stack")) << rig.notes[0];
}

TEST_F(RigBuilderTest, AVectorAndItsComponentsAreNotSetTogether) {
  const std::string a = "nodes:\n  a: {type: transform}\n";
  EXPECT_TRUE(Has(Errors(a + "  b: {type: transform, translate: [1, 2, 3], translateY: 7}\n"),
                  "b.translate.y is set here, and b.translate at"));
  EXPECT_TRUE(Has(Errors(a + "  b: {type: transform, translateX: 5, translate: [1, 2, 3]}\n"),
                  "b.translate is set here, and b.translate.x at"));
  EXPECT_TRUE(Has(Errors(a + "  b: {type: transform, translate: a.translate, translateY: 7}\n"),
                  "b.translate.y is set here, and b.translate at"));
  // A value of which a component is driven, in either order
  for (const char* node : {"{type: transform, translate: [1, 2, 3], translateY: a.translateX}",
                           "{type: transform, translateY: a.translateX, translate: [1, 2, 3]}"}) {
    const Rig rig = Loaded(a + "  b: " + node + "\n");
    EXPECT_EQ(rig.graph->FindValue(*rig.graph->FindPlug("b.translate"))->get<Double3>(), (Double3{1, 2, 3}));
    EXPECT_NE(rig.graph->FindConnection(*rig.graph->FindPlug("b.translateY")), nullptr);
  }
}

TEST_F(RigBuilderTest, ExplainsBadStacks) {
  const std::string text =
      Errors(R"(nodes: {mush: {type: deltaMush}, mush2: {type: deltaMush}, t: {type: transform}}
deform:
  - {meshes: [body], stack: [gltf, mosh, t, morph]}
  - {meshes: [body, bodi, tip], stack: [gltf]}
accelerate:
  a: {points: [body@mosh], space: mush, test: {clips: [weve]}}
  b: {points: [bode@skin], train: {samples: 10}}
)");
  EXPECT_TRUE(Has(text, "t.yaml:5:36: unknown deformer \"mosh\" (did you mean \"mush\"?)")) << text;
  EXPECT_TRUE(Has(text, "t.yaml:5:42: \"t\" is a transform, no deformer")) << text;
  EXPECT_TRUE(Has(text, "t.yaml:5:45: \"morph\" brings the stage morph of \"body\" a second time")) << text;
  EXPECT_TRUE(Has(text, "t.yaml:6:15: mesh \"body\" has a stack already, at t.yaml:5:15")) << text;
  EXPECT_TRUE(Has(text, "t.yaml:6:21: unknown mesh \"bodi\"")) << text;
  EXPECT_TRUE(Has(text, "t.yaml:6:27: unknown mesh \"tip\"")) << text;
  EXPECT_TRUE(Has(text, "\"body\" has no stage \"mosh\"")) << text;
  EXPECT_TRUE(Has(text, "\"mush\" is a deltaMush; expected a transform")) << text;
  EXPECT_TRUE(Has(text, "the character has no clip \"weve\" (did you mean \"wave\"?)")) << text;
  EXPECT_TRUE(Has(text, "train.samples draws poses from the controls, and the rig declares none")) << text;
}

TEST_F(RigBuilderTest, DeformersMayServeSeveralMeshesInOneSpace) {
  GltfBuilder builder = GltfBuilder::Character();
  builder.Push("nodes", {{"name", "twin"}, {"mesh", 0}, {"skin", 0}});
  builder.Push("nodes", {{"name", "prop"}, {"mesh", 0}});
  builder.root["scenes"][0]["nodes"] = {0, 1, 4, 5};
  folder.Write("c.gltf", builder.Text());
  const std::string nodes = "nodes: {mush: {type: deltaMush}, l: {type: cluster}}\n";
  const Rig rig = Loaded(nodes + "deform: [{meshes: [body, twin, prop], stack: [morph, skin, mush]}]\n");
  EXPECT_EQ(Driver(rig, "mush.inPoints[0]"), "body_skinCluster.outPoints[0]");
  EXPECT_EQ(Driver(rig, "mush.inPoints[1]"), "twin_skinCluster.outPoints[0]");
  EXPECT_EQ(Driver(rig, "mush.inPoints[2]"), "prop_transformGeometry.outPoints[0]");
  // Morph targets belong to mesh space
  EXPECT_TRUE(Has(Errors(nodes + "deform: [{meshes: [prop], stack: [l, morph]}]\n"),
                  "those of \"l\" are in world space: put it before"));
  EXPECT_TRUE(Has(Errors(nodes + "deform: [{meshes: [body], stack: [skin, morph]}]\n"),
                  "those of \"skin\" are in world space: put it before"));
  // Unskinned meshes are in world space but for their morphs
  const Rig props = Loaded(nodes + "deform: [{meshes: [prop], stack: [morph, l]}]\n");
  EXPECT_EQ(Driver(props, "l.inPoints"), "prop_transformGeometry.outPoints[0]");
  EXPECT_EQ(Held(props, "l.space").AsInt(), 0);
  EXPECT_TRUE(props.scene.meshes[2].world);
  const std::string mixed = Errors(
      nodes +
      "deform:\n  - {meshes: [body], stack: [morph, l, skin]}\n  - {meshes: [prop], stack: [gltf, l]}\n");
  EXPECT_TRUE(Has(mixed, "t.yaml:6:36: \"l\" deforms body and prop in different spaces")) << mixed;
  const std::string vertices = Errors("nodes: {c: {type: curve, vertices: [0, 1]}}\n");
  EXPECT_TRUE(Has(vertices, "the character has 3 meshes: name the one that the vertices are of")) << vertices;
}

TEST_F(RigBuilderTest, AStackWithoutItsSkinIsNoted) {
  const Rig rig =
      Loaded("nodes: {mush: {type: deltaMush}}\ndeform: [{meshes: [body], stack: [morph, mush]}]\n");
  EXPECT_FALSE(rig.scene.meshes[0].world);
  ASSERT_EQ(rig.notes.size(), 1u);
  EXPECT_TRUE(Has(rig.notes[0], "leaves out its skin")) << rig.notes[0];
  EXPECT_EQ(Driver(rig, "body_skinCluster.inPoints"), "");
}

TEST_F(RigBuilderTest, MembersWeightsAndFalloffs) {
  folder.Write("w.json", R"({"kpsa": "weights", "version": 1, "mesh": "body", "points": 3,
    "maps": {"half": {"default": 0.5, "indices": [1], "values": [0.25]}, "one": {"default": 0, "indices": [2], "values": [0.1]}}})");
  const auto weights = [&](const std::string& keys) {
    const Rig rig = Loaded("units: {length: cm}\nnodes: {l: {type: cluster, " + keys +
                           "}}\ndeform: [{meshes: [body], stack: [gltf, l]}]\n");
    const auto* map = Held(rig, "l.weights").asset<WeightMap>();
    std::vector<float> by_vertex;
    for (Index v = 0; map != nullptr && v < 3; ++v)
      by_vertex.push_back(map->weights()[rig.scene.meshes[0].mesh().data().vertex_to_point[v]]);
    return by_vertex;
  };
  using V = std::vector<float>;
  EXPECT_EQ(weights("envelope: 1"), V{});
  EXPECT_EQ(weights("members: all"), (V{1, 1, 1}));
  EXPECT_EQ(weights("members: {vertices: '0:1'}"), (V{1, 1, 0}));
  EXPECT_EQ(weights("members: {vertices: [2]}"), (V{0, 0, 1}));
  EXPECT_EQ(weights("members: {primitive: 0}"), (V{1, 1, 1}));
  EXPECT_EQ(weights("members: {material: Skin}"), (V{1, 1, 1}));
  EXPECT_EQ(weights("members: {joint: tip, above: 0.5}"), (V{1, 1, 0}));
  EXPECT_EQ(weights("members: {joint: tip, above: 80%}"), (V{0, 1, 0}));
  EXPECT_EQ(weights("members: {weights: 'w.json#one'}"), (V{0, 0, 1}));
  EXPECT_EQ(weights("members: [{vertices: 0}, {vertices: 2}]"), (V{1, 0, 1}));
  EXPECT_EQ(weights("weights: 'w.json#half'"), (V{0.5f, 0.25f, 0.5f}));
  EXPECT_EQ(weights("weights: 'w.json#half', members: {vertices: '1:2'}"), (V{0, 0.25f, 0.5f}));
  // Vertex 2 is 1 m from the place, the others too far
  const V falloff = weights("falloff: {at: [0, 300, 0], radius: 2m, curve: linear}");
  ASSERT_EQ(falloff.size(), 3u);
  EXPECT_NEAR(falloff[2], 0.5f, 1e-6);
  EXPECT_EQ(falloff[0], 0);
}

TEST_F(RigBuilderTest, ExplainsBadMembersAndWeights) {
  folder.Write(
      "other.json",
      R"({"kpsa": "weights", "version": 1, "mesh": "head", "points": 3, "maps": {"m": {"default": 0, "indices": [], "values": []}}})");
  folder.Write(
      "short.json",
      R"({"kpsa": "weights", "version": 1, "mesh": "body", "points": 4, "maps": {"m": {"default": 0, "indices": [], "values": []}}})");
  folder.Write(
      "bad.json",
      R"({"kpsa": "weights", "version": 1, "mesh": "body", "points": 3, "maps": {"m": {"default": 0, "indices": [7], "values": [1]}}})");
  const auto errors = [&](const std::string& keys) {
    return Errors("nodes: {l: {type: cluster, " + keys +
                  "}}\ndeform: [{meshes: [body], stack: [gltf, l]}]\n");
  };
  EXPECT_TRUE(Has(errors("weights: 'other.json#m'"), "other.json is for mesh \"head\"; \"l\" deforms body"))
      << errors("weights: 'other.json#m'");
  EXPECT_TRUE(Has(errors("weights: 'short.json#m'"), "short.json is for 4 vertices; body has 3"));
  EXPECT_TRUE(Has(errors("weights: 'other.json#n'"), "other.json has no map \"n\""));
  EXPECT_TRUE(Has(errors("weights: 'bad.json#m'"), "bad.json")) << errors("weights: 'bad.json#m'");
  EXPECT_TRUE(Has(errors("weights: 'nobody.json#m'"), "nobody.json")) << errors("weights: 'nobody.json#m'");
  EXPECT_TRUE(Has(errors("members: {vertices: '0:9'}"),
                  "vertices: \"0:9\" is none of body: expected numbers and ranges from 0 to 2"));
  EXPECT_TRUE(Has(errors("members: {vertices: '2:0'}"), "is none of body"));
  EXPECT_TRUE(
      Has(errors("members: {primitive: 1}"), "primitive: expected a whole number from 0 to 0, found 1"));
  EXPECT_TRUE(
      Has(errors("members: {material: Skim}"), "body has no material \"Skim\" (did you mean \"Skin\"?)"));
  EXPECT_TRUE(Has(errors("members: {joint: node3}"), "\"node3\" is no joint of the skin of body"));
  EXPECT_TRUE(Has(errors("members: {jiont: tip}"), "unknown key \"jiont\" (did you mean \"joint\"?)"));
  EXPECT_TRUE(Has(errors("members: some"), "members: expected all,"));
  EXPECT_TRUE(Has(errors("falloff: {at: tip, radius: 0}"), "radius: expected a length above 0"));
}

TEST_F(RigBuilderTest, DeformsLatticePoints) {
  const Rig rig = Loaded(R"(nodes:
  cage: {type: lattice, divisions: [2, 2, 3]}
  handle: {type: transform}
  l: {type: cluster, matrix: handle.worldMatrix, members: {vertices: "0:3"}}
deform:
  - {points: cage.points, stack: [l]}
  - {meshes: [body], stack: [gltf, cage]}
)");
  EXPECT_EQ(Driver(rig, "cage.points"), "l.outPoints[0]");
  const Value points = Held(rig, "l.inPoints");
  ASSERT_NE(points.points(), nullptr);
  ASSERT_EQ(points.points()->count(), 12u);
  EXPECT_EQ(points.points()->view().x[1], 1);
  EXPECT_EQ(points.points()->view().z[4], 0.5f);
  // The box is around the mesh at rest: x 0 to 1, y 1 to 2 or so, with a little margin
  const Double3 low = Held(rig, "cage.boxMin").get<Double3>(), high = Held(rig, "cage.boxMax").get<Double3>();
  EXPECT_NEAR(low.y, 1, 1e-2);
  EXPECT_NEAR(high.y, 2, 1e-2);
  const Matrix4 placed = Held(rig, "l.geometryMatrix[0]").get<Matrix4>();
  EXPECT_TRUE(Length(TransformPoint(placed, {1, 1, 1}) - high) < 1e-12);
  EXPECT_EQ(Held(rig, "l.space").AsInt(), 1);
  EXPECT_TRUE(Has(Errors("nodes: {l: {type: cluster}}\ndeform: [{points: tip.translate, stack: [l]}]\n"),
                  "tip.translate is no points input"));
  EXPECT_TRUE(Has(Errors("nodes: {l: {type: cluster}, cage: {type: lattice}}\ndeform: [{points: cage.points, "
                         "stack: [l, skin]}]\n"),
                  "\"cage\" has no members"));
}

TEST_F(RigBuilderTest, ControlsAreChecked) {
  const Rig rig = Loaded(
      "units: {length: cm}\ncontrols:\n  tip.rotateX: {min: -90, max: 0.5rad}\n  root.translateY: {min: -1, "
      "max: 1}\n  body.weight[up]: {min: 0, max: 1}\n");
  ASSERT_EQ(rig.controls.size(), 3u);
  EXPECT_DOUBLE_EQ(rig.controls[0].min, -kPi / 2);
  EXPECT_DOUBLE_EQ(rig.controls[0].max, 0.5);
  EXPECT_FALSE(rig.controls[0].by_clip);
  EXPECT_DOUBLE_EQ(rig.controls[1].max, 0.01);
  EXPECT_TRUE(rig.controls[2].by_clip);
  EXPECT_DOUBLE_EQ(rig.controls[2].value, 0.5);  // the file's default weight
  const std::string text =
      Errors(R"(nodes: {mush: {type: deltaMush}, r: {type: remapValue, input: tip.rotateY}}
connections: [r.outValue -> tip.scaleX]
deform: [{meshes: [body], stack: [gltf, mush]}]
controls:
  tip.rotateX: {min: 3, max: -25}
  tip.rotate: {min: 0, max: 1}
  tip.rotate.x: {min: 0, max: 1}
  tip.scaleX: {min: 0, max: 1}
  mush.iterations: {min: 0, max: 1}
  mush.envelope: {min: 0, max: 2}
  tip.matrix: {min: 0, max: 1}
  body.weight[upp]: {min: 0, max: 1}
  nobody.rotateX: {min: 0, max: 1}
)");
  EXPECT_TRUE(Has(text, "t.yaml:7:22: control \"tip.rotateX\": min 3 is above max -25")) << text;
  EXPECT_TRUE(Has(text, "t.yaml:8:3: tip.rotate is a double3; a control is one number, as in tip.rotate.x"))
      << text;
  EXPECT_TRUE(Has(text, "t.yaml:9:3: \"tip.rotate.x\" and \"tip.rotateX\" are the same control")) << text;
  EXPECT_TRUE(Has(text, "t.yaml:10:3: tip.scale.x is driven by r.outValue")) << text;
  EXPECT_TRUE(Has(text, "t.yaml:11:3: mush.iterations is structural")) << text;
  EXPECT_TRUE(Has(text, "t.yaml:12:24: control \"mush.envelope\": mush.envelope only takes 0 to 1")) << text;
  EXPECT_TRUE(Has(text, "t.yaml:13:3: tip.matrix is an output")) << text;
  EXPECT_TRUE(Has(text, "t.yaml:14:3: body_blendShape.weight has no element \"upp\" (did you mean \"up\"?)"))
      << text;
  EXPECT_TRUE(Has(text, "t.yaml:15:3: unknown node \"nobody\"")) << text;
}

TEST_F(RigBuilderTest, OverridesChangeWhatWasSet) {
  folder.Write("base.yaml", R"(kpsa: 1
nodes:
  mush: {type: deltaMush, iterations: 10}
  cage: {type: lattice, divisions: [2, 2, 2]}
  l: {type: cluster, members: {vertices: 0}}
  r: {type: remapValue, input: tip.translateX}
  s: {type: remapValue, input: tip.translateX}
connections: ["r.outValue -> cage.points[0].x"]
deform: [{meshes: [body], stack: [gltf, cage, l, mush]}]
)");
  Rig rig = Loaded(R"(include: [base.yaml]
overrides:
  mush.iterations: 12
  cage.divisions: [3, 2, 2]
  l.members: {vertices: "1:2"}
  r.input: 0.5
  s.input: tip.translateY
  body.weight[up]: 0.75
  tip.translateX: 2cm
)");
  EXPECT_EQ(Held(rig, "mush.iterations").AsInt(), 12);
  EXPECT_EQ(Held(rig, "cage.divisions").get<std::vector<std::int64_t>>()[0], 3);
  const auto& weights = Held(rig, "l.weights").asset<WeightMap>()->weights();
  EXPECT_EQ(std::count(weights.begin(), weights.end(), 1.0f), 2);
  EXPECT_EQ(Driver(rig, "r.inputValue"), "");
  EXPECT_DOUBLE_EQ(Held(rig, "r.inputValue").AsDouble(), 0.5);
  EXPECT_EQ(Driver(rig, "s.inputValue"), "tip.translate.y");
  EXPECT_EQ(Driver(rig, "body.weight[up]"), "");
  EXPECT_DOUBLE_EQ(Held(rig, "tip.translate.x").AsDouble(), 0.02);
  ASSERT_TRUE(SetClip(&rig, "wave").ok());
  EXPECT_EQ(Driver(rig, "body.weight[up]"), "");  // stays overridden
  EXPECT_TRUE(Has(Errors("overrides: {mosh.iterations: 3}\n"), "unknown node \"mosh\""));
}

TEST_F(RigBuilderTest, SettingsFromOutside) {
  Rig rig = Loaded(
      "units: {length: cm}\nnodes: {r: {type: remapValue, input: tip.translateX}, a: {type: transform}}\n");
  Result<Setting> setting = ParseSetting(rig, "tip.rotateX=-90");
  ASSERT_TRUE(setting.ok()) << setting.status().ToString();
  EXPECT_DOUBLE_EQ(setting->value.AsDouble(), -kPi / 2);
  ASSERT_TRUE(ApplySetting(&rig, *setting).ok());
  EXPECT_DOUBLE_EQ(Held(rig, "tip.rotate.x").AsDouble(), -kPi / 2);
  setting = ParseSetting(rig, "a.translate=[1, 2mm, 0]");
  ASSERT_TRUE(setting.ok()) << setting.status().ToString();
  EXPECT_EQ(setting->value.get<Double3>(), (Double3{0.01, 0.002, 0}));
  setting = ParseSetting(rig, "a.rotateOrder=zyx");
  ASSERT_TRUE(setting.ok());
  EXPECT_EQ(setting->value.AsInt(), 5);
  setting = ParseSetting(rig, "body.weight[up]=1");
  ASSERT_TRUE(setting.ok());
  ASSERT_TRUE(ApplySetting(&rig, *setting).ok());  // takes over from the clip
  EXPECT_EQ(Driver(rig, "body.weight[up]"), "");
  ASSERT_TRUE(SetClip(&rig, "wave").ok());
  EXPECT_EQ(Driver(rig, "body.weight[up]"), "");

  const auto failure = [&](std::string_view text) {
    const Status status = ParseSetting(rig, text).status();
    EXPECT_EQ(status.kind(), ErrorKind::kUsage) << text;
    return status.ToString();
  };
  EXPECT_TRUE(Has(failure("tip.rotateX"), "expected plug=value"));
  EXPECT_TRUE(Has(failure("tip.rotatX=3"), "has no attribute \"rotatX\""));
  EXPECT_TRUE(Has(failure("tip.rotateX=3parsec"), "unknown unit"));
  EXPECT_TRUE(Has(failure("tip.worldMatrix=3"), "is an output"));
  setting = ParseSetting(rig, "r.input=3");
  ASSERT_TRUE(setting.ok());
  EXPECT_TRUE(Has(ApplySetting(&rig, *setting).ToString(), "is driven by"));

  Result<std::vector<Setting>> pose = ReadPoseFile(
      rig,
      folder.Write("p.yaml", "kpsa: 1\nunits: {length: mm}\npose: {a.translateX: 5, tip.rotateY: 1rad}\n"));
  ASSERT_TRUE(pose.ok()) << pose.status().ToString();
  ASSERT_EQ(pose->size(), 2u);
  EXPECT_DOUBLE_EQ((*pose)[0].value.AsDouble(), 0.005);
  const std::string bad =
      Short(ReadPoseFile(
                rig, folder.Write("p.yaml", "kpsa: 1\npose:\n  a.translatX: 5\n  a.rotateX: [1]\nposes: 1\n"))
                .status()
                .ToString());
  EXPECT_TRUE(Has(bad, "p.yaml:3:3: ")) << bad;
  EXPECT_TRUE(Has(bad, "p.yaml:4:14: ")) << bad;
  EXPECT_TRUE(Has(bad, "unknown key \"poses\" (did you mean \"pose\"?)")) << bad;
}

TEST_F(RigBuilderTest, ABadCharacterIsNamedByTheRig) {
  folder.Write("c.gltf", "{}");
  const std::string text = Errors("");
  EXPECT_TRUE(Has(text, "t.yaml:2:12: the character cannot be read")) << text;
  EXPECT_TRUE(Has(text, "c.gltf")) << text;
}

TEST_F(RigBuilderTest, NamesWithDotsAndSpaces) {
  GltfBuilder builder = GltfBuilder::Character();
  builder.root["nodes"][1]["name"] = "upper arm.L";
  builder.root["nodes"][2]["name"] = "upper arm";
  builder.root["nodes"][0]["name"] = "3D body";
  folder.Write("c.gltf", builder.Text());
  const Rig rig = Loaded(R"(nodes:
  r: {type: remapValue, input: upper arm.L.rotateX}
  s: {type: remapValue, input: 3D body.translateX}
connections:
  - upper arm.translate -> upper arm.L.translate
controls: {"3D body.weight[up]": {min: 0, max: 1}}
)");
  EXPECT_EQ(Driver(rig, "upper arm.L.translate"), "upper arm.translate");
  EXPECT_EQ(Driver(rig, "unitConversion1.input"), "upper arm.L.rotate.x");
  EXPECT_EQ(Driver(rig, "s.inputValue"), "3D body.translate.x");
}

// Bytes changed, removed and copied at random: never a crash, and every error has a message.
TEST_F(RigBuilderTest, SurvivesRandomDamage) {
  const std::string good = R"(units: {length: cm}
include: [part.yaml]
nodes:
  c: {type: curve, vertices: [0, 1, 2], parent: root}
  h: {type: transform, at: "c[1]", parent: tip, translate: [1, tip.rotateX, 0]}
  w: {type: wire, curve: c, dropoff: 2, members: {joint: tip, above: 0.05}, falloff: {at: h, radius: 20}}
  cage: {type: lattice, divisions: [3, 3, 3], members: {vertices: "0:1,2"}}
  cage2: {type: lattice, divisions: [3, 3, 3]}
  r: {type: remapValue, input: tip.poseRotateX, inputMax: -25}
  mush: {type: deltaMush, iterations: 3}
  l: {type: cluster, matrix: h.worldMatrix}
connections:
  - h.translate -> c.cv[1]
  - r.outValue -> cage2.points[2,0,1].y
deform:
  - {meshes: [body], stack: [morph, w, skin, cage, cage2, mush]}
  - {points: cage.points, stack: [l]}
controls:
  tip.rotateX: {min: -25, max: 3}
  body.weight[up]: {min: 0, max: 1}
accelerate:
  face: {points: [body@mush], space: root, tolerance: 0.2mm, train: {samples: 20}, test: {clips: [wave]}}
overrides: {mush.iterations: 12, w.dropoff: 3}
)";
  folder.Write("part.yaml", "kpsa: 1\nnodes: {p: {type: transform}}\n");
  ASSERT_TRUE(Load(good).ok()) << Errors(good);
  std::mt19937 random(5);
  const std::string alphabet = " \n:{}[],.#\"'&*!|>-0123456789abcxyz@\t";
  int failures = 0;
  for (int round = 0; round < 400; ++round) {
    std::string text = good;
    for (unsigned change = 0; change <= random() % 3; ++change) {
      const std::size_t at = random() % text.size();
      switch (random() % 4) {
        case 0:
          text[at] = alphabet[random() % alphabet.size()];
          break;
        case 1:
          text.erase(at, 1 + random() % 8);
          break;
        case 2:
          text.insert(at, 1, alphabet[random() % alphabet.size()]);
          break;
        default:
          text.insert(at, text.substr(random() % text.size(), random() % 40));
          break;
      }
    }
    const Result<Rig> rig = Load(text);
    if (rig.ok()) continue;
    ++failures;
    for (const Error& error : rig.status().errors()) EXPECT_FALSE(error.message.empty());
  }
  EXPECT_GT(failures, 200);
}

TEST_F(RigBuilderTest, AFloodOfErrorsIsCutShort) {
  std::string text = "connections:\n";
  for (int i = 0; i < 20000; ++i) text += fmt::format("  - nobody{}.x -> nobody.y\n", i);
  const Result<Rig> rig = Load(text);
  ASSERT_FALSE(rig.ok());
  EXPECT_LE(rig.status().errors().size(), 110u);
}

}  // namespace
}  // namespace kpsa
