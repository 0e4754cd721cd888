// `driver:` of deformers that follow another mesh, and composed falloffs, on a character of sheets.
#include <cmath>

#include "tests/rig/rig_player.h"
#include "tests/rig/sheets_character.h"

namespace kpsa::engine {
namespace {

class RigDrivers : public RigFixture {
 protected:
  static constexpr std::size_t kCage = 0, kShirt = 1, kCloth = 2;

  RigDrivers() { folder.Write("c.gltf", SheetsCharacter().Text()); }
  RigPlayer Play(const std::string& text) {
    return RigPlayer(folder.Write("t.yaml", "kpsa: 1\ncharacter: c.gltf\n" + text));
  }
  static Double3 PlaceOf(const Matrix4& m) { return {m(0, 3), m(1, 3), m(2, 3)}; }
  static constexpr const char* kControls =
      "controls:\n"
      "  root.translateX: {min: -1, max: 1}\n"
      "  root.rotateZ: {min: -90, max: 90}\n"
      "  tip.rotateY: {min: -90, max: 90}\n";
};

TEST_F(RigDrivers, AClothFollowsACage) {
  for (const char* type : {"proximityWrap", "wrap"}) {
    for (const char* driver : {"cage", "\"cage@skin\""}) {
      RigPlayer player =
          Play(fmt::format("nodes:\n  w: {{type: {}, driver: {}}}\n"
                           "deform:\n  - {{meshes: [cloth], stack: [w]}}\n{}",
                           type, driver, kControls));
      ASSERT_TRUE(player.ok());
      const std::vector<Double3> rest = player.Points(kCloth);
      EXPECT_LT(MaxDistance(rest, player.Points("transform", kCloth)), 1e-6);
      player.Set("root.translateX", 0.5);
      player.Set("root.rotateZ", 1.5707963267948966);
      std::vector<Double3> expected = rest;
      for (Double3& p : expected) p = {0.5 - p.y, p.x, p.z};
      EXPECT_LT(MaxDistance(player.Points(kCloth), expected), 1e-6) << type << driver;
    }
  }
}

TEST_F(RigDrivers, AStageOfTheDriverIsWhatIsFollowed) {
  RigPlayer player = Play(std::string("nodes:\n"
                                      "  h: {type: transform, at: [0, 0, 0]}\n"
                                      "  lift: {type: cluster, matrix: h.worldMatrix}\n"
                                      "  before: {type: proximityWrap, driver: \"cage@skin\"}\n"
                                      "deform:\n"
                                      "  - {meshes: [cage], stack: [skin, lift]}\n"
                                      "  - {meshes: [cloth], stack: [before]}\n") +
                          kControls + "  h.translateZ: {min: 0, max: 3}\n");
  ASSERT_TRUE(player.ok());
  const std::vector<Double3> rest = player.Points(kCloth), cage = player.Points(kCage);
  player.Set("h.translateZ", 1);
  EXPECT_LT(MaxDistance(player.Points(kCloth), rest), 1e-6);  // the cluster comes after what it follows
  EXPECT_NEAR(MaxDistance(player.Points(kCage), cage), 1, 1e-6);
  player.Set("root.translateX", 0.25);
  EXPECT_NEAR(MaxDistance(player.Points(kCloth), rest), 0.25, 1e-6);
}

TEST_F(RigDrivers, InMeshSpaceBothAreBeforeTheSkin) {
  // The shirt follows the cage's cluster before the skin, and then goes where its own skin takes it
  RigPlayer player = Play(std::string("nodes:\n"
                                      "  h: {type: transform, at: [0, 0, 0], parent: root}\n"
                                      "  lift: {type: cluster, matrix: h.worldMatrix, parent: root}\n"
                                      "  w: {type: proximityWrap, driver: \"cage@lift\"}\n"
                                      "deform:\n"
                                      "  - {meshes: [cage], stack: [lift, skin]}\n"
                                      "  - {meshes: [shirt], stack: [w, skin]}\n") +
                          kControls + "  h.translateZ: {min: 0, max: 3}\n");
  ASSERT_TRUE(player.ok());
  const std::vector<Double3> rest = player.Points(kShirt);
  player.Set("h.translateZ", 1);
  player.Set("root.translateX", 0.25);
  std::vector<Double3> expected = rest;
  for (Double3& p : expected) p = p + Double3{0.25, 0, 1};
  EXPECT_LT(MaxDistance(player.Points(kShirt), expected), 1e-6);
}

// A mesh that the file skins follows a driver in the world, with its skin at rest.
TEST_F(RigDrivers, AtRestASkinLeavesAllMovesToTheWrap) {
  for (const char* type : {"proximityWrap", "wrap"}) {
    RigPlayer player =
        Play(fmt::format("nodes:\n  w: {{type: {}, driver: cage}}\n"
                         "deform:\n  - {{meshes: [shirt], stack: [restSkin, w]}}\n{}",
                         type, kControls));
    ASSERT_TRUE(player.ok());
    EXPECT_TRUE(player.rig.notes.empty()) << player.rig.notes.front();
    const std::vector<Double3> rest = player.Points(kShirt);
    player.Set("root.translateX", 0.5);
    player.Set("root.rotateZ", 1.5707963267948966);
    EXPECT_LT(MaxDistance(player.Points("restSkin", kShirt), rest), 1e-9);
    std::vector<Double3> expected = rest;  // once, not twice
    for (Double3& p : expected) p = {0.5 - p.y, p.x, p.z};
    EXPECT_LT(MaxDistance(player.Points(kShirt), expected), 1e-6) << type;
    // The driver bends where its joints do, and the shirt, which is near it, with it
    player.Set("tip.rotateY", 0.3);
    EXPECT_GT(MaxDistance(player.Points(kShirt), expected), 0.1);
    EXPECT_LT(MaxDistance(player.Points("restSkin", kShirt), rest), 1e-9);
  }
}

// What `parent` does to a mesh, its skin does already: the wrap adds what the driver does besides.
TEST_F(RigDrivers, AParentCarriesWhatFollows) {
  RigPlayer player = Play(std::string("nodes:\n  w: {type: proximityWrap, driver: cage, parent: root}\n"
                                      "deform:\n  - {meshes: [shirt], stack: [skin, w]}\n") +
                          kControls);
  ASSERT_TRUE(player.ok());
  const std::vector<Double3> rest = player.Points(kShirt);
  player.Set("root.translateX", 0.5);
  player.Set("root.rotateZ", 1.5707963267948966);
  std::vector<Double3> expected = rest;
  for (Double3& p : expected) p = {0.5 - p.y, p.x, p.z};
  EXPECT_LT(MaxDistance(player.Points(kShirt), expected), 1e-6);
}

// Where the rest pose is not the bind pose, restSkin is the skin at rest and not the mesh as it is.
TEST_F(RigDrivers, ARestSkinIsWhereTheJointsRest) {
  GltfBuilder b = SheetsCharacter();
  b.root["nodes"][1]["translation"] = {0, 0, 3};
  b.root["nodes"][2]["rotation"] = {0, 0.6, 0, 0.8};
  folder.Write("c.gltf", b.Text());
  RigPlayer skinned = Play(kControls);
  const std::vector<Double3> rest = skinned.Points(kShirt);
  RigPlayer held = Play("deform:\n  - {meshes: [shirt], stack: [restSkin]}\n" + std::string(kControls));
  ASSERT_TRUE(skinned.ok() && held.ok());
  EXPECT_LT(MaxDistance(held.Points(kShirt), rest), 1e-6);
  EXPECT_GT(MaxDistance(held.Points("rest", kShirt), rest), 1);
  held.Set("root.translateX", 1);
  EXPECT_LT(MaxDistance(held.Points(kShirt), rest), 1e-6);
}

TEST_F(RigDrivers, RestIsAStageOfEveryMesh) {
  // Before its skin the shirt is pulled onto the cage as that rests, and then both are skinned
  RigPlayer player = Play(std::string("units: {length: cm}\nnodes:\n"
                                      "  s: {type: shrinkWrap, driver: \"cage@rest\", offset: 5, projection: "
                                      "parallelToAxis, axis: [0, 0, 1], bidirectional: on}\n"
                                      "deform:\n  - {meshes: [shirt], stack: [s, skin]}\n") +
                          kControls);
  ASSERT_TRUE(player.ok());
  EXPECT_TRUE(player.rig.notes.empty());
  player.Set("root.rotateZ", 0.5);
  for (const Double3& p : player.Points("s", kShirt)) EXPECT_NEAR(p.z, 0.05, 1e-6);
  for (const Double3& p : player.Points(kShirt)) EXPECT_NEAR(p.z, 0.05, 1e-6);
  EXPECT_TRUE(Has(Errors("accelerate:\n  a: {points: [\"cage@rest\"]}\n"),
                  "\"cage\" rests there: there is nothing to accelerate"))
      << Errors("accelerate:\n  a: {points: [\"cage@rest\"]}\n");
}

TEST_F(RigDrivers, MovingTwiceIsNoted) {
  const auto notes = [&](const std::string& node, const std::string& deform) {
    const Rig rig = Loaded("nodes:\n  w: {type: " + node + "}\ndeform:\n" + deform);
    std::string all;
    for (const std::string& note : rig.notes) all += note + "\n";
    return Short(all);
  };
  const std::string twice =
      "the joints of \"shirt\" move it twice: by its skin, and by \"w\" (t.yaml:4:3), whose driver they "
      "move, too. "
      "Write restSkin instead, or put \"w\" before the skin";
  const std::string shirt = "  - {meshes: [shirt], stack: [skin, w]}\n";
  for (const char* type : {"proximityWrap", "wrap"}) {
    const std::string said = notes(std::string(type) + ", driver: cage", shirt);
    EXPECT_TRUE(Has(said, "t.yaml:6:31: " + twice)) << said;
  }
  // By a chain of wraps, too
  const Rig chain = Loaded(
      "nodes:\n  v: {type: wrap, driver: cage}\n  w: {type: wrap, driver: cloth}\n"
      "deform:\n  - {meshes: [shirt], stack: [skin, w]}\n  - {meshes: [cloth], stack: [v]}\n");
  ASSERT_EQ(chain.notes.size(), 1u);
  EXPECT_TRUE(Has(chain.notes[0], "the joints of \"shirt\" move it twice")) << chain.notes[0];
  // Not where the driver moves by itself, the wrap comes first, the skin rests, or what lies on the driver is put there
  EXPECT_EQ(notes("wrap, driver: cloth", shirt), "");
  EXPECT_EQ(notes("wrap, driver: \"cage@rest\"", "  - {meshes: [shirt], stack: [w, skin]}\n"), "");
  EXPECT_EQ(notes("wrap, driver: cage", "  - {meshes: [shirt], stack: [restSkin, w]}\n"), "");
  EXPECT_EQ(notes("shrinkWrap, driver: cage", shirt), "");
  EXPECT_EQ(notes("wrap, driver: cage, parent: root", shirt), "");
}

TEST_F(RigDrivers, RestSkinsAreForSkins) {
  EXPECT_EQ(Errors("deform:\n  - {meshes: [cloth], stack: [restSkin]}\n"),
            "t.yaml:4:31: mesh \"cloth\" has no skin: leave \"restSkin\" out");
  for (const char* word : {"skin", "gltf"}) {
    EXPECT_EQ(
        Errors(fmt::format("deform:\n  - {{meshes: [shirt], stack: [restSkin, {}]}}\n", word)),
        fmt::format(
            "t.yaml:4:41: \"{}\" lets the joints of \"shirt\" move it, and \"restSkin\" does not: leave "
            "one of them out",
            word));
  }
  EXPECT_TRUE(Has(Errors("deform:\n  - {meshes: [shirt], stack: [restSkin, restSkin]}\n"),
                  "\"restSkin\" is in this stack twice"));
  EXPECT_TRUE(Has(Errors("nodes:\n  restSkin: {type: deltaMush}\n"), "is a word of stacks"));
}

TEST_F(RigDrivers, AShrunkClothLiesOnTheCage) {
  RigPlayer player = Play(std::string("units: {length: cm}\nnodes:\n"
                                      "  s: {type: shrinkWrap, driver: cage, offset: 5, projection: "
                                      "parallelToAxis, axis: [0, 0, 1], bidirectional: on}\n"
                                      "deform:\n  - {meshes: [cloth], stack: [s]}\n") +
                          kControls + "  root.translateZ: {min: -300, max: 300}\n");
  ASSERT_TRUE(player.ok());
  for (const double height : {0.0, 2.0, -1.0}) {
    player.Set("root.translateZ", height);
    const std::vector<Double3> points = player.Points(kCloth), rest = player.Points("transform", kCloth);
    int on = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      // The node is 1 m up: a part of the cloth is beside the cage, and stays
      const bool above = rest[i].y < 1.0001;
      EXPECT_NEAR(points[i].z, above ? height + 0.05 : rest[i].z, 1e-6);
      on += above ? 1 : 0;
    }
    EXPECT_EQ(on, 15);
  }
}

TEST_F(RigDrivers, APinCarriesATransform) {
  RigPlayer player = Play(std::string("nodes:\n"
                                      "  p: {type: uvPin, driver: cage, coordinateU: [0.625, 0.5], "
                                      "coordinateV: [0.75, 0.25], normalAxis: z}\n"
                                      "  f: {type: follicle, driver: \"shirt@skin\", parameterU: 1}\n"
                                      "  a: {type: transform, offsetParentMatrix: \"p.outputMatrix[0]\"}\n"
                                      "  b: {type: transform, translate: f.outTranslate}\n") +
                          kControls);
  ASSERT_TRUE(player.ok());
  EXPECT_LT(
      MaxDistance({PlaceOf(player.World("a")), PlaceOf(player.World("b"))}, {{0.25, 0.5, 0}, {0.8, 0, 0.1}}),
      1e-6);
  player.Set("root.translateX", 0.5);
  player.Set("root.rotateZ", 1.5707963267948966);
  const Matrix4 a = player.World("a");
  EXPECT_LT(MaxDistance({PlaceOf(a), PlaceOf(player.World("b"))}, {{0, 0.25, 0}, {0.5, 0.8, 0.1}}), 1e-6);
  EXPECT_NEAR(a(1, 0), 1, 1e-6);  // growing u has turned from x to y
  EXPECT_NEAR(a(2, 2), 1, 1e-6);
  EXPECT_TRUE(Has(Errors("nodes:\n  p: {type: uvPin, driver: cag}\n"), "t.yaml:4:28: unknown mesh \"cag\""));
}

TEST_F(RigDrivers, ErrorsAtTheirLine) {
  const auto errors = [&](const std::string& w, const std::string& stack) {
    return Errors("nodes:\n  w: {type: proximityWrap" + w + "}\n  m: {type: deltaMush}\ndeform:\n  - " +
                  stack);
  };
  const std::string cloth = "{meshes: [cloth], stack: [w]}\n";
  EXPECT_EQ(
      errors("", cloth),
      "t.yaml:4:3: \"w\" (proximityWrap) has no driver: expected driver: MESH, or driver: \"MESH@STAGE\"");
  EXPECT_EQ(errors(", driver: cag", cloth), "t.yaml:4:36: unknown mesh \"cag\" (did you mean \"cage\"?)");
  EXPECT_EQ(errors(", driver: \"cage@skim\"", cloth),
            "t.yaml:4:36: \"cage\" has no stage \"skim\" (did you mean \"skin\"?); its stack is skin");
  EXPECT_EQ(errors(", driver: \"cag@skin\"", cloth),
            "t.yaml:4:36: unknown mesh \"cag\" (did you mean \"cage\"?)");
  EXPECT_EQ(errors(", driver: \"cloth@transform\"", cloth),
            "t.yaml:4:36: \"w\" deforms cloth, so cloth cannot be its driver: a mesh does not drive itself");
  EXPECT_EQ(errors(", driver: thread", cloth), "t.yaml:4:36: the driver \"thread\" has no faces");
  EXPECT_EQ(
      errors(", driver: cage", "{meshes: [shirt], stack: [w, skin]}\n"),
      "t.yaml:4:36: \"w\" deforms shirt in mesh space (before the skin), and the driver \"cage\" is in world "
      "space: name a stage of the driver in the same space, or write restSkin before it in its stack, "
      "instead of skin");
  EXPECT_TRUE(Has(errors(", driver: [cage]", cloth), "t.yaml:4:36: driver: expected"));
  EXPECT_TRUE(Has(errors(", drivr: cage", cloth), "has no attribute \"drivr\" (did you mean \"driver\"?)"));
  EXPECT_TRUE(
      Has(Errors("nodes:\n  c: {type: cluster, driver: cage}\ndeform:\n  - {meshes: [cloth], stack: [c]}\n"),
          "has no attribute \"driver\""));
  // Two meshes that follow each other: the cycle by name
  const std::string cycle = Errors(
      "nodes:\n  a: {type: proximityWrap, driver: cage}\n  b: {type: wrap, driver: cloth}\ndeform:\n"
      "  - {meshes: [cloth], stack: [a]}\n  - {meshes: [cage], stack: [skin, b]}\n");
  EXPECT_TRUE(Has(cycle, "t.yaml:5:27: ")) << cycle;
  EXPECT_TRUE(Has(cycle, "b.driverPoints -> b.outPoints -> a.driverPoints -> a.outPoints -> b.driverPoints"))
      << cycle;
  // At a stage before that, there is none
  Loaded(
      "nodes:\n  a: {type: proximityWrap, driver: cage}\n  b: {type: wrap, driver: "
      "\"cloth@transform\"}\ndeform:\n"
      "  - {meshes: [cloth], stack: [a]}\n  - {meshes: [cage], stack: [skin, b]}\n");
}

TEST_F(RigDrivers, AnOverrideNamesAnotherDriver) {
  const Rig rig = Loaded(
      "nodes:\n  w: {type: proximityWrap, driver: cage}\ndeform:\n  - {meshes: [cloth], stack: [w]}\n"
      "overrides: {w.driver: shirt}\n");
  EXPECT_EQ(Driver(rig, "w.driverPoints"), "shirt_skinCluster.outPoints[0]");
}

TEST_F(RigDrivers, PosesByName) {
  RigPlayer player = Play(
      "nodes:\n"
      "  p: {type: poseInterpolator, driver: tip, poses: {flat: [0, 0, 0], up: [90, 0, 0], side: [0, 60, "
      "0]}}\n"
      "  h: {type: transform}\n"
      "connections:\n"
      "  - \"p.outputWeight[up] -> h.translateX\"\n"
      "  - \"p.outputWeight[side] -> h.translateY\"\n"
      "controls: {tip.rotateX: {min: -90, max: 90}, root.rotateX: {min: -90, max: 90}}\n");
  ASSERT_TRUE(player.ok());
  player.Set("root.rotateX", 1);  // only the transform's own turn counts
  EXPECT_NEAR(player.World("h")(0, 3), 0, 1e-9);
  player.Set("tip.rotateX", 1.5707963267948966);
  EXPECT_NEAR(player.World("h")(0, 3), 1, 1e-9);
  EXPECT_NEAR(player.World("h")(1, 3), 0, 1e-9);
  player.Set("tip.rotateX", 0.7);
  EXPECT_GT(player.World("h")(0, 3), 0.1);
  EXPECT_LT(player.World("h")(0, 3), 0.9);

  const auto errors = [&](const std::string& p) {
    return Errors("nodes:\n  p: {type: poseInterpolator, " + p + "}\n");
  };
  EXPECT_TRUE(Has(errors("driver: tp"), "t.yaml:4:39: ")) << errors("driver: tp");
  EXPECT_TRUE(Has(errors("poses: [0, 0, 0]"), "t.yaml:4:38: poses: expected a map of rotations"));
  EXPECT_TRUE(Has(errors("poses: {}"), "t.yaml:4:38: poses: expected a map of rotations"));
  EXPECT_TRUE(Has(errors("poses: {up: [0, 1]}"), "t.yaml:4:43: pose \"up\": expected a list of 3 numbers"));
  EXPECT_TRUE(Has(errors("poses: {up: [0, 1, 2m]}"), "2m"));
}

TEST_F(RigDrivers, JiggleFollowsTheSceneTime) {
  const std::string rig =
      "nodes:\n  j: {type: jiggle, stiffness: 0.2}\n"
      "deform:\n  - {meshes: [cage], stack: [skin, j]}\n";
  EXPECT_EQ(Driver(Loaded(rig), "j.time"), "time.time");
  EXPECT_EQ(
      Held(Loaded("nodes:\n  j: {type: jiggle, time: 2}\ndeform:\n  - {meshes: [cage], stack: [skin, j]}\n"),
           "j.time")
          .AsDouble(),
      2);
  RigPlayer player = Play(rig + kControls);
  ASSERT_TRUE(player.ok());
  const std::vector<Double3> rest = player.Points();
  player.Set("root.translateX", 1);
  player.Set("time.time", 1.0 / 24);
  EXPECT_NEAR(MaxDistance(player.Points(), rest), 0.2, 1e-6);  // a step's pull
}

class RigFalloffs : public RigDrivers {
 protected:
  // The weights of the cloth's points under a falloff, in the order of its vertices; y is 0.2 to 1.8.
  std::vector<float> Weights(const std::string& falloff) {
    const Rig rig =
        Loaded("nodes:\n  a: {type: transform, at: [0, 1, 0]}\n  c: {type: cluster, falloff: " + falloff +
               "}\ndeform:\n  - {meshes: [cloth], stack: [c]}\n");
    const Value value = Held(rig, "c.weights[0]");
    const auto* map = value.asset<WeightMap>();
    std::vector<float> by_vertex;
    const auto& points = rig.scene.meshes[kCloth].mesh().data().vertex_to_point;
    for (std::size_t v = 0; map != nullptr && v < points.size(); ++v)
      by_vertex.push_back(map->weights()[points[v]]);
    return by_vertex;
  }
  // The place of a vertex in the world.
  static Double3 PlaceOf(std::size_t v) {
    return {-0.8 + 0.4 * static_cast<double>(v % 5), 0.2 + 0.4 * static_cast<double>(v / 5), 0.1};
  }
  template <typename F>
  void Expect(const std::string& falloff, F weight) {
    const std::vector<float> weights = Weights(falloff);
    ASSERT_EQ(weights.size(), 25u) << falloff;
    double most = 0, least = 1;
    for (std::size_t v = 0; v < 25; ++v) {
      EXPECT_NEAR(weights[v], weight(PlaceOf(v)), 1e-5) << falloff << " at vertex " << v;
      most = std::max<double>(most, weights[v]), least = std::min<double>(least, weights[v]);
    }
    EXPECT_GT(most, least + 0.03) << falloff;
  }
  static double Clamp(double t) { return std::clamp(t, 0.0, 1.0); }
  static double Smooth(double t) { return Clamp(t) * Clamp(t) * (3 - 2 * Clamp(t)); }
};

TEST_F(RigFalloffs, EveryKindHasItsShape) {
  const auto sphere = [](Double3 p) { return Clamp(1 - Length(p - Double3{0, 1, 0}) / 0.9); };
  Expect("{at: a, radius: 0.9, curve: linear}", sphere);
  Expect("{sphere: {at: a, radius: 0.9, curve: linear}}", sphere);
  Expect("{at: a, radius: 0.9}", [&](Double3 p) { return Smooth(sphere(p)); });
  Expect("{capsule: {from: [-0.4, 1, 0], to: [0.4, 1, 0], radius: 0.7}}", [](Double3 p) {
    const Double3 nearest{std::clamp(p.x, -0.4, 0.4), 1, 0};
    return Smooth(1 - Length(p - nearest) / 0.7);
  });
  Expect("{plane: {at: [0, 0.2, 5], normal: [0, 3, 0], from: 0.4, to: 1.2, curve: linear}}",
         [](Double3 p) { return Clamp(1 - (p.y - 0.6) / 0.8); });
  Expect("{plane: {at: [0, 0.2, 5], normal: [0, 3, 0], from: 1.2, to: 0.4, curve: linear}}",
         [](Double3 p) { return Clamp((p.y - 0.6) / 0.8); });
  // The cage ends at y = 1 and lies 0.1 below the cloth
  Expect("{proximity: {mesh: cage, radius: 0.8, curve: linear}}",
         [](Double3 p) { return Clamp(1 - std::hypot(std::max(0.0, p.y - 1), 0.1) / 0.8); });
}

TEST_F(RigFalloffs, CombineByMultiplyMaxAndAdd) {
  folder.Write("w.json",
               R"({"kpsa": "weights", "version": 1, "mesh": "cloth", "points": 25,
                   "maps": {"m": {"default": 0.25, "indices": [12, 3], "values": [1, 0.5]}}})");
  const auto left = [](Double3 p) { return Clamp(1 - Length(p - Double3{-0.8, 1, 0.1})); };
  const auto right = [](Double3 p) { return Clamp(1 - Length(p - Double3{0.8, 1, 0.1})); };
  const auto map = [](Double3 p) {
    return Length(p - PlaceOf(12)) < 0.01 ? 1 : Length(p - PlaceOf(3)) < 0.01 ? 0.5 : 0.25;
  };
  const std::string l = "{sphere: {at: [-0.8, 1, 0.1], radius: 1, curve: linear}}",
                    r = "{at: [0.8, 1, 0.1], radius: 1, curve: linear}", m = "{weights: \"w.json#m\"}";
  Expect("{combine: multiply, of: [" + l + ", " + r + "]}", [&](Double3 p) { return left(p) * right(p); });
  Expect("{of: [" + l + ", " + r + "]}", [&](Double3 p) { return left(p) * right(p); });
  Expect("[" + l + ", " + r + "]", [&](Double3 p) { return left(p) * right(p); });
  Expect("{combine: max, of: [" + l + ", " + r + "]}",
         [&](Double3 p) { return std::max(left(p), right(p)); });
  Expect("{combine: add, of: [" + l + ", " + r + ", " + m + "]}",
         [&](Double3 p) { return std::min(1.0, left(p) + right(p) + map(p)); });
  Expect("[" + m + ", {combine: max, of: [" + l + ", " + r + "]}]",
         [&](Double3 p) { return map(p) * std::max(left(p), right(p)); });
}

