#include "io/gltf_import.h"

#include <gtest/gtest.h>

namespace kpsa::gltf {
namespace {
TEST(Gltf, Loads) {
  for (const char* name : {"head.glb", "robot.glb", "Fox.glb", "MorphStressTest.gltf", "AnimatedMorphCube/AnimatedMorphCube.gltf", "human.glb", "box_animated.gltf", "rigged_simple.gltf", "SimpleSkin.gltf"}) {
    auto c = LoadGltf(std::string("/work/shared/assets/") + name);
    EXPECT_TRUE(c.ok()) << c.status().ToString();
  }
}
}  // namespace
}  // namespace kpsa::gltf
