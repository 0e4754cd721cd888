// variants, templates and use.
#include "rig/file/templates.h"

#include <fmt/format.h>

#include "tests/rig/rig_player.h"

namespace kpsa::engine {
namespace {

class Variants : public RigFixture {};

const char kVariants[] = R"(nodes:
  mush: {type: deltaMush, iterations: 10}
  pull: {type: cluster, members: all, matrix: tip.worldMatrix}
  gain: {type: plusMinusAverage, input: [1, 2]}
deform: [{meshes: [body], stack: [gltf, pull, mush]}]
overrides: {mush.envelope: 0.5}
variants:
  game: {mush.iterations: 4, mush.envelope: 0.25, pull.members: {vertices: "0"}}
  film: {mush.iterations: 30, gain.input: [7]}
  plain:
)";

TEST_F(Variants, AreChosenByName) {
  const auto iterations = [](const Rig& rig) { return Held(rig, "mush.iterations").AsInt(); };
  const Rig none = Loaded(kVariants);
  EXPECT_EQ(iterations(none), 10);
  EXPECT_DOUBLE_EQ(Held(none, "mush.envelope").AsDouble(), 0.5);
  RigOptions options;
  options.variant = "game";
  const Rig game = Loaded(kVariants, options);
  EXPECT_EQ(iterations(game), 4);
  EXPECT_DOUBLE_EQ(Held(game, "mush.envelope").AsDouble(), 0.25) << "a variant comes after overrides";
  EXPECT_EQ(Held(game, "pull.weights[0]").asset<WeightMap>()->weights().size(),
            Held(none, "pull.weights[0]").asset<WeightMap>()->weights().size());
  EXPECT_NE(Held(game, "pull.weights[0]").digest(), Held(none, "pull.weights[0]").digest());
  options.variant = "film";
  const Rig film = Loaded(kVariants, options);
  EXPECT_EQ(iterations(film), 30);
  EXPECT_DOUBLE_EQ(Held(film, "gain.input[0]").AsDouble(), 7);
  EXPECT_TRUE(Held(film, "gain.input[1]").empty());
  options.variant = "plain";
  EXPECT_EQ(iterations(Loaded(kVariants, options)), 10);
}

TEST_F(Variants, UnknownOnesAreRefused) {
  RigOptions options;
  options.variant = "gane";
  const Result<Rig> rig = Load(kVariants, options);
  EXPECT_EQ(rig.status().kind(), ErrorKind::kUsage);
  EXPECT_TRUE(Has(rig.status().ToString(),
                  "has no variant \"gane\" (did you mean \"game\"?); it has game, film, plain"))
      << rig.status().ToString();
  EXPECT_TRUE(Has(Errors("", options), "t.yaml has no variants, so none named \"gane\""));
  EXPECT_EQ(LoadRig(StandardRegistry(), folder / "c.gltf", options).status().kind(), ErrorKind::kUsage);
}

TEST_F(Variants, MistakesAreFoundWithoutChoosingThem) {
  const std::string text = Errors(R"(nodes: {mush: {type: deltaMush}}
variants:
  a: {mosh.iterations: 4}
  b: {mush.iteration: 4}
  c: [mush]
)");
  EXPECT_TRUE(Has(text, "t.yaml:5:7: unknown node \"mosh\"")) << text;
  EXPECT_TRUE(Has(
      text,
      "t.yaml:6:7: node \"mush\" (deltaMush) has no attribute \"iteration\" (did you mean \"iterations\"?)"))
      << text;
  EXPECT_TRUE(Has(text, "t.yaml:7:6: variant \"c\": expected a map of plugs and values, found a list"))
      << text;
  // The parts of several files make one variant, but no plug is set twice
  folder.Write("part.yaml", "kpsa: 1\nvariants: {a: {mush.iterations: 4}}\n");
  const std::string twice = Errors(
      "include: part.yaml\nnodes: {mush: {type: deltaMush}}\nvariants: {a: {mush.envelope: 0, "
      "mush.iterations: 5}}\n");
  EXPECT_TRUE(Has(twice, "variant \"a\", override \"mush.iterations\" is defined twice")) << twice;
  RigOptions options;
  options.variant = "a";
  const Rig rig = Loaded(
      "include: part.yaml\nnodes: {mush: {type: deltaMush}}\nvariants: {a: {mush.envelope: 0}}\n", options);
  EXPECT_EQ(Held(rig, "mush.iterations").AsInt(), 4);
  EXPECT_DOUBLE_EQ(Held(rig, "mush.envelope").AsDouble(), 0);
}

class Templates : public RigFixture {};

const char kArms[] = R"yaml(units: {length: cm}
templates:
  arm:
    params: {joint: string, size: number}
    nodes:
      hand: {type: transform, parent: $(joint), translateX: $(size)}
      "finger.$(joint)": {type: transform, parent: hand, translate: [hand.translateX, 0, tip.translateZ]}
      pull: {type: cluster, matrix: hand.worldMatrix, members: {joint: $(joint)}}
    connections: ["hand.rotate -> finger.$(joint).rotate"]
    controls: {hand.translateY: {min: 0, max: $(size)}}
use:
  arm_L: {template: arm, joint: root, size: 2}
  arm_R: {template: arm, joint: tip, size: 30mm}
connections: ["arm_L:hand.scale -> arm_R:hand.scale"]
deform: [{meshes: [body], stack: [gltf, "arm_L:pull", "arm_R:pull"]}]
overrides: {"arm_R:hand.translateZ": 1}
)yaml";