TEST_F(RigFalloffs, NodesThatVary) {
  folder.Write("w.json",
               R"({"kpsa": "weights", "version": 1, "mesh": "cloth", "points": 25,
                   "maps": {"m": {"default": 1, "indices": [12], "values": [0.5]}}})");
  RigPlayer player = Play(
      "nodes:\n"
      "  h: {type: transform, at: [0, 1, 0.1]}\n"
      "  up: {type: transform}\n"
      "  s: {type: sphereFalloff, matrix: h.worldMatrix, radius: 0.9, curve: linear}\n"
      "  m: {type: weightMap, weights: \"w.json#m\"}\n"
      "  both: {type: combineFalloff, falloffs: [s, m], operation: multiply}\n"
      "  c: {type: cluster, matrix: up.worldMatrix, falloff: both}\n"
      "  d: {type: cluster, matrix: up.worldMatrix, falloff: s}\n"
      "deform:\n  - {meshes: [cloth], stack: [c]}\n  - {meshes: [shirt], stack: [d, skin]}\n"
      "controls: {h.translateX: {min: -1, max: 1}, up.translateZ: {min: 0, max: 1}, "
      "s.radius: {min: 0, max: 2}}\n");
  ASSERT_TRUE(player.ok());
  player.Set("up.translateZ", 1);
  for (const double x : {0.0, 0.5}) {
    for (const double radius : {0.9, 0.4}) {
      player.Set("h.translateX", x);
      player.Set("s.radius", radius);
      const std::vector<Double3> cloth = player.Points(kCloth);
      for (Index v = 0; v < 25; ++v) {
        const double weight = Clamp(1 - Length(PlaceOf(std::size_t{v}) - Double3{x, 1, 0.1}) / radius);
        EXPECT_NEAR(cloth[player.PointOf(v, kCloth)].z, 0.1 + weight * (v == 12 ? 0.5 : 1), 1e-6) << v;
      }
      // Before its skin the shirt is where it rests, 1 m lower
      const std::vector<Double3> shirt = player.Points(kShirt);
      for (Index v = 0; v < 25; ++v) {
        const Double3 at = PlaceOf(std::size_t{v}) - Double3{0, 1, 0};
        EXPECT_NEAR(shirt[player.PointOf(v, kShirt)].z,
                    0.1 + Clamp(1 - Length(at - Double3{x, 1, 0.1}) / radius), 1e-6)
            << v;
      }
    }
  }
}

