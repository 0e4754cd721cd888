// The rigs of this repository, built and evaluated: scenes/ and the example of the rig format on the shared
// head.
#include <filesystem>

#include "tests/rig/rig_player.h"

namespace kpsa::engine {
namespace {

std::string SourceFile(const std::string& path) { return std::string(KPSA_SOURCE_DIR) + "/" + path; }

const char kHeadExample[] = "tests/rigs/head_example/head.yaml";
// By the path that the example says.
bool HasHead() {
  std::error_code error;
  return std::filesystem::exists(
      std::filesystem::path(SourceFile(kHeadExample)).parent_path() / "../../../../shared/assets/head.glb",
      error);
}

void ExpectRestsAndPlays(const std::string& path) {
  RigOptions rest;
  rest.rest = true;
  RigPlayer player(path, rest);
  ASSERT_TRUE(player.ok());
  EXPECT_TRUE(player.rig.notes.empty()) << fmt::format("{}", fmt::join(player.rig.notes, "\n"));
  // At rest no deformer moves anything
  EXPECT_LT(MaxDistance(player.Points(), player.Points("gltf")), 1e-5 * player.rig.rest_diagonal);
  for (const CharacterClip& clip : player.rig.scene.clips) {
    RigOptions options;
    options.clip = clip.id;
    RigPlayer playing(path, options);
    ASSERT_TRUE(playing.ok());
    double moved = 0;  // clips may pass through the rest pose in between
    for (double at : {0.17, 0.5, 0.71}) {
      playing.Set("time.time", clip.duration * at);
      moved = std::max(moved, MaxDistance(playing.Points(), player.Points()));
    }
    EXPECT_GT(moved, 1e-4 * player.rig.rest_diagonal) << clip.id;
    EXPECT_LT(moved, 2 * player.rig.rest_diagonal) << clip.id;
  }
}

TEST(RigExamples, Hello) { ExpectRestsAndPlays(SourceFile("scenes/hello/hello.yaml")); }

TEST(RigExamples, Face) { ExpectRestsAndPlays(SourceFile("scenes/face/face.yaml")); }

TEST(RigExamples, Head) {
  if (!HasHead()) GTEST_SKIP() << "no assets beside the checkout";
  ExpectRestsAndPlays(SourceFile(kHeadExample));
}

TEST(RigExamples, HeadHandlesMoveWhatTheyShould) {
  if (!HasHead()) GTEST_SKIP() << "no assets beside the checkout";
  RigOptions options;
  options.rest = true;
  RigPlayer player(SourceFile(kHeadExample), options);
  ASSERT_TRUE(player.ok());
  EXPECT_TRUE(player.rig.notes.empty()) << fmt::format("{}", fmt::join(player.rig.notes, "\n"));
  constexpr Index kUpperLip = 466, kLowerLip = 496, kChin = 1628, kCrown = 1466;
  const std::vector<Double3> rest = player.Points();
  const auto moved = [&](Index vertex) {
    return Length(player.Points()[player.PointOf(vertex)] - rest[player.PointOf(vertex)]);
  };

  player.Set("lipUp.translateZ", 0.003);
  EXPECT_GT(moved(kUpperLip), 0.001);
  EXPECT_LT(moved(kLowerLip), 0.0005);
  EXPECT_LT(moved(kChin), 1e-5);
  player.Set("lipUp.translateZ", 0);
  player.Set("lipLow.translateY", -0.003);
  EXPECT_GT(moved(kLowerLip), 0.001);
  EXPECT_LT(moved(kUpperLip), 0.0005);
  player.Set("lipLow.translateY", 0);
  EXPECT_LT(MaxDistance(player.Points(), rest), 1e-7);

  player.Set("jaw.rotateX", -0.4);
  EXPECT_GT(moved(kChin), 0.02);
  EXPECT_LT(moved(kCrown), 0.001);
  player.Set("jaw.rotateX", 0);

  // Handles below the head follow it: turning it moves everything rigidly, and no wire acts
  player.Set("head.rotateY", 0.3);
  const std::vector<Double3> turned = player.Points();
  EXPECT_NEAR(Length(turned[player.PointOf(kUpperLip)] - turned[player.PointOf(kLowerLip)]),
              Length(rest[player.PointOf(kUpperLip)] - rest[player.PointOf(kLowerLip)]), 1e-4);
  EXPECT_GT(moved(kUpperLip), 0.01);
}

}  // namespace
}  // namespace kpsa::engine
