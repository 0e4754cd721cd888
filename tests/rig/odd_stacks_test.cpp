// Odd rigs: stacks, points and spaces, members and weights.
#include "tests/rig/odd_rigs.h"

namespace kpsa::engine {
namespace {

using V = std::vector<float>;

TEST_F(OddRigs, TheFilesOwnDeformersHaveWordsInStacks) {
  Plain();
  const std::string text = Errors("deform: [{meshes: [body], stack: [body_blendShape, body_skinCluster]}]\n");
  EXPECT_TRUE(
      Has(text, "t.yaml:3:35: \"body_blendShape\" is the file's own: in stacks it is written \"morph\""))
      << text;
  EXPECT_TRUE(
      Has(text, "t.yaml:3:52: \"body_skinCluster\" is the file's own: in stacks it is written \"skin\""))
      << text;
  const Rig rig = Sound(
      "controls: {body_skinCluster.envelope: {min: 0, max: 1}, body_blendShape.envelope: {min: 0, max: "
      "100%}}\n");
  EXPECT_EQ(rig.controls.size(), 2u);
}
TEST_F(OddRigs, StacksOnPointsOfLatticesAndCurves) {
  Plain();
  const Rig rig = Sound(R"(nodes:
  cage: {type: lattice, divisions: [3, 2, 2], parent: root}
  inner: {type: lattice, divisions: [2, 2, 2]}
  h: {type: transform, parent: root}
  cl: {type: cluster, matrix: h.worldMatrix, parent: root, members: {vertices: [0, 1, "3:5"]}}
  line: {type: curve, vertices: "0:2", mesh: body, parent: root}
  w: {type: wire, curve: line, dropoff: 1}
  cl2: {type: cluster, matrix: h.worldMatrix}
deform:
  - {points: cage.points, stack: [inner, cl]}
  - {points: line.cv, stack: [cl2]}
  - {meshes: [body], stack: [morph, w, skin, cage]}
)");
  EXPECT_EQ(Driver(rig, "line.cv"), "cl2.outPoints[0]");
  EXPECT_EQ(Driver(rig, "cl.inPoints"), "inner.outPoints[0]");
  const std::string mush = Errors(
      "nodes: {cage: {type: lattice}, m: {type: deltaMush}}\ndeform: [{points: cage.points, stack: [m]}, "
      "{meshes: [body], stack: [gltf, cage]}]\n");
  EXPECT_TRUE(Has(mush, "t.yaml:4:40: \"m\" smooths along the edges of a mesh, and cage.points has none"))
      << mush;
}

TEST_F(OddRigs, StacksInEveryOrder) {
  Plain();
  const Rig rig = Sound(R"(weld: off
nodes: {l: {type: cluster}, m: {type: deltaMush}, k: {type: cluster}, n: {type: deltaMush}}
deform:
  - {meshes: prop, stack: [l, m]}
  - {meshes: [body], stack: [skin, n]}
  - {meshes: [twin], stack: [k, gltf]}
)");
  EXPECT_EQ(rig.scene.meshes[0].mesh().point_count(), 6u);  // not welded
  EXPECT_EQ(Driver(rig, "l.inPoints"), "prop_transformGeometry.outPoints[0]");
  EXPECT_EQ(Driver(rig, "twin_blendShape.inPoints"), "k.outPoints[0]");
  EXPECT_EQ(Driver(rig, "m.parentMatrix"), "prop.worldMatrix");
  EXPECT_EQ(Driver(rig, "n.parentMatrix"), "root.worldMatrix");
}

TEST_F(OddRigs, AMushKeepsTheFrameThatTheRigNames) {
  Plain();
  const Rig rig = Sound(R"(nodes:
  m: {type: deltaMush, parentMatrix: [[1, 0, 0, 1], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]}
  n: {type: deltaMush, parentMatrix: tip.worldMatrix}
  o: {type: deltaMush, parent: alone}
  p: {type: deltaMush}
deform: [{meshes: [body, twin], stack: [gltf, m, n, o]}, {meshes: [prop], stack: [p]}]
overrides: {p.parentMatrix: alone.worldMatrix}
)");
  EXPECT_EQ(Driver(rig, "m.parentMatrix"), "");
  EXPECT_EQ(Driver(rig, "n.parentMatrix"), "tip.worldMatrix");
  EXPECT_EQ(Driver(rig, "o.parentMatrix"), "alone.worldMatrix");
  EXPECT_EQ(Driver(rig, "p.parentMatrix"), "alone.worldMatrix");
}

TEST_F(OddRigs, HandlesUnderEveryKindOfParent) {
  Plain();
  Sound(R"(nodes:
  h1: {type: transform, parent: tip, at: mid}
  h2: {type: joint, parent: body, at: prop}
  h3: {type: transform, parent: h2, at: {vertex: 2, mesh: prop}}
  h4: {type: transform, parent: prop, at: h3}
  h5: {type: transform, at: h4, rotateOrder: zyx, rotate: [10, 20, 30]}
  h6: {type: transform, parent: h5, at: h1, scale: [2, 2, 2]}
)");
  RigOptions rest;
  rest.rest = true;
  RigPlayer player(folder / "t.yaml", rest);
  ASSERT_TRUE(player.ok());
  const auto place = [&](const char* name) { return TransformPoint(player.World(name), {}); };
  const std::vector<std::pair<const char*, Double3>> places = {{"h1", {0, 1, 5}}, {"h2", {5, 0, 0}},
                                                               {"h3", {5, 1, 0}}, {"h4", {5, 1, 0}},
                                                               {"h5", {5, 1, 0}}, {"h6", {0, 1, 5}}};
  for (const auto& [name, expected] : places) EXPECT_LT(Length(place(name) - expected), 1e-12) << name;
}

// In a file whose rest pose is not its bind pose: what a handle is placed at goes with it, wherever in the
// stack.
TEST_F(OddRigs, HandlesBeforeASkinMoveWhatTheyArePlacedAt) {
  GltfBuilder builder = GltfBuilder::Character();
  builder.root["nodes"][2]["rotation"] = {0, 0, std::sqrt(0.5), std::sqrt(0.5)};
  folder.Write("c.gltf", builder.Text());
  RigOptions rest;
  rest.rest = true;
  for (const char* deformer : {"{type: softMod, matrix: h.worldMatrix, falloffRadius: 50}",
                               "{type: cluster, matrix: h.worldMatrix, falloff: {at: h, radius: 50}}",
                               "{type: wire, curve: c, dropoff: 50}"}) {
    for (const char* stack : {"[d, morph, skin]", "[morph, d, skin]", "[gltf, d]"}) {
      for (const int vertex : {0, 1, 2}) {
        const std::string v = std::to_string(vertex);
        folder.Write("t.yaml",
                     "kpsa: 1\nunits: {length: cm}\ncharacter: c.gltf\nnodes:\n"
                     "  h: {type: transform, at: {vertex: " +
                         v +
                         "}}\n"
                         "  c: {type: curve, vertices: [" +
                         v + ", " + v + "]}\n  d: " + deformer +
                         "\nconnections: [\"h.translate -> c.cv[0]\", \"h.translate -> c.cv[1]\"]\n"
                         "deform: [{meshes: body, stack: " +
                         stack + "}]\ncontrols:\n  h.translateX: {min: -10, max: 10}\n");
        RigPlayer player(folder / "t.yaml", rest);
        ASSERT_TRUE(player.ok());
        const std::vector<Double3> before = player.Points();
        player.Set("h.translateX", 0.1);
        const std::vector<Double3> after = player.Points();
        for (Index p = 0; p < 3; ++p) {
          const Double3 expected{p == player.PointOf(static_cast<Index>(vertex)) ? 0.1 : 0, 0, 0};
          EXPECT_LT(Length(after[p] - before[p] - expected), 1e-6) << deformer << stack << vertex << p;
        }
      }
    }
  }
}

TEST_F(OddRigs, APartOfPointsIsNoControl) {
  const std::string text = Errors(
      "nodes: {c: {type: curve, vertices: [0, 1]}}\ncontrols:\n"
      "  c.cv[1].x: {min: -1, max: 1}\n");
  EXPECT_TRUE(Has(text, "t.yaml:5:3: c.cv[1].x is a part of points and cannot be a control")) << text;
  const std::string grid = Errors(
      "nodes: {c: {type: lattice, divisions: [2, 2, 2]}}\ncontrols:\n"
      "  \"c.points[1,0,1].x\": {min: -1, max: 1}\n");
  EXPECT_TRUE(Has(grid, "c.points[1,0,1].x is a part of points")) << grid << "as it was written";
}

TEST_F(OddRigs, CurvesOfEveryKind) {
  Plain();
  Sound(R"(nodes:
  l1: {type: curve, places: [[0, 0, 0], [1, 0, 0], [1, 1, 0]], closed: yes, parent: h}
  l2: {type: curve, vertices: [0, "1:2"], mesh: twin}
  h: {type: transform, at: "l2[2]"}
  h2: {type: transform, at: "l1.cv[0]", parent: h}
  w1: {type: wire, curve: l1, dropoff: 50cm}
  w2: {type: wire, curve: l2, parent: tip}
connections: ["h.translate -> l2.cv[2]", "h2.translateX -> l1.cv[1].z"]
deform: [{meshes: [body], stack: [morph, w1, skin, w2]}]
)");
  const std::string text =
      Errors("nodes: {l: {type: curve, places: [[0, 0, 0], [1, 0, 0]], closed: true}}\n");
  EXPECT_TRUE(Has(text, "t.yaml:3:9: closed curve \"l\" has 2 points; expected 3 to")) << text;
}

// --- Members and weights
TEST_F(OddRigs, MembersOfEachKind) {
  Plain();
  folder.Write(
      "w/a b.json",
      R"({"kpsa": "weights", "version": 1, "mesh": "body", "points": 6, "maps": {"m#1": {"default": 0.5, "indices": [1], "values": [0]}}})");
  const Rig rig = Sound(R"(weld: off
nodes:
  a1: {type: cluster, members: all}
  a2: {type: cluster, members: {vertices: "0:1, 3"}}
  a3: {type: cluster, members: {primitive: 1}}
  a4: {type: cluster, members: {material: "Eye [l]"}}
  a5: {type: cluster, members: {joint: tip, above: 80%}}
  a6: {type: cluster, members: {weights: "w/a b.json#m#1"}}
  a7: {type: cluster, members: [{joint: root, above: 0.9}, {vertices: 0}]}
  a8: {type: cluster, members: [all], weights: ["w/a b.json#m#1"]}
deform: [{meshes: [body], stack: [gltf, a1, a2, a3, a4, a5, a7, a8]}]
)",
                        1);
  EXPECT_EQ(Weights(rig, "a1.weights"), (V{1, 1, 1, 1, 1, 1}));
  EXPECT_EQ(Weights(rig, "a2.weights"), (V{1, 1, 0, 1, 0, 0}));
  EXPECT_EQ(Weights(rig, "a3.weights"), (V{0, 0, 0, 1, 1, 1}));
  EXPECT_EQ(Weights(rig, "a4.weights"), (V{0, 0, 0, 1, 1, 1}));
  EXPECT_EQ(Weights(rig, "a5.weights"), (V{0, 1, 0, 0, 1, 0}));
  EXPECT_EQ(Weights(rig, "a7.weights"), (V{1, 0, 1, 0, 0, 1}));
  EXPECT_EQ(Weights(rig, "a8.weights"), (V{0.5f, 0, 0.5f, 0.5f, 0.5f, 0.5f}));
}

TEST_F(OddRigs, WeightsAndMembersOfSeveralMeshes) {
  Plain();
  const std::string head = R"({"kpsa": "weights", "version": 1, "mesh": )";
  folder.Write(
      "w.json",
      head + R"("body", "points": 6, "maps": {"m": {"default": 0.25, "indices": [], "values": []}}})");
  folder.Write(
      "v.json",
      head + R"("twin", "points": 6, "maps": {"m": {"default": 0.75, "indices": [], "values": []}}})");
  Rig rig = Sound(R"(nodes: {l: {type: cluster, weights: ["w.json#m", v.json]}}
deform: [{meshes: [body], stack: [gltf, l]}, {meshes: [twin], stack: [gltf, l]}]
)");
  EXPECT_EQ(Weights(rig, "l.weights[0]")[0], 0.25f);
  EXPECT_EQ(Weights(rig, "l.weights[1]", 1)[0], 0.75f);
  // What one of the meshes lacks has no members there; what all lack is an error
  const std::string deform = "deform: [{meshes: [body, prop], stack: [gltf, l]}]\n";
  for (const char* members : {"{joint: tip}", "{material: \"Eye [l]\"}", "{primitive: 1}"}) {
    rig = Sound(std::string("nodes: {l: {type: cluster, members: ") + members + "}}\n" + deform, 1);
    EXPECT_EQ(Weights(rig, "l.weights[1]", 2), (V{0, 0, 0})) << members;
    EXPECT_TRUE(Has(rig.notes[0], "are no point of prop")) << rig.notes[0];
  }
  EXPECT_TRUE(Has(Errors("nodes: {l: {type: cluster, members: {joint: alone}}}\n" + deform),
                  "\"alone\" is no joint of the skin of body"));
  EXPECT_TRUE(Has(Errors("nodes: {l: {type: cluster, members: {primitive: 2}}}\n" + deform),
                  "primitive: expected a whole number from 0 to 1, found 2"));
}

}  // namespace
}  // namespace kpsa::engine