TEST_F(Templates, MakeNodesOfTheirOwnForEachUse) {
  const Rig rig = Loaded(kArms);
  EXPECT_DOUBLE_EQ(Held(rig, "arm_L:hand.translateX").AsDouble(), 0.02);
  EXPECT_DOUBLE_EQ(Held(rig, "arm_R:hand.translateX").AsDouble(), 0.03);
  EXPECT_DOUBLE_EQ(Held(rig, "arm_R:hand.translateZ").AsDouble(), 0.01);
  EXPECT_EQ(Driver(rig, "arm_L:hand.parentMatrix"), "root.worldMatrix");
  EXPECT_EQ(Driver(rig, "arm_R:hand.parentMatrix"), "tip.worldMatrix");
  EXPECT_EQ(Driver(rig, "arm_R:finger.tip.parentMatrix"), "arm_R:hand.worldMatrix");
  EXPECT_EQ(Driver(rig, "arm_L:finger.root.translate.x"), "arm_L:hand.translate.x");
  EXPECT_EQ(Driver(rig, "arm_L:finger.root.translate.z"), "tip.translate.z") << "names of the file are seen";
  EXPECT_EQ(Driver(rig, "arm_L:finger.root.rotate"), "arm_L:hand.rotate");
  EXPECT_EQ(Driver(rig, "arm_L:pull.matrix"), "arm_L:hand.worldMatrix");
  EXPECT_EQ(Driver(rig, "arm_R:hand.scale"), "arm_L:hand.scale");
  ASSERT_EQ(rig.controls.size(), 2u);
  EXPECT_EQ(rig.controls[0].name, "arm_L:hand.translateY");
  EXPECT_DOUBLE_EQ(rig.controls[1].max, 0.03);
  EXPECT_EQ(rig.files.size(), 2u) << "a use is no file";
}

// Words that name nodes: joints of a chain, what a constraint follows and owns, the driver of poses, curves of a wire.
TEST_F(Templates, WordsNameNodesOfTheirOwn) {
  const Rig rig = Loaded(R"yaml(templates:
  limb:
    nodes:
      upper: {type: transform, parent: root, translateX: 1}
      lower: {type: transform, parent: upper, translateX: 1}
      foot: {type: transform, parent: lower, translateX: 1}
      goal: {type: transform, translate: [2, 1, 0]}
      ik: {type: ikHandle, start: upper, mid: lower, end: foot, target: goal.worldMatrix}
      held: {type: transform}
      hold: {type: parentConstraint, targets: [goal, foot], constrained: held}
      bends: {type: poseInterpolator, driver: lower, poses: {rest: [0, 0, 0], bent: [0, 0, 90]}}
      one: {type: curve, places: [[0, 0, 0], [1, 0, 0]]}
      two: {type: curve, places: [[0, 1, 0], [1, 1, 0]]}
      pull: {type: wire, curves: [one, two], dropoff: 1}
use: {l: {template: limb}}
deform: [{meshes: [body], stack: [gltf, "l:pull"]}]
)yaml");
  EXPECT_EQ(Driver(rig, "l:hold.targetMatrix[0]"), "l:goal.worldMatrix");
  EXPECT_EQ(Driver(rig, "l:hold.targetMatrix[1]"), "l:foot.worldMatrix");
  EXPECT_EQ(Driver(rig, "l:ik.parentMatrix"), "root.worldMatrix");
}

