// What a rig becomes in the graph, and every diagnostic that needs the registry or the character.
#include "rig/build/rig_builder.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "base/matrix.h"
#include "base/scalar_math.h"
#include "tests/rig/rig_fixture.h"

namespace kpsa::engine {
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
  options.clip = std::string("nobody");
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
  EXPECT_TRUE(Has(
      text, "node \"n\" (multMatrix) has no attribute \"parent\"; kpsa nodes multMatrix tells what it has"))
      << text;
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
                  "\"body_blendShape.weight[up]\", override: true}"))
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

  Result<PoseFile> pose =
      ReadPoseFile(rig, folder.Write("p.yaml",
                                     "kpsa: 1\nunits: {length: mm}\nclip: walk\ntime: 1.5s\npose: "
                                     "{a.translateX: 5, tip.rotateY: 1rad}\n"));
  ASSERT_TRUE(pose.ok()) << pose.status().ToString();
  ASSERT_EQ(pose->settings.size(), 2u);
  EXPECT_DOUBLE_EQ(pose->settings[0].value.AsDouble(), 0.005);
  EXPECT_EQ(pose->clip, "walk");
  EXPECT_EQ(pose->time, 1.5);
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
}  // namespace kpsa::engine