TEST_F(RigFalloffs, ADriverBeforeTheSkinIsCarriedAsThePointsAre) {
  const auto play = [&](const std::string& parent) {
    return Play(
        "nodes:\n"
        "  up: {type: transform}\n"
        "  lift: {type: cluster, matrix: up.worldMatrix, envelope: 0}\n"
        "  near: {type: proximityFalloff, driver: \"cage@lift\", radius: 0.4, curve: linear" +
        parent +
        "}\n"
        "  c: {type: cluster, matrix: up.worldMatrix, falloff: near}\n"
        "deform:\n"
        "  - {meshes: [cage], stack: [lift, skin]}\n"
        "  - {meshes: [shirt], stack: [c, skin]}\n" +
        kControls + "  up.translateZ: {min: 0, max: 1}\n");
  };
  for (const char* parent : {"", ", parent: root"}) {
    RigPlayer player = play(parent);
    ASSERT_TRUE(player.ok());
    const std::vector<Double3> rest = player.Points(kShirt);
    player.Set("up.translateZ", 1);
    for (const double x : {0.0, 1.0}) {  // everything goes along
      player.Set("root.translateX", x);
      std::vector<Double3> expected = rest;
      for (Double3& p : expected) p = p + Double3{x, 0, 0.75};  // 0.1 above the cage
      EXPECT_LT(MaxDistance(player.Points(kShirt), expected), 1e-6) << parent << x;
    }
  }
}