// The same rig written out gives the same points.
TEST_F(Templates, EqualWhatIsWrittenOut) {
  Loaded(kArms);
  RigPlayer expanded(folder / "t.yaml");
  Loaded(R"(units: {length: cm}
nodes:
  a: {type: transform, parent: root, translateX: 2}
  b: {type: transform, parent: tip, translateX: 3, translateZ: 1, scale: a.scale}
  pa: {type: cluster, matrix: a.worldMatrix, members: {joint: root}}
  pb: {type: cluster, matrix: b.worldMatrix, members: {joint: tip}}
deform: [{meshes: [body], stack: [gltf, pa, pb]}]
controls: {a.translateY: {min: 0, max: 2}, b.translateY: {min: 0, max: 3}}
)");
  RigPlayer written(folder / "t.yaml");
  ASSERT_TRUE(expanded.ok() && written.ok());
  const std::vector<Double3> rest = written.Points();
  expanded.Set("arm_L:hand.translateY", 0.02), written.Set("a.translateY", 0.02);
  expanded.Set("arm_R:hand.translateY", 0.01), written.Set("b.translateY", 0.01);
  EXPECT_EQ(MaxDistance(expanded.Points(), written.Points()), 0);
  EXPECT_GT(MaxDistance(written.Points(), rest), 1e-3);
}

TEST_F(Templates, UseEachOtherAndComeFromOtherFiles) {
  std::filesystem::create_directories(folder / "lib");
  folder.Write("lib/hand.yaml", R"yaml(kpsa: 1
units: {length: mm}
templates:
  finger: {params: {n: number, of: string}, nodes: {"tip$(n)": {type: transform, parent: "$(of)", translateX: $(n)}}}
  hand: {params: {side: string}, nodes: {palm: {type: transform, parent: tip}}, use: {"f.$(side)": {template: finger, n: 4, of: palm}, g: {template: finger, n: 5, of: palm}}}
)yaml");
  const Rig rig = Loaded("include: lib/hand.yaml\nuse: {h: {template: hand, side: L}}\n");
  EXPECT_EQ(Driver(rig, "h:f.L:tip4.parentMatrix"), "h:palm.worldMatrix")
      << "names of the outer use are seen";
  EXPECT_EQ(Driver(rig, "h:g:tip5.parentMatrix"), "h:palm.worldMatrix");
  EXPECT_DOUBLE_EQ(Held(rig, "h:f.L:tip4.translateX").AsDouble(), 0.004)
      << "units are those of the template's file";
}

TEST_F(Templates, LiteralsStayWhatTheyAre) {
  // Nodes called like a choice, a number or a type
  const Rig rig = Loaded(R"(templates:
  t:
    nodes:
      xyz: {type: transform, rotateOrder: xyz}
      yzx: {type: transform, rotateOrder: yzx, parent: xyz, translateX: xyz.translateX}
use: {u: {template: t}}
)");
  EXPECT_EQ(Held(rig, "u:yzx.rotateOrder").AsInt(), 1);
  EXPECT_EQ(Driver(rig, "u:yzx.parentMatrix"), "u:xyz.worldMatrix");
}

