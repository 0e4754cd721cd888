// references: rigs within rigs.
#include <fmt/format.h>

#include "tests/rig/rig_player.h"
#include "tests/rig/sheets_character.h"

namespace kpsa::engine {
namespace {

const char kArmRig[] = R"yaml(kpsa: 1
units: {length: cm}
character: c.gltf
templates: {arm: {nodes: {hand: {type: transform, parent: tip}, pull: {type: cluster, matrix: hand.worldMatrix, members: {joint: tip}}}}}
use: {arm: {template: arm}}
nodes:
  loose: {type: transform, translate: [0, 0, 50]}
  soft: {type: softMod, matrix: loose.worldMatrix, falloffRadius: 90, falloffCenter: [100, 0, 0]}
  mush: {type: deltaMush, iterations: 3}
connections: [loose.rotate -> arm:hand.rotate]
deform: [{meshes: [body], stack: [morph, skin, "arm:pull", soft, mush]}]
controls: {tip.rotateX: {min: -30, max: 30}, loose.translateX: {min: 0, max: 1}}
variants: {still: {soft.envelope: 0}}
clips: {late: {layers: [{clip: wave, start: 24}], frames: [24, 96]}}
accelerate: {fast: {points: [body@mush], space: tip, subspace: sub/arm.kpsa, test: {clips: [wave]}}}
)yaml";

class References : public RigFixture {
 protected:
  References() { folder.Write("arm.yaml", kArmRig); }
  // A rig without a character of its own.
  std::string Write(const std::string& text, const std::string& name = "t.yaml") const {
    return folder.Write(name, "kpsa: 1\n" + text);
  }
  Rig LoadedAlone(const std::string& text, const RigOptions& options = {}) const {
    Result<Rig> rig = LoadRig(StandardRegistry(), Write(text), options);
    EXPECT_TRUE(rig.ok()) << rig.status().ToString();
    return rig.ok() ? std::move(*rig) : Rig();
  }
  std::string ErrorsAlone(const std::string& text, const RigOptions& options = {}) const {
    const Result<Rig> rig = LoadRig(StandardRegistry(), Write(text), options);
    return rig.ok() ? "no error" : Short(rig.status().ToString());
  }
};

std::vector<Double3> Shifted(std::vector<Double3> points, const Double3& by) {
  for (Double3& point : points) point = point + by;
  return points;
}

TEST_F(References, BringAllOfARigUnderTheirNamespace) {
  const Rig rig =
      LoadedAlone("references: {a: {file: arm.yaml}, b: {file: arm.yaml, translate: [1, 0, 0]}}\n");
  EXPECT_EQ(Driver(rig, "a:arm:hand.parentMatrix"), "a:tip.worldMatrix");
  EXPECT_EQ(Driver(rig, "b:arm:hand.rotate"), "b:loose.rotate");
  const std::string top = "root";  // a node by its path in the referenced file
  EXPECT_EQ(Driver(rig, "b:/" + top + "/node3/tip.parentMatrix"), "b:node3.worldMatrix");
  EXPECT_EQ(Driver(rig, "a:root.parentMatrix"), "a.worldMatrix");
  EXPECT_EQ(Driver(rig, "a:loose.parentMatrix"), "a.worldMatrix");
  EXPECT_EQ(Driver(rig, "a:soft.parentMatrix"), "a.worldMatrix");
  EXPECT_EQ(Held(rig, "b.translate").get<Double3>().x, 1);
  EXPECT_EQ(Held(rig, "a:loose.translate").get<Double3>().z, 0.5) << "units are those of the file";
  ASSERT_EQ(rig.scene.meshes.size(), 2u);
  EXPECT_EQ(rig.scene.meshes[1].name, "b:body");
  EXPECT_EQ(rig.scene.meshes[1].primitives[0].key, "b:body/0");
  EXPECT_EQ(rig.scene.meshes[0].stages.back().name, "mush");
  ASSERT_EQ(rig.controls.size(), 4u);
  EXPECT_EQ(rig.controls[0].name, "a:tip.rotateX");
  EXPECT_EQ(rig.controls[3].plug, *rig.graph->FindPlug("b:loose.translateX"));
  ASSERT_EQ(rig.accelerate.size(), 2u);
  EXPECT_EQ(rig.accelerate[1].name, "b:fast");
  EXPECT_EQ(rig.accelerate[1].points[0].mesh, 1u);
  EXPECT_EQ(rig.accelerate[1].space, *rig.graph->FindNode("b:tip"));
  EXPECT_EQ(rig.accelerate[1].test_clips, std::vector<std::string>{"b:wave"});
  EXPECT_EQ(Short(rig.accelerate[1].subspace), "sub/arm.kpsa");
  std::vector<std::string> clips;
  for (const CharacterClip& clip : rig.scene.clips) clips.push_back(clip.id);
  EXPECT_EQ(clips, (std::vector<std::string>{"a:wave", "a:late", "b:wave", "b:late"}));
  EXPECT_EQ(rig.files.size(), 3u) << "each file once";
  EXPECT_EQ(Short(PlaceOf(rig, Error{{}, {}, "", "b:mush"}).ToString()), "arm.yaml:9:3");
}

// What hangs under the root of a reference.
TEST_F(References, EveryParentIsTheWorldWhereNothingDrivesIt) {
  for (const std::string& type : StandardRegistry().Names()) {
    for (const AttributeDef& attribute : StandardRegistry().Find(type)->attributes) {
      if (!attribute.output && attribute.name == "parentMatrix") {
        EXPECT_TRUE(attribute.world_place) << type;
      }
    }
  }
}

TEST_F(References, AreIndependentAndTranslateMovesAllOfACharacter) {
  RigPlayer alone(folder / "arm.yaml");
  RigPlayer two(Write("references: {a: {file: arm.yaml, translate: [1, -2, 0.5]}, b: {file: arm.yaml}}\n"));
  ASSERT_TRUE(alone.ok() && two.ok());
  const Double3 there{1, -2, 0.5};
  for (const double time : {0.0, 0.7, 2.5}) {
    alone.Set("time.time", time), two.Set("time.time", time);
    EXPECT_EQ(MaxDistance(two.Points(1), alone.Points()), 0);
    EXPECT_LT(MaxDistance(two.Points(0), Shifted(alone.Points(), there)), 1e-6);
  }
  alone.Set("tip.rotateX", 0.4), two.Set("a:tip.rotateX", 0.4);
  alone.Set("loose.translateX", 0.01), two.Set("a:loose.translateX", 0.01);
  EXPECT_LT(MaxDistance(two.Points(0), Shifted(alone.Points(), there)), 1e-6);
  EXPECT_GT(MaxDistance(two.Points(1), alone.Points()), 1e-3) << "the other one stays";
  // Turned and scaled as well
  RigPlayer turned(
      Write("references: {a: {file: arm.yaml}}\noverrides: {a.rotateY: 90, a.scale: [2, 2, 2]}\n"));
  RigPlayer still(folder / "arm.yaml");
  std::vector<Double3> expected;
  for (const Double3& p : still.Points()) expected.push_back({2 * p.z, 2 * p.y, -2 * p.x});
  EXPECT_LT(MaxDistance(turned.Points(), expected), 1e-5);
}

TEST_F(References, WhatStandsInTheWorldWithoutAHandleGoesAlong) {
  const Double3 there{1, 10, 0.5};
  const auto compare = [&](const std::string& nodes, const std::string& deformer) {
    SCOPED_TRACE(nodes);
    Write("character: c.gltf\nnodes:\n  h: {type: transform}\n  " + nodes +
              "\ndeform: [{meshes: [body], stack: [skin, " + deformer +
              "]}]\ncontrols: {h.translateX: {min: 0, max: 1}}\n",
          "placed.yaml");
    RigPlayer alone(folder / "placed.yaml");
    RigPlayer moved(Write("references: {a: {file: placed.yaml, translate: [1, 10, 0.5]}}\n"));
    ASSERT_TRUE(alone.ok() && moved.ok());
    alone.Set("h.translateX", 0.3), moved.Set("a:h.translateX", 0.3);
    EXPECT_GT(MaxDistance(alone.Points(), alone.Points("skin")), 1e-3);
    EXPECT_LT(MaxDistance(moved.Points(), Shifted(alone.Points(), there)), 2e-6);
  };
  for (const char* falloff :
       {"planeFalloff, start: 0, end: 2", "planeFalloff, start: 20, end: -20", "sphereFalloff, radius: 3",
        "capsuleFalloff, radius: 3", "proximityFalloff, driver: \"body@skin\", radius: 1"})
    compare(fmt::format("near: {{type: {}}}\n  pull: {{type: cluster, matrix: h.worldMatrix, falloff: near}}",
                        falloff),
            "pull");
  for (const char* deformer : {"bend, curvature: 0.5", "twist, endAngle: 0.5", "squash, factor: 0.5",
                               "flare, endFlareX: 2", "sine, amplitude: 0.2, wavelength: 3",
                               "wave, amplitude: 0.2, wavelength: 3, maxRadius: 5", "sculpt, radius: 9"})
    compare(fmt::format("d: {{type: {}}}", deformer), "d");
}

// What follows a driver is moved by the reference once, whatever takes it to the world and however far it follows.
TEST_F(References, FollowersGoAlongOnce) {
  folder.Write("sheets.gltf", SheetsCharacter().Text());
  for (const char* stack : {"meshes: [cloth], stack: [w]", "meshes: [shirt], stack: [restSkin, w]",
                            "meshes: [shirt], stack: [restSkin]", "meshes: [shirt], stack: [skin, w]"}) {
    for (const char* type :
         {"wrap", "proximityWrap", "proximityWrap, envelope: 0.4", "proximityWrap, wrapMode: surface"}) {
      SCOPED_TRACE(fmt::format("{} {}", stack, type));
      Write(fmt::format("character: sheets.gltf\nnodes: {{w: {{type: {}, driver: cage}}}}\ndeform: [{{{}}}]\n"
                        "controls: {{tip.rotateY: {{min: -90, max: 90}}}}\n",
                        type, stack),
            "placed.yaml");
      RigPlayer alone(folder / "placed.yaml");
      RigPlayer moved(Write(
          "references: {a: {file: placed.yaml, translate: [1, 10, 0.5]}}\noverrides: {a.rotateZ: 90}\n"));
      ASSERT_TRUE(alone.ok() && moved.ok());
      alone.Set("tip.rotateY", 0.5), moved.Set("a:tip.rotateY", 0.5);
      for (std::size_t mesh = 0; mesh < 3; ++mesh) {
        std::vector<Double3> expected = alone.Points(mesh);
        for (Double3& p : expected) p = {1 - p.y, 10 + p.x, 0.5 + p.z};
        EXPECT_LT(MaxDistance(moved.Points(mesh), expected), 1e-5) << mesh;
      }
    }
  }
}

TEST_F(References, StandBesideACharacterAndAGltfFileIsARig) {
  const Rig rig = Loaded("references: {a: {file: arm.yaml}, bare: {file: c.gltf, translate: [0, 3, 0]}}\n");
  ASSERT_EQ(rig.scene.meshes.size(), 3u);
  EXPECT_EQ(rig.scene.meshes[0].name, "body");
  EXPECT_EQ(Driver(rig, "tip.parentMatrix"), "node3.worldMatrix");
  EXPECT_EQ(rig.scene.clip, "wave + a:wave + bare:wave");
  RigPlayer player(folder / "t.yaml"), alone(folder / "c.gltf");
  player.Set("time.time", 0.6), alone.Set("time.time", 0.6);
  EXPECT_EQ(MaxDistance(player.Points(0), alone.Points()), 0);
  EXPECT_LT(MaxDistance(player.Points(2), Shifted(alone.Points(), {0, 3, 0})), 1e-6);
}

TEST_F(References, ClipAndStartSayWhatPlays) {
  RigPlayer alone(folder / "c.gltf");
  const std::string path = Write(
      "fps: 10\nreferences: {a: {file: c.gltf, start: 5}, b: {file: arm.yaml, clip: late, start: 0.25s}, "
      "c: {file: c.gltf}}\n");
  RigPlayer player(path);
  ASSERT_TRUE(player.ok());
  EXPECT_DOUBLE_EQ(player.rig.playing->duration, 0.25 + 96 / 24.0);
  EXPECT_DOUBLE_EQ(player.rig.playing->begin, 0);
  RigPlayer late(folder / "arm.yaml");
  player.Set("time.time", 1.5), alone.Set("time.time", 1.0);
  EXPECT_LT(MaxDistance(player.Points(0), alone.Points()), 1e-6) << "half a second later";
  alone.Set("time.time", 1.5);
  EXPECT_EQ(MaxDistance(player.Points(2), alone.Points()), 0);
  late.Set("time.time", 0.25);
  EXPECT_LT(MaxDistance(player.Points(1), late.Points()), 1e-6)
      << "a second into late, and that begins later";
  // A chosen clip is that of one character, from the beginning; the others go on
  RigOptions options;
  options.clip = std::string("a:wave");
  RigPlayer chosen(path, options);
  EXPECT_EQ(chosen.rig.scene.clip, "a:wave");
  chosen.Set("time.time", 1.5);
  EXPECT_EQ(MaxDistance(chosen.Points(0), alone.Points()), 0);
  EXPECT_EQ(MaxDistance(chosen.Points(1), player.Points(1)), 0);
  // No clip
  options.clip.reset();
  options.rest = true;
  RigPlayer rest(path, options), alone_rest(folder / "c.gltf", options);
  for (const std::size_t mesh : {0u, 2u}) EXPECT_EQ(MaxDistance(rest.Points(mesh), alone_rest.Points()), 0);
  EXPECT_TRUE(Has(ErrorsAlone("references: {a: {file: c.gltf, clip: wive}}\n"),
                  "t.yaml:2:38: the character has no clip \"wive\" (did you mean \"wave\"?)"));
}

TEST_F(References, LayersMixClipsOfSeveralCharacters) {
  RigOptions options;
  options.clip = std::string("shot");
  RigPlayer player(Write("references: {a: {file: c.gltf, start: 100}, b: {file: c.gltf}, c: {file: c.gltf}}\n"
                         "clips: {shot: {layers: [{clip: 'a:wave', start: 12, mask: ['a:*']}, "
                         "{clip: 'b:wave', start: 24}]}}\n"),
                   options);
  RigPlayer alone(folder / "c.gltf");
  ASSERT_TRUE(player.ok());
  player.Set("time.time", 1.5);
  for (std::size_t mesh = 0; mesh < 3; ++mesh) {
    alone.Set("time.time", mesh == 0 ? 1.0 : mesh == 1 ? 0.5 : 1.5);
    EXPECT_LT(MaxDistance(player.Points(mesh), alone.Points()), 1e-6) << mesh;
  }
}

TEST_F(References, ConnectAcrossInTheWorld) {
  const Rig rig = LoadedAlone(
      R"(references: {a: {file: arm.yaml, translate: [1, 0, 0]}, b: {file: arm.yaml, translate: [0, 0, 3]}}
nodes: {grip: {type: transform, at: "b:tip"}}
connections: ["b:tip.worldMatrix -> a:arm:pull.matrix", grip.rotate -> a:arm:hand.rotate]
)");
  EXPECT_EQ(Driver(rig, "a:arm:pull.matrix"), "b:tip.worldMatrix") << "in place of what arm.yaml connects";
  EXPECT_EQ(Driver(rig, "a:arm:hand.rotate"), "grip.rotate");
  EXPECT_EQ(Driver(rig, "b:arm:pull.matrix"), "b:arm:hand.worldMatrix");
  EXPECT_EQ(Driver(rig, "grip.parentMatrix"), "b.worldMatrix") << "goes along with its character";
  RigOptions rest;
  rest.rest = true;
  RigPlayer player(folder / "t.yaml", rest);
  const Matrix4 grip = player.World("grip"), tip = player.World("b:tip");
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(grip(i, 3), tip(i, 3), 1e-12);
  EXPECT_NEAR(tip(2, 3), 8, 1e-12);
  EXPECT_TRUE(
      Has(ErrorsAlone("references: {a: {file: arm.yaml}}\nconnections: ['a:tip.rotate -> a:arm:hand.rotate', "
                      "'a:root.rotate -> a:arm:hand.rotate']\n"),
          "a:arm:hand.rotate is connected twice: here and at "));
  // What a clip drives takes more words
  EXPECT_TRUE(Has(ErrorsAlone("references: {a: {file: c.gltf}, b: {file: c.gltf}}\n"
                              "connections: ['a:root.matrix -> b:tip.offsetParentMatrix']\n"),
                  "override: true"));
}

TEST_F(References, TakeOverrides) {
  const Rig rig = LoadedAlone(R"(units: {length: m}
references: {a: {file: arm.yaml}, b: {file: arm.yaml}}
overrides:
  a:mush.iterations: 7
  a:loose.translate: [0, 0, 2]
  a:soft.falloffRadius: 0.3
  a:arm:pull.members: all
  a:arm:hand.parent: "a:root"
  a:arm:pull.envelope: b:loose.translateX
  a:soft.envelope: a:loose.translateY
  "a:body.weight[up]": 0.25
variants: {b1: {"b:mush.iterations": 9}}
)");
  EXPECT_EQ(Held(rig, "a:mush.iterations").AsInt(), 7);
  EXPECT_EQ(Held(rig, "b:mush.iterations").AsInt(), 3);
  EXPECT_EQ(Held(rig, "a:loose.translate").get<Double3>().z, 2) << "in the units of the file that says so";
  EXPECT_DOUBLE_EQ(Held(rig, "a:soft.falloffRadius").AsDouble(), 0.3);
  EXPECT_NE(Held(rig, "a:arm:pull.weights[0]").digest(), Held(rig, "b:arm:pull.weights[0]").digest());
  EXPECT_EQ(Driver(rig, "a:arm:hand.parentMatrix"), "a:root.worldMatrix");
  EXPECT_EQ(Driver(rig, "a:arm:pull.envelope"), "b:loose.translate.x");
  EXPECT_EQ(Driver(rig, "a:soft.envelope"), "a:loose.translate.y");
  EXPECT_DOUBLE_EQ(Held(rig, "a:body.weight[up]").AsDouble(), 0.25);
  RigOptions options;
  options.variant = "b1";
  EXPECT_EQ(Held(LoadedAlone("references: {b: {file: arm.yaml}}\nvariants: {b1: {'b:mush.iterations': 9}}\n",
                             options),
                 "b:mush.iterations")
                .AsInt(),
            9);
  options.variant = "b:still";
  EXPECT_DOUBLE_EQ(Held(LoadedAlone("references: {a: {file: arm.yaml}, b: {file: arm.yaml}}\n", options),
                        "b:soft.envelope")
                       .AsDouble(),
                   0);
  const std::string text = ErrorsAlone(
      "references: {a: {file: arm.yaml}}\noverrides: {a:mosh.iterations: 4, a:mush.iterations: x}\n"
      "variants: {v: {a:mush.iteration: 4, a:soft.members: all}}\n");
  EXPECT_TRUE(Has(text, "t.yaml:3:13: unknown node \"mosh\"")) << text;
  EXPECT_TRUE(Has(text, "t.yaml:3:")) << text;
  const std::string variants = ErrorsAlone(
      "references: {a: {file: arm.yaml}}\nvariants: {v: {a:mush.iteration: 4, a:soft.members: all}}\n");
  EXPECT_TRUE(Has(variants, "t.yaml:3:16: node \"a:mush\" (deltaMush) has no attribute \"iteration\""))
      << variants;
  EXPECT_FALSE(Has(variants, "members")) << variants;
}

TEST_F(References, AreReferencedThemselves) {
  Write(
      "references: {x: {file: arm.yaml, translate: [1, 0, 0], start: 12}, y: {file: c.gltf}}\n"
      "accelerate: {pair: {points: [\"x:body@mush\"]}}\n",
      "pair.yaml");
  // Two entries for the same points are one too many
  EXPECT_TRUE(Has(ErrorsAlone("references: {p: {file: pair.yaml}}\n"),
                  "pair.yaml:3:30: points of \"x:body\" are accelerated already, at "));
  Write("references: {x: {file: arm.yaml, translate: [1, 0, 0], start: 12}, y: {file: c.gltf}}\n",
        "pair.yaml");
  const std::string path = Write(
      "references: {p: {file: pair.yaml, translate: [0, 1, 0], start: 12}}\n"
      "overrides: {p:x:mush.iterations: 8, p:x.translateZ: 4, p:x:soft.envelope: p:y:root.translateX}\n");
  const Result<Rig> rig = LoadRig(StandardRegistry(), path);
  ASSERT_TRUE(rig.ok()) << rig.status().ToString();
  EXPECT_EQ(Held(*rig, "p:x:mush.iterations").AsInt(), 8);
  EXPECT_EQ(Driver(*rig, "p:x.parentMatrix"), "p.worldMatrix");
  EXPECT_EQ(Driver(*rig, "p:x:root.parentMatrix"), "p:x.worldMatrix");
  EXPECT_EQ(Driver(*rig, "p:x:soft.envelope"), "p:y:root.translate.x");
  ASSERT_EQ(rig->references.size(), 2u + 1u);
  EXPECT_EQ(rig->references[2].name_space, "p:y:");
  EXPECT_EQ(rig->references[static_cast<std::size_t>(rig->accelerate[0].reference)].name_space, "p:x:");
  EXPECT_EQ(rig->accelerate[0].name, "p:x:fast");
  RigPlayer player(path), alone(folder / "c.gltf");
  player.Set("time.time", 1.5), alone.Set("time.time", 1.0);
  EXPECT_LT(MaxDistance(player.Points(1), Shifted(alone.Points(), {0, 1, 0})), 1e-6);
  alone.Set("time.time", 0.5);
  EXPECT_LT(MaxDistance(player.Points("skin", 0), Shifted(alone.Points(), {1, 1, 4})), 1e-6)
      << "placed and begun twice";
}

TEST_F(References, MistakesAreFoundInTheRightFile) {
  Write("references: {back: {file: sub/../t.yaml}}\n", "a.yaml");
  std::filesystem::create_directories(folder / "sub");
  const std::string cycle = ErrorsAlone("references: {a: {file: a.yaml}}\n");
  EXPECT_TRUE(
      Has(cycle, "a.yaml:2:27: references form a cycle: t.yaml -> a.yaml (at t.yaml:2:24) -> t.yaml (here)"))
      << cycle;
  EXPECT_TRUE(Has(ErrorsAlone("references: {a: {file: t.yaml}}\n"),
                  "t.yaml:2:24: references form a cycle: t.yaml -> t.yaml (here)"));
  for (const char* path : {"nobody.yaml", "../../nobody.yaml", "/dev/null/x.yaml", "sub"}) {
    const std::string missing = ErrorsAlone(fmt::format("references: {{a: {{file: {}}}}}\n", path));
    EXPECT_TRUE(Has(missing, "t.yaml:2:24: ")) << missing;
  }
  Write("character: c.gltf\nnodes: {m: {type: deltaMash}}\n", "bad.yaml");
  const std::string bad = ErrorsAlone("references: {a: {file: bad.yaml}, b: {file: bad.yaml}}\n");
  EXPECT_EQ(bad.find("bad.yaml:3:19: unknown node type \"deltaMash\""), 0u) << bad;
  EXPECT_EQ(bad.find("deltaMash", bad.find("deltaMash") + 10), std::string::npos) << "once: " << bad;
  const std::string keys = ErrorsAlone(
      "references:\n  a:b: {file: c.gltf}\n  c: {}\n  d: {file: c.gltf, translate: 1, start: x}\n  e: {fil: "
      "1}\n");
  for (const char* part : {"t.yaml:3:3: a reference needs a name of at most 256 bytes, without a colon",
                           "t.yaml:4:6: reference \"c\": the key \"file\" is missing", "unknown key \"fil\""})
    EXPECT_TRUE(Has(keys, part)) << part << "\n" << keys;
  const std::string values = ErrorsAlone("references: {d: {file: c.gltf, translate: 1, start: x}}\n");
  EXPECT_TRUE(Has(values, "t.yaml:2:43: translate: expected a list of 3 numbers")) << values;
  EXPECT_TRUE(Has(values, "t.yaml:2:53: ")) << values;
  const std::string stacks = ErrorsAlone(
      "references: {a: {file: c.gltf}}\nnodes: {m: {type: deltaMush}}\ndeform: [{meshes: ['a:body'], stack: "
      "[gltf, m]}]\n");
  EXPECT_TRUE(Has(stacks, "t.yaml:4:20: \"a:body\" belongs to a reference: its stack is what c.gltf says"))
      << stacks;
  EXPECT_TRUE(Has(ErrorsAlone("references: {a: {file: c.gltf}}\nnodes: {a: {type: transform}}\n"),
                  "a node named \"a\" exists already"));
  EXPECT_TRUE(Has(Errors("references: {body: {file: c.gltf}}\n"), "a node named \"body\" exists already"));
  EXPECT_TRUE(Has(ErrorsAlone("references: {}\n"), "the rig names no character"));
  RigOptions options;
  options.variant = "a:nobody";
  EXPECT_TRUE(Has(ErrorsAlone("references: {a: {file: arm.yaml}}\n", options),
                  "arm.yaml has no variant \"nobody\"; it has still"));
  // Names of the referencing file mean nothing in the other one
  Write("character: c.gltf\nnodes: {m: {type: transform, parent: mine}}\n", "inner.yaml");
  EXPECT_TRUE(Has(ErrorsAlone("references: {a: {file: inner.yaml}}\nnodes: {mine: {type: transform}}\n"),
                  "inner.yaml:3:38: unknown node \"mine\""));
}

TEST_F(References, AreBounded) {
  for (int i = 0; i < 9; ++i)
    Write(fmt::format("references: {{a: {{file: r{0}.yaml}}, b: {{file: r{0}.yaml}}}}\n", i + 1),
          fmt::format("r{}.yaml", i));
  folder.Write("empty.gltf", "{\"asset\": {\"version\": \"2.0\"}}");
  Write("character: empty.gltf\n", "r9.yaml");
  const std::string text = ErrorsAlone("references: {r: {file: r0.yaml}}\n");
  EXPECT_TRUE(Has(text, "more than 256 rigs are referenced")) << text.substr(0, 500);
}

TEST_F(References, AreSixteenLevelsDeepAtMost) {
  folder.Write("r17.gltf", "{\"asset\": {\"version\": \"2.0\"}, \"nodes\": [{\"name\": \"leaf\"}]}");
  for (int level = 0; level < 17; ++level)
    Write(fmt::format("references: {{a: {{file: r{}.{}}}}}\n", level + 1, level == 16 ? "gltf" : "yaml"),
          fmt::format("r{}.yaml", level));
  const Result<Rig> sixteen = LoadRig(StandardRegistry(), folder / "r1.yaml");
  ASSERT_TRUE(sixteen.ok()) << sixteen.status().ToString();
  std::string leaf;
  for (int level = 0; level < 16; ++level) leaf += "a:";
  EXPECT_TRUE(sixteen->graph->FindNode(leaf + "leaf").ok());
  const Result<Rig> seventeen = LoadRig(StandardRegistry(), folder / "r0.yaml");
  ASSERT_FALSE(seventeen.ok());
  EXPECT_TRUE(Has(Short(seventeen.status().ToString()),
                  "r16.yaml:2:24: references are nested more than 16 levels deep"))
      << seventeen.status().ToString();
}

}  // namespace
}  // namespace kpsa::engine
