// Which frames a clip has is the same wherever somebody asks: to play it, to train on it, to bench it.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "host/rig_frames.h"
#include "host/rig_training.h"
#include "kpsa/kpsa_node.h"
#include "nodes/standard_nodes.h"
#include "tests/support/moving_character.h"
#include "tests/support/temporary_folder.h"

namespace kpsa::engine {
namespace {

class ClipFramesTest : public ::testing::Test {
 protected:
  ClipFramesTest() {
    AddStandardNodes(registry_);
    AddKpsaNode(registry_);
  }
  // A rig at 30 frames a second with a clip between these times.
  Rig Load(float begin, float end) {
    MovingCharacter character;
    character.Animate("clip", 2, "translation", {begin, end}, {0.5f, 0, 0, 0.6f, 0, 0});
    folder_.Write("strip.glb", character.builder.Glb());
    folder_.Write("strip.yaml", "kpsa: 1\ncharacter: strip.glb\nfps: 30\n");
    Result<Rig> rig = LoadRig(registry_, folder_ / "strip.yaml", {});
    EXPECT_TRUE(rig.ok()) << rig.status().ToString();
    EXPECT_TRUE(SetClip(&*rig, "clip").ok());
    return std::move(*rig);
  }
  const TemporaryFolder folder_;
  NodeRegistry registry_;
};

TEST_F(ClipFramesTest, AreThoseOfTraining) {
  // A little beside its frames, as rounding leaves it, and truly between them
  for (const float begin : {0.0f, 1 / 30.0f + 1e-5f, 0.05f}) {
    for (const float end : {1.0f, 1.0f - 1e-5f, 1.0f + 1e-5f, 0.98f}) {
      const Rig rig = Load(begin, end);
      const Result<std::vector<double>> played = ClipTimes(rig);
      const Result<std::vector<TrainingClip>> trained = ClipFrames(rig, {"clip"});
      ASSERT_TRUE(played.ok() && trained.ok());
      EXPECT_EQ(trained->front().times, *played) << begin << " to " << end;
      EXPECT_EQ(played->back(), end < 0.99f ? 29 / 30.0 : 1) << begin << " to " << end;
    }
  }
}

TEST_F(ClipFramesTest, AreRefusedWhereTheyAreTooMany) {
  const Rig rig = Load(0, 1e5f);
  const Result<std::vector<double>> played = ClipTimes(rig);
  const Result<std::vector<TrainingClip>> trained = ClipFrames(rig, {"clip"});
  ASSERT_FALSE(played.ok());
  ASSERT_FALSE(trained.ok());
  EXPECT_EQ(trained.status().ToString(), played.status().ToString());
}

}  // namespace
}  // namespace kpsa::engine