TEST_F(RigFalloffs, ADriverIsInTheSpaceOfWhatItWeighs) {
  const auto errors = [&](const std::string& driver, const std::string& stack, const std::string& more = "") {
    return Errors(
        "nodes:\n"
        "  up: {type: transform}\n"
        "  lift: {type: cluster, matrix: up.worldMatrix}\n"
        "  near: {type: proximityFalloff, driver: \"" +
        driver + "\"" + more +
        "}\n"
        "  map: {type: sphereFalloff}\n"
        "  both: {type: combineFalloff, falloffs: [map, near]}\n"
        "  c: {type: cluster, matrix: up.worldMatrix, falloff: both}\n"
        "deform:\n"
        "  - {meshes: [cage], stack: [lift, skin]}\n"
        "  - {meshes: [shirt], stack: " +
        stack + "}\n");
  };
  EXPECT_EQ(
      errors("cage", "[c, skin]"),
      "t.yaml:6:42: \"near\" weighs shirt in mesh space (before the skin), and the driver \"cage\" is in "
      "world space: name a stage of the driver in the same space, or the parent that carries what is in "
      "mesh space");
  EXPECT_EQ(
      errors("cage@lift", "[skin, c]"),
      "t.yaml:6:42: \"near\" weighs shirt in world space, and the driver \"cage@lift\" is in mesh space "
      "(before the skin): name a stage of the driver in the same space, or the parent that carries what "
      "is in mesh space");
  EXPECT_EQ(errors("cage@lift", "[c, skin]"), "no error");
  EXPECT_EQ(errors("cage", "[skin, c]"), "no error");
  for (const char* stack : {"[c, skin]", "[skin, c]"}) {
    for (const char* driver : {"cage", "cage@lift"})
      EXPECT_EQ(errors(driver, stack, ", parent: root"), "no error") << stack << driver;
  }
}

