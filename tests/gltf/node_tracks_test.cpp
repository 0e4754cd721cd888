#include "gltf/node_tracks.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/matrix.h"

namespace kpsa::engine {
namespace {

Matrix4 Turn(double x, double y, double z) { return RotationFromEuler({x, y, z}, RotateOrder::kXyz); }

double FarthestOff(const SkinnedScene& scene, const std::vector<NodeTrack>& tracks) {
  double worst = 0;
  for (std::size_t t = 0; t < scene.nodes[0].worlds.size(); ++t) {
    const std::vector<Matrix4> worlds = WorldsOf(tracks, t);
    for (std::size_t n = 0; n < worlds.size(); ++n) {
      for (std::size_t i = 0; i < 16; ++i)
        worst = std::max(worst, std::fabs(worlds[n].m[i] - scene.nodes[n].worlds[t].m[i]));
    }
  }
  return worst;
}

// A parent that turns and is uneven, and a child that turns in it: sheared in the world, and not below the parent.
TEST(NodeTracks, StayBelowTheirParents) {
  SkinnedScene scene;
  scene.nodes = {{"parent", kNoIndex, {}}, {"child", 0, {}}, {"still", 1, {}}};
  for (int t = 0; t < 40; ++t) {
    const double angle = 0.35 * t;  // more than a whole turn: quaternions change sides
    const Matrix4 parent = Translation({0.1 * t, 0, 0}) * Turn(angle, 0, 0.2) * Scaling({2, 0.5, -1});
    const Matrix4 child = parent * Translation({0, 1, 0}) * Turn(0.3, angle, 0);
    scene.nodes[0].worlds.push_back(parent);
    scene.nodes[1].worlds.push_back(child);
    scene.nodes[2].worlds.push_back(child * Translation({0, 0.7, 0}) * Turn(0.1, 0.2, 0.3));
  }
  const std::vector<NodeTrack> tracks = TracksOf(scene);
  for (const NodeTrack& track : tracks) EXPECT_FALSE(track.sheared);
  EXPECT_EQ(tracks[1].parent, 0u);
  EXPECT_EQ(tracks[2].parent, 1u);
  EXPECT_LT(FarthestOff(scene, tracks), 5e-6);
  EXPECT_EQ(tracks[0].translations.size(), 3 * 40u);
  EXPECT_EQ(tracks[0].scales.size(), 3u);
  EXPECT_EQ(tracks[1].translations.size(), 3u);
  for (const std::size_t size :
       {tracks[2].translations.size(), tracks[2].rotations.size() - 1, tracks[2].scales.size()})
    EXPECT_EQ(size, 3u);
  for (const std::size_t n : {std::size_t{0}, std::size_t{1}}) {
    const std::vector<float>& turns = tracks[n].rotations;
    ASSERT_EQ(turns.size(), 4 * 40u);
    for (std::size_t i = 4; i < turns.size(); i += 4) {
      const float dot = turns[i] * turns[i - 4] + turns[i + 1] * turns[i - 3] + turns[i + 2] * turns[i - 2] +
                        turns[i + 3] * turns[i - 1];
      EXPECT_GT(dot, 0) << n << " " << i;
    }
  }
}

TEST(NodeTracks, BelowNothingOneHangsInTheWorld) {
  SkinnedScene scene;
  scene.nodes = {{"parent", kNoIndex, {}}, {"child", 0, {}}};
  for (int t = 0; t < 3; ++t) {
    scene.nodes[0].worlds.push_back(Turn(0.1 * t, 0, 0) * Scaling(t == 1 ? Double3() : Double3{1, 1, 1}));
    scene.nodes[1].worlds.push_back(Translation({0, 1.0 * t, 0}));
  }
  const std::vector<NodeTrack> tracks = TracksOf(scene);
  EXPECT_FALSE(tracks[0].sheared || tracks[1].sheared);
  EXPECT_EQ(tracks[1].parent, kNoIndex);
  EXPECT_LT(FarthestOff(scene, tracks), 1e-6);
}

TEST(NodeTracks, ShearAndWhatIsNotFiniteIsTold) {
  Matrix4 shear;
  shear(0, 1) = 0.25;
  Matrix4 nan;
  nan(1, 3) = std::nan("");
  for (const Matrix4& bad : {shear, nan}) {
    SkinnedScene scene;
    scene.nodes = {
        {"good", kNoIndex, {Matrix4(), Matrix4()}}, {"bad", 0, {Matrix4(), bad}}, {"below", 1, {}}};
    scene.nodes[2].worlds = {Translation({1, 0, 0}), Translation({1, 0, 0})};
    const std::vector<NodeTrack> tracks = TracksOf(scene);
    EXPECT_FALSE(tracks[0].sheared);
    EXPECT_TRUE(tracks[1].sheared);
    EXPECT_FALSE(tracks[2].sheared) << "in the world it is what it is";
    EXPECT_EQ(tracks[2].parent, kNoIndex);
  }
}

}  // namespace
}  // namespace kpsa::engine