TEST_F(Templates, MistakesAreFoundAtTheirLines) {
  const std::string text = Errors(R"yaml(templates:
  a: {params: {s: string, n: number}, nodes: {x: {type: transform, parent: $(s)}}}
  b: {params: {s: text}, nod: {}}
  c: {nodes: {x: {type: transform, parent: $(s)}}}
  d: {nodes: {x: {type: transform, parent: "$(s"}}}
  e: {params: {template: string}}
  f: {params: {k: string}, nodes: {x: {type: transform, translateX: 1, "$(k)": 2}}}
use:
  u1: {template: aa, s: tip}
  u2: {template: a, s: tip}
  u3: {template: a, s: tip, n: much}
  u4: {template: a, s: tip, n: 1, m: 2}
  u5: {s: tip}
  u6: {template: c}
  u7: {template: d}
  u8: {template: a, s: [tip], n: 1}
  u9: {template: f, k: translateX}
  ok: {template: a, s: nobody, n: 1}
)yaml");
  for (const char* part :
       {"t.yaml:5:19: params.s: unknown type \"text\"; expected string or number",
        "t.yaml:5:26: template \"b\": unknown key \"nod\"; the keys are params, nodes",
        "t.yaml:6:44: \"$(s)\": the template has no parameter \"s\"", "t.yaml:7:44: \"$(s\": $( without )",
        "t.yaml:8:16: template \"e\": no parameter may be called \"template\"",
        "t.yaml:9:72: the key \"translateX\" comes up twice in its map",
        "t.yaml:11:18: use \"u1\": unknown template \"aa\"",
        "t.yaml:12:3: use \"u2\": the parameter \"n\" of the template is missing",
        "t.yaml:13:32: use \"u3\": n: expected a number, found \"much\"",
        "t.yaml:14:35: use \"u4\": the template has no parameter \"m\"",
        "t.yaml:15:7: use \"u5\": expected {template: NAME, ...}",
        "use \"u8\": s: expected a string, found a list", "t.yaml:4:76: unknown node \"nobody\""})
    EXPECT_TRUE(Has(text, part)) << part << "\n" << text;
  EXPECT_TRUE(
      Has(Errors("use: {u: {template: a}}\ntemplates: {a: {nodes: {x: {type: curve}}}}\nnodes: {'u:x': "
                 "{type: transform}}\n"),
          "node \"u:x\" is defined twice"));
}

TEST_F(Templates, CirclesEnd) {
  const std::string self = Errors("templates: {a: {use: {b: {template: a}}}}\nuse: {u: {template: a}}\n");
  EXPECT_TRUE(Has(self, "t.yaml:3:37: templates use each other in a circle: a -> a")) << self;
  const std::string two = Errors(
      "templates: {a: {use: {x: {template: b}}}, b: {use: {x: {template: a}}}}\nuse: {u: {template: a}}\n");
  EXPECT_TRUE(Has(two, "templates use each other in a circle: a -> b -> a")) << two;
  // Never used: no harm
  EXPECT_EQ(Errors("templates: {a: {use: {b: {template: a}}}}\n"), "no error");
}

// t0 uses t1 twice, which uses t2 twice, ...
std::string Doubling(int levels, const std::string& last) {
  std::string text = "templates:\n";
  for (int i = 0; i < levels; ++i)
    text += fmt::format("  t{0}: {{use: {{a: {{template: t{1}}}, b: {{template: t{1}}}}}}}\n", i, i + 1);
  return text + fmt::format("  t{}: {}\nuse: {{u: {{template: t0}}}}\n", levels, last);
}

TEST_F(Templates, BombsAreBounded) {
  const std::string uses = Errors(Doubling(30, "{nodes: {}}"));
  EXPECT_TRUE(Has(uses, "templates are used more than 10000 times")) << uses.substr(0, 500);
  const std::string deep = Errors(Doubling(0, "{nodes: {}}") + "");
  EXPECT_EQ(deep, "no error");
  std::string chain = "templates:\n";
  for (int i = 0; i < 40; ++i) chain += fmt::format("  t{}: {{use: {{a: {{template: t{}}}}}}}\n", i, i + 1);
  const std::string depth = Errors(chain + "  t40: {nodes: {}}\nuse: {u: {template: t0}}\n");
  EXPECT_TRUE(Has(depth, "templates are used within each other more than 32 deep")) << depth;
  // Many values, and long ones
  std::string nodes = "{nodes: {";
  for (int i = 0; i < 400; ++i) nodes += fmt::format("n{}: {{type: transform, translate: [1, 2, 3]}},", i);
  const std::string values = Errors(Doubling(12, nodes + "}}"));
  EXPECT_TRUE(Has(values, "templates expand to more than 1000000 values or 64 MB")) << values.substr(0, 500);
  std::string body;
  for (int i = 0; i < 200; ++i) body += fmt::format("n{}: {{type: transform, parent: $(s)}}, ", i);
  const std::string bytes = Errors("templates: {a: {params: {s: string}, nodes: {" + body +
                                   "}}}\nuse: {u: {template: a, s: " + std::string(1 << 20, 'x') + "}}\n");
  EXPECT_TRUE(Has(bytes, "64 MB")) << bytes.substr(0, 500);
}

}  // namespace
}  // namespace kpsa::engine