TEST_F(RigFalloffs, NodesErrAtTheirLine) {
  const auto errors = [&](const std::string& falloff, const std::string& more = "") {
    return Errors("nodes:\n  c: {type: cluster, falloff: " + falloff + "}\n  s: {type: sphereFalloff}\n" +
                  more + "deform:\n  - {meshes: [cloth], stack: [c]}\n");
  };
  EXPECT_TRUE(Has(errors("sx"), "t.yaml:4:31: unknown falloff \"sx\" (did you mean \"s\"?)")) << errors("sx");
  EXPECT_TRUE(Has(errors("c"), "t.yaml:4:31: \"c\" is a cluster, no falloff")) << errors("c");
  EXPECT_TRUE(Has(errors("b", "  b: {type: combineFalloff}\n"),
                  "t.yaml:4:31: \"b\" (combineFalloff): expected two falloff nodes, falloffs: [a, b]"));
  EXPECT_TRUE(Has(errors("b", "  b: {type: combineFalloff, falloffs: [s]}\n"), "t.yaml:6:39: \"b\""));
  EXPECT_TRUE(Has(errors("b", "  b: {type: combineFalloff, falloffs: [s, [s]]}\n"),
                  "t.yaml:6:43: expected the name of a falloff node"));
  EXPECT_TRUE(Has(errors("b", "  b: {type: combineFalloff, falloffs: [s, b]}\n"), "is made of itself"));
  EXPECT_TRUE(Has(errors("s", "  w: {type: weightMap, falloff: s}\n"), "expected a falloff at rest"));
}

