// Rigs that are odd and that the rules of the rig format allow: each rule in ways that an author may come to.
#include "tests/rig/odd_rigs.h"
#include "tests/support/shared_files.h"

namespace kpsa::engine {
namespace {

// --- Names
TEST_F(OddRigs, NamesOfQuotesBracketsDotsAndArrows) {
  GltfBuilder b = Builder({"The \"body\" [x]", "root.001", "upper arm.L", "upper arm.L.translate",
                           "Körper 骨", "it's", "a -> b"});
  b.root["meshes"][0]["extras"]["targetNames"] = {"say \"oh\".b[c]"};
  b.root["animations"][0]["name"] = "walk 'n' [run]";
  folder.Write("c.gltf", b.Text());
  const Rig rig = Sound(R"(nodes:
  "rig [node].x": {type: transform, parent: upper arm.L, at: upper arm.L.translate}
  r: {type: remapValue, input: upper arm.L.rotateX}
  s: {type: remapValue, input: "upper arm.L.translate.rotateX"}
  m: {type: deltaMush}
  c: {type: cluster, matrix: "rig [node].x.worldMatrix", parent: root.001, members: {joint: upper arm.L, above: 10%}}
  d: {type: cluster, members: {material: "Eye [l]"}}
connections:
  - {from: a -> b.translate, to: "rig [node].x.translate"}
  - {from: r.outValue, to: 'The "body" [x].weight[say "oh".b[c]]', override: true}
deform:
  - {meshes: ['The "body" [x]', Körper 骨], stack: [morph, skin, c, d, m]}
  - {meshes: [it's], stack: [gltf]}
controls:
  'Körper 骨.weight[say "oh".b[c]]': {min: 0, max: 1}
  upper arm.L.translate.translateX: {min: -1, max: 1}
accelerate:
  x: {points: ['The "body" [x]@m', "Körper 骨@m"], space: upper arm.L, test: {clips: ["walk 'n' [run]"]}}
)");
  EXPECT_EQ(Driver(rig, "unitConversion1.input"), "upper arm.L.rotate.x");
  EXPECT_EQ(Driver(rig, "unitConversion2.input"), "upper arm.L.translate.rotate.x");
  EXPECT_EQ(Driver(rig, "rig [node].x.translate"), "a -> b.translate");
  ASSERT_EQ(rig.controls.size(), 2u);
  EXPECT_EQ(rig.graph->PlugName(rig.controls[1].plug), "upper arm.L.translate.translate.x");
  ASSERT_EQ(rig.accelerate.size(), 1u);
  EXPECT_EQ(rig.accelerate[0].points.size(), 2u);
}

TEST_F(OddRigs, SharedNamesByIndexAndPath) {
  Names({"x", "x", "x", "lone", "x", "x", "x#1"});
  const Rig rig = Sound(R"(nodes:
  t: {type: transform, parent: "x#2", at: /x/lone/x}
  u: {type: transform, parent: /x/lone}
  m: {type: deltaMush}
  n: {type: deltaMush}
deform: [{meshes: ["x#0", "x#4"], stack: [gltf, m]}, {meshes: ["x#5"], stack: [n]}]
)");
  EXPECT_EQ(Driver(rig, "t.parentMatrix"), "x#2.worldMatrix");
  const std::string text =
      Errors(R"(nodes: {t: {type: transform, parent: x}, r: {type: remapValue, input: x.rotateX}}
deform: [{meshes: [x], stack: [gltf]}]
)");
  EXPECT_TRUE(Has(text, "t.yaml:3:38: \"x\" is the name of several transforms: write x#1# or x#2")) << text;
  EXPECT_TRUE(Has(text, "t.yaml:3:71: \"x\" is the name of several nodes: write x#0 or x#1# or x#2")) << text;
  EXPECT_TRUE(Has(text, "t.yaml:4:20: \"x\" is the name of several meshes: write x#0 or x#4 or x#5")) << text;
}

TEST_F(OddRigs, NamesThatAreMissingOrNumbers) {
  Names({"", "root", "3", "", "", "", "1.5"});
  const Rig rig = Sound(R"(nodes:
  t: {type: transform, parent: node3, at: "3"}
  r: {type: remapValue, input: 3.rotateX}
  q: {type: remapValue, input: 1.5.rotateX, inputMin: 1.5}
deform: [{meshes: [node0, node4], stack: [gltf]}, {meshes: [node5], stack: [gltf]}]
)");
  EXPECT_EQ(Driver(rig, "unitConversion1.input"), "3.rotate.x");
  EXPECT_EQ(Driver(rig, "unitConversion2.input"), "1.5.rotate.x");
  EXPECT_DOUBLE_EQ(Held(rig, "q.inputMin").AsDouble(), 1.5);
}

TEST_F(OddRigs, NamesThatAreWordsOfTheFormat) {
  Names({"a@b", "root", " lead", "trail ", "morph", "time", "skin"});
  const Rig rig = Sound(R"(nodes:
  mush: {type: deltaMush}
  "@": {type: deltaMush}
  t: {type: transform, parent: " lead", at: "trail "}
  r: {type: remapValue, input: skin.rotateX}
  k: {type: remapValue, input: time.time}
deform: [{meshes: [a@b, morph], stack: [morph, skin, mush]}, {meshes: [time], stack: ["@"]}]
accelerate: {f: {points: [a@b@mush, morph@skin, "time@@"]}}
controls: {time.translateX: {min: 0, max: 1}}
)");
  EXPECT_EQ(Driver(rig, "k.inputValue"), "time.time");
  ASSERT_EQ(rig.controls.size(), 1u);
  EXPECT_EQ(rig.controls[0].plug.node, rig.scene.transforms[5]);
  ASSERT_EQ(rig.accelerate.size(), 1u);
  ASSERT_EQ(rig.accelerate[0].points.size(), 3u);
  EXPECT_EQ(rig.accelerate[0].points[2].stage, 1u);
}

TEST_F(OddRigs, MeshesTransformsAndJointsAreLookedUpAmongTheirOwn) {
  if (SharedFile("assets/robot.glb").empty()) GTEST_SKIP() << "no assets beside the checkout";
  const std::string character = SharedFile("assets/robot.glb");
  const auto load = [&](const std::string& text) {
    return LoadRig(StandardRegistry(),
                   folder.Write("r.yaml", "kpsa: 1\ncharacter: " + character + "\n" + text));
  };
  const Result<Rig> rig = load(R"(nodes:
  h: {type: transform, parent: Head, at: Head}
  c: {type: cluster, matrix: h.worldMatrix, parent: Head, members: {joint: Head}}
  r: {type: remapValue, input: Head#1.rotateX}
  p: {type: remapValue, input: /RobotArmature/Bone/Body/Hips/Abdomen/Torso/Neck/Head.rotateX}
deform: [{meshes: [Head], stack: [gltf, c]}, {meshes: [/RobotArmature/Hand.L, Foot.L], stack: [skin]}]
accelerate: {a: {points: [Head@c], space: Head}, b: {points: [Hand.L@skin], space: Palm2.L}}
)");
  ASSERT_TRUE(rig.ok()) << rig.status().ToString();
  EXPECT_EQ(Driver(*rig, "h.parentMatrix"), "Head#1.worldMatrix");
  EXPECT_EQ(Driver(*rig, "c.inPoints"), "Head_skinCluster.outPoints[0]");
  EXPECT_EQ(Driver(*rig, "unitConversion2.input"), "Head#1.rotate.x");
  EXPECT_EQ(rig->accelerate.size(), 2u);
  const std::string tie = load("nodes: {r: {type: remapValue, input: Head.rotateX}}\n").status().ToString();
  EXPECT_TRUE(Has(tie, "\"Head\" is the name of several nodes: write Head#1 or Head#49")) << tie;
}

// --- Plugs and values
TEST_F(OddRigs, TheOrderOfKeysDoesNotMatter) {
  Plain();
  Rig rig = Sound(R"(nodes:
  cage: {"points[2,1,1].y": 1.5, "points[0,0,0]": [0, 0, 0.25], divisions: [3, 2, 2], type: lattice}
deform: [{meshes: [body], stack: [gltf, cage]}]
)");
  EXPECT_DOUBLE_EQ(Held(rig, "cage.points[11].y").AsDouble(), 1.5);
  rig = Sound(R"(nodes: {cage: {type: lattice}}
deform: [{meshes: [body], stack: [gltf, cage]}]
overrides: {"cage.points[2,1,1].y": 1.5, cage.divisions: [3, 2, 2]}
)");
  EXPECT_DOUBLE_EQ(Held(rig, "cage.points[11].y").AsDouble(), 1.5);
}

TEST_F(OddRigs, SumsAndProductsAreTheDefaults) {
  Plain();
  Loaded(R"(nodes:
  p: {type: plusMinusAverage, input: [1, 2, 4]}
  q: {type: multiplyDivide, input1: [p.output, 1, 1], input2: [2, 3, 4]}
  t: {type: transform, translate: q.output}
)");
  RigPlayer player(folder / "t.yaml");
  ASSERT_TRUE(player.ok());
  const Matrix4 world = player.World("t");
  EXPECT_EQ((Double3{world(0, 3), world(1, 3), world(2, 3)}), (Double3{14, 3, 4}));
}

TEST_F(OddRigs, ConnectionsOfEveryKind) {
  Plain();
  const Rig rig = Sound(R"(nodes:
  p: {type: plusMinusAverage, input: [tip.rotateX, 3, mid.translateY], operation: average}
  q: {type: multiplyDivide, input1: tip.translate, input2: [2, 2, 2]}
  c: {type: condition, firstTerm: tip.rotateX, secondTerm: 10, operation: greaterThan, colorIfTrue: q.output, colorIfFalse: [0, tip.rotateY, 0]}
  ch: {type: choice, selector: 1, input: [p.output, c.outColorX]}
  dm: {type: decomposeMatrix, inputMatrix: mid.worldMatrix}
  cm: {type: composeMatrix, inputTranslate: dm.outputTranslate, inputRotate: tip.rotate}
  mm: {type: multMatrix, matrixIn: [cm.outputMatrix, tip.worldInverseMatrix]}
  k: {type: animCurve, input: time.time, keyTimes: [0, 0.5], keyValues: [0, 5], interpolation: smooth}
  t: {type: transform, offsetParentMatrix: mm.matrixSum, translateY: k.output, rotateZ: ch.output}
)");
  EXPECT_EQ(Driver(rig, "ch.input[1]"), "c.outColor.x");
  EXPECT_EQ(Held(rig, "k.keyTimes").get<std::vector<double>>(), (std::vector<double>{0, 0.5}));
}

TEST_F(OddRigs, NumbersAsAuthorsWriteThem) {
  Plain();
  const Rig rig = Sound(R"(units: {length: mm, angle: rad}
fps: 23.976
nodes:
  t: {type: transform, translate: [1e+3, +2, -.5], rotate: [9e1deg, 90 deg, -0rad], scale: [50%, "2", '3']}
  u: {type: "transform", translateX: tip.rotateY}
overrides: {time.time: 12f}
)");
  EXPECT_EQ(Held(rig, "t.translate").get<Double3>(), (Double3{1, 0.002, -0.0005}));
  EXPECT_NEAR(Held(rig, "t.rotate").get<Double3>().x, 1.5707963267948966, 1e-15);
  EXPECT_EQ(Held(rig, "t.scale").get<Double3>(), (Double3{0.5, 2, 3}));
  EXPECT_DOUBLE_EQ(Held(rig, "time.time").AsDouble(), 12 / 23.976);
  EXPECT_DOUBLE_EQ(Held(rig, "unitConversion1.conversionFactor").AsDouble(), 0.001);  // 1 rad becomes 1 mm
}

TEST_F(OddRigs, SectionsWithoutContentAreEmpty) {
  Plain();
  Sound("nodes:\ndeform:\ncontrols:\nconnections:\noverrides:\naccelerate:\ninclude:\n");
  Sound("nodes: {}\ndeform: []\ncontrols: {}\nconnections: []\noverrides: {}\naccelerate: {}\ninclude: []\n");
}

TEST_F(OddRigs, BracketsInListsAreExplained) {
  Plain();
  const std::string text =
      Errors("connections: [tip.rotateX -> body.weight[up], mid.rotate -> tip.rotate]\n");
  EXPECT_TRUE(Has(text, "t.yaml:3:") && Has(text, "quote plugs that contain [ ]")) << text;
}

// --- Overrides
TEST_F(OddRigs, OverridesOfWholesAndParts) {
  Plain();
  const Rig rig = Sound(R"(nodes:
  a: {type: transform}
  t: {type: transform, translate: [a.translateX, 0, 1], rotate: a.rotate}
  u: {type: transform}
  p: {type: plusMinusAverage, input: [1, a.translateX, 3]}
connections: [a.scale -> u.scale, a.translate -> u.translate]
overrides: {t.translate: [4, 5, 6], t.rotateX: 7, u.scale.y: 3, u.translateZ: tip.translateX, p.input: [5, a.translateY]}
)");
  EXPECT_EQ(Held(rig, "t.translate").get<Double3>(), (Double3{4, 5, 6}));
  EXPECT_EQ(Driver(rig, "t.translate.x"), "");
  EXPECT_EQ(Driver(rig, "t.rotate"), "");
  EXPECT_EQ(Driver(rig, "t.rotate.x"), "");
  EXPECT_EQ(Driver(rig, "t.rotate.y"), "a.rotate.y");
  EXPECT_EQ(Driver(rig, "u.scale.y"), "");
  EXPECT_EQ(Driver(rig, "u.scale.z"), "a.scale.z");
  EXPECT_EQ(Driver(rig, "u.translate.z"), "tip.translate.x");
  EXPECT_EQ(Driver(rig, "u.translate.x"), "a.translate.x");
  EXPECT_DOUBLE_EQ(Held(rig, "p.input[0]").AsDouble(), 5);
  EXPECT_EQ(Driver(rig, "p.input[1]"), "a.translate.y");
  EXPECT_TRUE(Held(rig, "p.input[2]").empty());
}

TEST_F(OddRigs, OverridesOfParentsPlacesEnumsAndPoints) {
  Plain();
  const Rig rig = Sound(R"(nodes:
  t: {type: transform, parent: tip, at: mid}
  cage: {type: lattice, parent: t, divisions: [2, 2, 2], interpolation: linear}
deform: [{meshes: [body, twin], stack: [gltf, cage]}]
overrides:
  t.parent: root
  t.at: [1, 2, 3]
  cage.interpolation: bspline
  cage.points: [[0,0,0],[1,0,0],[0,1,0],[1,1,0],[0,0,1],[1,0,1],[0,1,1],[1,1,1.5]]
  "cage.points[1,1,1].z": 1.25
)");
  EXPECT_EQ(Driver(rig, "t.parentMatrix"), "root.worldMatrix");
  EXPECT_EQ(Held(rig, "t.offsetParentMatrix").get<Matrix4>(),
            Translation({1, 1, 3}));  // root stands at (0, 1, 0)
  EXPECT_EQ(Held(rig, "cage.interpolation").AsInt(), 1);
}

TEST_F(OddRigs, OverriddenPointsGoThroughTheirStack) {
  Plain();
  const std::string text = R"(nodes:
  cage: {type: lattice, divisions: [2, 2, 2], parent: root}
  h: {type: transform, parent: root}
  c: {type: cluster, parent: root, matrix: h.worldMatrix}
deform: [{points: cage.points, stack: [c]}, {meshes: [body], stack: [gltf, cage]}]
)";
  for (const char* overrides :
       {"overrides: {\"cage.points[1,1,1].y\": 1.5}\n",
        "overrides: {cage.points: [[0,0,0],[1,0,0],[0,1,0],[1,1,0],[0,0,1],[1,0,1],[0,1,1],[1,1.5,1]]}\n"}) {
    const Rig rig = Sound(text + overrides);
    EXPECT_EQ(Driver(rig, "cage.points"), "c.outPoints[0]");
    const Value in = Held(rig, "c.inPoints");
    ASSERT_NE(in.points(), nullptr);
    EXPECT_EQ(in.points()->view().y[7], 1.5f);
    EXPECT_EQ(in.points()->view().y[3], 1.0f);
  }
}

TEST_F(OddRigs, OnePlugHasOneValueHoweverItIsSpelled) {
  Plain();
  const std::string text = Errors(
      "nodes:\n  r: {type: remapValue, input: 1, inputValue: 2}\noverrides:\n  tip.translateX: 1\n  "
      "tip.translate.x: 2\n  r.inputMax: 2\n");
  EXPECT_TRUE(Has(text, "t.yaml:4:47: r.inputValue is set twice: here and at t.yaml:4:32")) << text;
  EXPECT_TRUE(Has(text, "t.yaml:7:20: tip.translate.x is overridden twice: here and at t.yaml:6:19")) << text;
}

TEST_F(OddRigs, SettingsDoNotHideBehindConnections) {
  Plain();
  Rig rig = Loaded("nodes:\n  t: {type: transform, translate: [tip.translateX, 0, 0], rotate: tip.rotate}\n");
  for (const char* text : {"t.translate=[1, 2, 3]", "t.translateX=1", "t.rotateY=2", "t.rotate=[1, 2, 3]"}) {
    const Result<Setting> setting = ParseSetting(rig, text);
    ASSERT_TRUE(setting.ok()) << setting.status().ToString();
    EXPECT_TRUE(Has(ApplySetting(&rig, *setting).ToString(), "is driven by tip.")) << text;
  }
  const Result<Setting> free = ParseSetting(rig, "t.translateY=1");
  ASSERT_TRUE(free.ok());
  EXPECT_TRUE(ApplySetting(&rig, *free).ok());
}

// --- Files and acceleration
TEST_F(OddRigs, IncludesInSubfoldersHaveTheirOwnUnitsAndPaths) {
  Plain();
  folder.Write("parts/one.yaml", R"(kpsa: 1
units: {length: mm}
include: deep/two.yaml
nodes: {up: {type: transform, parent: tip, translate: [1, 2, 3]}}
overrides: {w.dropoff: 700}
)");
  folder.Write("parts/deep/two.yaml", R"(kpsa: 1
units: {length: cm, angle: rad}
nodes:
  l2: {type: curve, vertices: "0:2", mesh: body}
  w: {type: wire, curve: l2, dropoff: 40, weights: "../../w.json#m"}
  turn: {type: transform, rotateX: 1}
deform: [{meshes: [body], stack: [gltf, w]}]
accelerate: {f: {points: [body@w], subspace: f.kpsa, tolerance: 1}}
)");
  folder.Write(
      "w.json",
      R"({"kpsa": "weights", "version": 1, "mesh": "body", "points": 6, "maps": {"m": {"default": 1, "indices": [], "values": []}}})");
  const Rig rig = Sound("include: [parts/one.yaml]\nconnections: [\"up.translate -> l2.cv[2]\"]\n");
  EXPECT_DOUBLE_EQ(Held(rig, "w.dropoff").AsDouble(), 0.7);
  EXPECT_DOUBLE_EQ(Held(rig, "turn.rotate.x").AsDouble(), 1);
  EXPECT_DOUBLE_EQ(Held(rig, "up.translate").get<Double3>().z, 0.003);
  ASSERT_EQ(rig.accelerate.size(), 1u);
  EXPECT_DOUBLE_EQ(rig.accelerate[0].tolerance, 0.01);
  EXPECT_EQ(Short(rig.accelerate[0].subspace), "parts/deep/f.kpsa");
  EXPECT_EQ(rig.files.size(), 5u);
}

TEST_F(OddRigs, SeveralAccelerations) {
  Plain();
  const Rig rig = Sound(R"(nodes: {m: {type: deltaMush}, m@1: {type: deltaMush}}
deform: [{meshes: [body, twin], stack: [gltf, m, m@1]}]
controls: {tip.rotateX: {min: -10, max: 10}}
accelerate:
  one: {points: body@m@1, subspace: one.kpsa}
  two: {points: [twin@gltf], subspace: sub/two.kpsa, space: tip, tolerance: 0.1, violationRate: 0.5%, train: {samples: 100}, test: {clips: wave}}
  three: {points: [prop@transform]}
)");
  ASSERT_EQ(rig.accelerate.size(), 3u);
  EXPECT_EQ(rig.graph->PlugName(rig.accelerate[0].points[0].points), "m@1.outPoints[0]");
  EXPECT_EQ(rig.graph->PlugName(rig.accelerate[1].points[0].points), "twin_skinCluster.outPoints[0]");
  EXPECT_DOUBLE_EQ(rig.accelerate[1].violation_rate, 0.005);
  EXPECT_TRUE(rig.notes.empty()) << rig.notes.front();
}

TEST_F(OddRigs, AccelerationsOfOneFileAreNoted) {
  Plain();
  const Rig rig = Sound(R"(controls: {tip.rotateX: {min: -10, max: 10}}
accelerate:
  one: {points: body@gltf, subspace: one.kpsa}
  two: {points: twin@gltf, subspace: ./one.kpsa}
)",
                        1);
  ASSERT_EQ(rig.notes.size(), 1u);
  EXPECT_NE(rig.notes[0].find("accelerate \"one\" and \"two\" have one subspace file"), std::string::npos)
      << rig.notes[0];
}

TEST_F(OddRigs, AnchorsRepeatANode) {
  Plain();
  const Rig rig = Sound(
      "nodes:\n  m: &mush {type: deltaMush, iterations: 3}\n  n: *mush\ndeform: [{meshes: [body], stack: "
      "[gltf, m, n]}]\n");
  EXPECT_EQ(Held(rig, "n.iterations").AsInt(), 3);
}

// What only a compiler can find is said of the line that wrote the node.
TEST_F(OddRigs, ErrorsOfTheCompilerHaveAPlace) {
  Plain();
  Result<Rig> rig = Load(
      "nodes:\n  \"a\\\" (b\": {type: lattice, divisions: [40, 2, 2]}\ndeform: [{meshes: [body], stack: "
      "[gltf, 'a\" (b']}]\n");
  ASSERT_TRUE(rig.ok()) << rig.status().ToString();
  Compiler compiler;
  Request request;
  request.outputs.push_back({rig->scene.meshes[0].points, {}});
  const auto plan = compiler.Compile(*rig->graph, request);
  ASSERT_FALSE(plan.ok());
  const Error& error = plan.status().errors().front();
  EXPECT_EQ(error.node, "a\" (b");
  EXPECT_EQ(Short(PlaceOf(*rig, error).ToString()), "t.yaml:4:3") << error.message;
  EXPECT_EQ(Short(PlaceOf(*rig, Error{{}, {}, "", "body_skinCluster"}).ToString()), "t.yaml");
  EXPECT_EQ(Short(PlaceOf(*rig, Error{}).ToString()), "t.yaml");
}

}  // namespace
}  // namespace kpsa::engine
