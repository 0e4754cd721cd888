// `clips:` of a rig: clips of the character over each other. In the character's clip `wave`, tip turns half
// about Z from 0 s to 1 s and back until 3 s, and body's weight is 0, from 1 s on 1, from 3 s on 0.5 (rest
// 0.5).
#include <cmath>

#include "tests/rig/rig_player.h"

namespace kpsa::engine {
namespace {

class RigClips : public RigFixture {
 protected:
  RigPlayer Play(const std::string& layers, const std::string& clip = "shot") {
    RigOptions options;
    options.clip = clip;
    folder.Write("t.yaml", "kpsa: 1\ncharacter: c.gltf\nclips:\n  shot: {layers: [" + layers + "]}\n");
    return RigPlayer(folder / "t.yaml", options);
  }
  // How far tip is turned about Z, in degrees, and body's weight.
  static double Turn(RigPlayer& player, double time) {
    player.Set("time.time", time);
    const Matrix4 m = player.World("tip");
    return std::atan2(m(1, 0), m(0, 0)) * 180 / 3.14159265358979323846;
  }
  static double Morph(RigPlayer& player, double time) {
    player.Set("time.time", time);
    const std::vector<Double3> moved = player.Points("morph");
    return moved[player.PointOf(1)].z / 2;  // the target moves vertex 1 by 2
  }
};

TEST_F(RigClips, OneFullLayerIsItsClip) {
  RigPlayer layered = Play("{clip: wave}"), plain = Play("{clip: wave}", "wave");
  ASSERT_TRUE(layered.ok() && plain.ok());
  EXPECT_EQ(*layered.rig.scene.clip, "shot");
  std::vector<Double3> first;
  for (const double time : {-1.0, 0.0, 0.3, 0.9, 1.0, 1.7, 2.9, 3.0, 8.0}) {
    layered.Set("time.time", time), plain.Set("time.time", time);
    EXPECT_LT(MaxDistance(layered.Points(), plain.Points()), 1e-6) << time;
    if (first.empty()) first = plain.Points();
  }
  plain.Set("time.time", 1);
  EXPECT_GT(MaxDistance(plain.Points(), first), 0.5) << "nothing moves";
}

TEST_F(RigClips, WeightsAndModes) {
  RigPlayer half = Play("{clip: wave, weight: 0.5}");
  EXPECT_NEAR(Turn(half, 0.5), 45, 1e-6);
  EXPECT_NEAR(Morph(half, 0), 0.25, 1e-6) << "half way from rest, 0.5, to 0";
  EXPECT_NEAR(Morph(half, 1), 0.75, 1e-6);
  RigPlayer added =
      Play("{clip: wave, weight: 0.5, mode: additive}, {clip: wave, weight: 25%, mode: additive}");
  EXPECT_NEAR(Turn(added, 0.5), 67.5, 1e-6);
  EXPECT_NEAR(Morph(added, 1), 0.5 + 0.75 * 0.5, 1e-6);
  RigPlayer over = Play("{clip: wave}, {clip: wave, weight: 0.25, start: 1s}");
  EXPECT_NEAR(Turn(over, 0.5), 0.75 * 90, 1e-6) << "before its start a layer holds its first key";
  EXPECT_NEAR(Morph(over, 1), 0.75, 1e-6);
  RigPlayer none = Play("{clip: wave, weight: 0}");
  EXPECT_NEAR(Turn(none, 0.7), 0, 1e-9);
  EXPECT_NEAR(Morph(none, 1), 0.5, 1e-9);
}

TEST_F(RigClips, StartSpeedAndLoop) {
  RigPlayer plain = Play("{clip: wave}", "wave");
  RigPlayer late = Play("{clip: wave, start: 12, speed: 2}");  // frame 12 of 24 a second
  RigPlayer looped = Play("{clip: wave, start: 0.25s, loop: true}");
  RigPlayer backwards = Play("{clip: wave, start: 3s, speed: -1}");
  for (const double time : {0.0, 0.4, 0.6, 0.9, 1.3, 1.9}) {
    EXPECT_NEAR(Turn(late, time), Turn(plain, (time - 0.5) * 2), 1e-6) << time;
    EXPECT_NEAR(Turn(backwards, time), Turn(plain, 3 - time), 1e-6) << time;
    EXPECT_NEAR(Turn(looped, time + 30), Turn(plain, std::fmod(time + 30 - 0.25, 3)), 1e-6) << time;
    EXPECT_NEAR(Turn(looped, time - 30), Turn(plain, std::fmod(time - 0.25 + 30, 3)), 1e-6) << time;
  }
}

TEST_F(RigClips, MasksSayWhatALayerMoves) {
  RigPlayer joint = Play("{clip: wave, mask: ['t?p']}");
  EXPECT_NEAR(Turn(joint, 0.5), 90, 1e-6);
  EXPECT_NEAR(Morph(joint, 1), 0.5, 1e-9);
  RigPlayer mesh = Play("{clip: wave, mask: [b*y, '*od*']}");
  EXPECT_NEAR(Turn(mesh, 0.5), 0, 1e-9);
  EXPECT_NEAR(Morph(mesh, 1), 1, 1e-6);
  RigPlayer two = Play("{clip: wave, mask: body}, {clip: wave, mask: tip, weight: 0.5}");
  EXPECT_NEAR(Turn(two, 0.5), 45, 1e-6);
  EXPECT_NEAR(Morph(two, 1), 1, 1e-6);
}

TEST_F(RigClips, OverridesControlsAndOtherClipsWorkAsWithAnyClip) {
  const std::string text = R"(nodes: {half: {type: plusMinusAverage, input: [0.5]}}
connections: [{from: half.output, to: "body.weight[up]", override: true}]
clips: {shot: {layers: [{clip: wave}], frames: [6, 30]}}
)";
  RigOptions options;
  options.clip = std::string("shot");
  Rig rig = Loaded(text, options);
  EXPECT_EQ(Driver(rig, "body.weight[up]"), "half.output");
  EXPECT_EQ(rig.graph->def(rig.graph->FindPlug(Driver(rig, "tip.offsetParentMatrix"))->node).name,
            "layeredTransform");
  ASSERT_EQ(rig.scene.clips.size(), 2u);
  EXPECT_DOUBLE_EQ(rig.scene.clips[1].begin, 0.25);
  EXPECT_DOUBLE_EQ(rig.scene.clips[1].duration, 1.25);
  const std::size_t nodes = rig.graph->Nodes().size();
  ASSERT_TRUE(SetClip(&rig, "wave").ok());
  EXPECT_EQ(rig.graph->def(rig.graph->FindPlug(Driver(rig, "tip.offsetParentMatrix"))->node).name,
            "clipTransform");
  ASSERT_TRUE(SetClip(&rig, std::nullopt).ok());
  EXPECT_EQ(Driver(rig, "tip.offsetParentMatrix"), "");
  EXPECT_EQ(rig.graph->Nodes().size(), nodes - 3) << "a layer, a transform and weights are gone";
  ASSERT_TRUE(SetClip(&rig, "shot").ok());
  EXPECT_EQ(rig.graph->Nodes().size(), nodes);
  EXPECT_TRUE(Has(SetClip(&rig, "shoot").ToString(), "did you mean \"shot\""))
      << SetClip(&rig, "shoot").ToString();
  // Without a clip that is asked for, the character's own first one plays
  EXPECT_EQ(*Loaded(text).scene.clip, "wave");
}

TEST_F(RigClips, TrainingAndTestsMayNameThem) {
  const Rig rig = Loaded(R"(clips: {shot: {layers: [{clip: wave}]}}
accelerate: {a: {points: [body@skin], train: {clips: [wave]}, test: {clips: [shot]}}}
)");
  EXPECT_EQ(rig.accelerate[0].test_clips, std::vector<std::string>{"shot"});
}

TEST_F(RigClips, MistakesAreFoundAtTheirLines) {
  const std::string text = Errors(R"(clips:
  wave: {layers: [{clip: wave}]}
  a: {layers: [{clip: wav}]}
  b: {layers: [{clip: wave, mask: [nobody]}]}
  c: {layers: [{clip: wave, mask: [root]}]}
  d: {layers: [{clip: wave, weight: 2}]}
  e: {layers: [{clip: wave, mode: add}]}
  f: {layers: [{clip: wave, wait: 2}]}
  g: {layers: []}
  h: {layers: [{clip: wave}], frames: [3, 1]}
  i: {layers: [{clip: wave}], frames: 3}
  j: {frames: [0, 1]}
  k: {layers: [{clip: wave, start: soon}]}
  l: {layers: [{clip: wave, start: 1e9s}]}
  m: {layers: [{weight: 1}]}
  n: {layers: [{clip: wave, mask: []}]}
)");
  for (const char* part :
       {"t.yaml:6:36: mask: \"nobody\" matches no node", "t.yaml:8:37: weight: expected 0 to 1, found 2",
        "t.yaml:9:35: mode: unknown \"add\"",
        "t.yaml:10:29: layer: unknown key \"wait\"; the keys are clip, weight",
        "t.yaml:11:15: layers: expected a list of 1 to 64",
        "t.yaml:12:39: frames: the last, 1, is before the first, 3",
        "t.yaml:13:39: frames: expected the first and the last frame",
        "clip \"j\": the key \"layers\" is missing", "t.yaml:4:3: the character has a clip \"wave\" already",
        "the character has no clip \"wav\" (did you mean \"wave\"?)",
        "t.yaml:7:36: mask: \"root\" matches nothing that the clip \"wave\" moves",
        "t.yaml:15:36: start: ", "t.yaml:16:36: start: expected at most 1000000 s",
        "layer: the key \"clip\" is missing", "mask: expected at least one name"})
    EXPECT_TRUE(Has(text, part)) << part << "\n" << text;
  EXPECT_FALSE(Has(text, "no clip \"\"")) << text;
}

// A pattern that made careless matchers try 2^40 ways.
TEST_F(RigClips, HostilePatternsEnd) {
  EXPECT_TRUE(Has(
      Errors("clips: {a: {layers: [{clip: wave, mask: ['*a*a*a*a*a*a*a*a*a*a*a*a*a*a*a*a*a*a*a*b']}]}}\n"),
      "matches no node"));
}

}  // namespace
}  // namespace kpsa::engine