TEST_F(RigFalloffs, ErrorsAtTheirLine) {
  const auto errors = [&](const std::string& falloff) {
    return Errors("nodes:\n  c:\n    type: cluster\n    falloff: " + falloff +
                  "\ndeform:\n  - {meshes: [cloth], stack: [c]}\n");
  };
  EXPECT_TRUE(Has(errors("5"), "t.yaml:6:14: falloff: expected {at: PLACE, radius: 5}"));
  EXPECT_TRUE(Has(errors("{radius: 5}"), "falloff: ")) << errors("{radius: 5}");
  EXPECT_TRUE(Has(errors("{cone: {}}"), "t.yaml:6:15: falloff: unknown key \"cone\""));
  EXPECT_TRUE(Has(errors("{sphere: {at: [0, 0, 0], radius: 1}, plane: {}}"),
                  "t.yaml:6:14: falloff: expected one of"));
  EXPECT_TRUE(Has(errors("{combine: min, of: [{at: [0, 0, 0], radius: 1}]}"),
                  "t.yaml:6:24: combine: expected multiply, max or add, found \"min\""));
  EXPECT_TRUE(Has(errors("{combine: max}"), "\"of\""));
  EXPECT_TRUE(Has(errors("{of: []}"), "t.yaml:6:19: of: expected a list of falloffs, found an empty one"));
  EXPECT_TRUE(Has(errors("{capsule: {from: [0, 0, 0], to: nobody, radius: 1}}"), "t.yaml:6:46: "));
  EXPECT_TRUE(Has(errors("{capsule: {from: [0, 0, 0], to: tip, radius: -1}}"),
                  "t.yaml:6:59: radius: expected a length above 0, found -1"));
  EXPECT_TRUE(Has(errors("{plane: {at: tip, normal: [0, 0, 0], from: 0, to: 1}}"),
                  "t.yaml:6:40: normal: expected a direction"));
  EXPECT_TRUE(Has(errors("{plane: {at: tip, normal: [0, 1, 0], from: 1, to: 1}}"),
                  "t.yaml:6:22: plane: from and to are both 1, expected two heights"));
  EXPECT_TRUE(Has(errors("{proximity: {mesh: cloth, radius: 1}}"),
                  "t.yaml:6:33: proximity: every point of cloth is on it"));
  EXPECT_TRUE(Has(errors("{proximity: {mesh: thread, radius: 1}}"),
                  "t.yaml:6:33: proximity: \"thread\" has no faces"));
  EXPECT_TRUE(Has(errors("{proximity: {mesh: cge, radius: 1}}"),
                  "t.yaml:6:33: unknown mesh \"cge\" (did you mean \"cage\"?)"));
  EXPECT_TRUE(Has(errors("{sphere: {at: tip, radius: 1, curve: wavy}}"),
                  "t.yaml:6:51: curve: expected smooth or linear"));
  EXPECT_TRUE(
      Has(errors("{sphere: {at: tip, radius: 1, size: 2}}"), "t.yaml:6:44: falloff: unknown key \"size\""));
}

}  // namespace
}  // namespace kpsa::engine
