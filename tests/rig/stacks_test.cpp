// Places, stacks and members of rigs, and what is said of bad ones.
#include "base/matrix.h"
#include "tests/rig/rig_fixture.h"

namespace kpsa::engine {
namespace {

using RigStacks = RigFixture;

TEST_F(RigStacks, PlacesHandles) {
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

TEST_F(RigStacks, ExplainsBadPlaces) {
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

TEST_F(RigStacks, BuildsStacks) {
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

// A blendShape of the rig in the place of the file's own: clips move that one alone.
TEST_F(RigStacks, WeightsThatClipsMoveForNothingAreNoted) {
  const std::string shapes = "nodes:\n  face: {type: blendShape, targets: [up]}\n";
  const std::string without = "deform: [{meshes: body, stack: [face, skin]}]\n";
  const auto notes = [&](const std::string& text) { return Loaded(text).notes; };
  const std::vector<std::string> lost = notes(shapes + without);
  ASSERT_EQ(lost.size(), 1u);
  EXPECT_TRUE(Has(lost[0], "clips move body_blendShape.weight, which the stack of body leaves out"))
      << lost[0];
  EXPECT_TRUE(Has(lost[0], "from: \"body_blendShape.weight[NAME]\", to: \"face.weight[NAME]\"")) << lost[0];
  for (const std::string& text :
       {shapes + "deform: [{meshes: body, stack: [morph, face, skin]}]\n",
        shapes + without +
            "connections:\n  - {from: \"body_blendShape.weight[up]\", to: \"face.weight[up]\"}\n",
        std::string("deform: [{meshes: body, stack: [skin]}]\n")})
    EXPECT_TRUE(notes(text).empty()) << text;
}

TEST_F(RigStacks, AVectorAndItsComponentsAreNotSetTogether) {
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

TEST_F(RigStacks, ExplainsBadStacks) {
  const std::string text =
      Errors(R"(nodes: {mush: {type: deltaMush}, mush2: {type: deltaMush}, t: {type: transform}}
deform:
  - {meshes: [body], stack: [gltf, mosh, t, morph, wobbler]}
  - {meshes: [body, bodi, tip], stack: [gltf]}
accelerate:
  a: {points: [body@mosh], space: mush, test: {clips: [weve]}}
  b: {points: [bode@skin], train: {samples: 10}}
)");
  EXPECT_TRUE(Has(text, "t.yaml:5:36: unknown deformer \"mosh\" (did you mean \"mush\"?)")) << text;
  EXPECT_TRUE(Has(text, "unknown deformer \"wobbler\"; expected a deformer of \"nodes\", or gltf, morph"))
      << text;
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

TEST_F(RigStacks, DeformersMayServeSeveralMeshesInOneSpace) {
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

TEST_F(RigStacks, AStackWithoutItsSkinIsNoted) {
  const Rig rig =
      Loaded("nodes: {mush: {type: deltaMush}}\ndeform: [{meshes: [body], stack: [morph, mush]}]\n");
  EXPECT_FALSE(rig.scene.meshes[0].world);
  ASSERT_EQ(rig.notes.size(), 1u);
  EXPECT_TRUE(Has(rig.notes[0], "leaves out its skin")) << rig.notes[0];
  EXPECT_EQ(Driver(rig, "body_skinCluster.inPoints"), "");
}

TEST_F(RigStacks, MembersWeightsAndFalloffs) {
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

TEST_F(RigStacks, ExplainsBadMembersAndWeights) {
  folder.Write(
      "other.json",
      R"({"kpsa": "weights", "version": 1, "mesh": "head", "points": 3, "maps": {"m": {"default": 0, "indices": [], "values": []}}})");
  folder.Write(
      "short.json",
      R"({"kpsa": "weights", "version": 1, "mesh": "body", "points": 4, "maps": {"m": {"default": 0, "indices": [], "values": []}}})");
  folder.Write(
      "bad.json",
      R"({"kpsa": "weights", "version": 1, "mesh": "body", "points": 3, "maps": {"m": {"default": 0, "indices": [7], "values": [1]}}})");
  folder.Write("range.json", R"({"kpsa": "weights", "version": 1, "mesh": "body", "points": 3, "maps": {
    "much": {"default": 1, "indices": [1], "values": [1.5]}, "less": {"default": -0.25, "indices": [0], "values": [1]}}})");
  const auto errors = [&](const std::string& keys) {
    return Errors("nodes: {l: {type: cluster, " + keys +
                  "}}\ndeform: [{meshes: [body], stack: [gltf, l]}]\n");
  };
  EXPECT_TRUE(Has(errors("weights: 'other.json#m'"), "other.json is for mesh \"head\"; \"l\" deforms body"))
      << errors("weights: 'other.json#m'");
  EXPECT_TRUE(Has(errors("weights: 'short.json#m'"), "short.json is for 4 vertices; body has 3"));
  EXPECT_TRUE(Has(errors("weights: 'other.json#n'"), "other.json has no map \"n\""));
  EXPECT_TRUE(Has(errors("weights: '#n'"), "weights \"#n\": expected the file before the #"));
  EXPECT_TRUE(Has(errors("weights: 'bad.json#m'"), "bad.json")) << errors("weights: 'bad.json#m'");
  for (const char* keys : {"weights: 'range.json#much'", "members: {weights: 'range.json#much'}",
                           "falloff: {weights: 'range.json#much'}"})
    EXPECT_TRUE(Has(errors(keys), "weights: 1.5 is outside of 0 to 1: vertex 1 of map \"much\""))
        << errors(keys);
  EXPECT_TRUE(Has(errors("weights: 'range.json#less'"), "weights: -0.25 is outside of 0 to 1: vertex 1 of"));
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

TEST_F(RigStacks, DeformsLatticePoints) {
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

}  // namespace
}  // namespace kpsa::engine
