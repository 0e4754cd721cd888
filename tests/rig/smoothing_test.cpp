#include "rig/character/smoothing.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <set>

#include "rig/character/weld.h"
#include "tests/support/cube_character.h"

namespace kpsa::engine {
namespace {

gltf::Character Load(const GltfBuilder& b) {
  const std::string text = b.Text();
  Result<gltf::Character> character =
      gltf::LoadGltfFromMemory(std::vector<std::uint8_t>(text.begin(), text.end()), "", "cube.gltf");
  EXPECT_TRUE(character.ok()) << character.status().ToString();
  return std::move(*character);
}

std::vector<Index> SharesOf(const gltf::Character& character) {
  const WeldedMesh welded = WeldMesh(character, 0, "cube", true);
  EXPECT_EQ(welded.mesh->point_count(), 8u);
  return SmoothVertices(character.meshes[0], welded.mesh->data().vertex_to_point);
}

TEST(Smoothing, HardEdgesStayApartAndOthersDoNot) {
  const std::vector<Index> hard = SharesOf(Load(CubeCharacter(CubeEdges::kHard)));
  ASSERT_EQ(hard.size(), 24u);
  for (Index v = 0; v < 24; ++v) EXPECT_EQ(hard[v], v);  // three a point
  const gltf::Character character = Load(CubeCharacter(CubeEdges::kSmooth));
  const std::vector<Index> smooth = SharesOf(character);
  EXPECT_EQ(std::set<Index>(smooth.begin(), smooth.end()).size(), 8u);
  const std::vector<float>& p = character.meshes[0].positions;
  for (Index v = 0; v < 24; ++v) {
    EXPECT_LE(smooth[v], v);
    EXPECT_EQ(smooth[smooth[v]], smooth[v]);
    for (std::size_t k = 0; k < 3; ++k) EXPECT_EQ(p[3 * v + k], p[3 * smooth[v] + k]);
  }
  const std::vector<Index> none = SharesOf(Load(CubeCharacter(CubeEdges::kNone)));
  EXPECT_EQ(none, std::vector<Index>(8, kNoIndex));
}

TEST(Smoothing, RoundingIsNoEdgeAndNoDirectionIsNoOpinion) {
  gltf::Character character = Load(CubeCharacter(CubeEdges::kSmooth));
  std::vector<float>& normals = character.meshes[0].normals;
  const std::vector<Index> before = SharesOf(character);
  // Half a degree, another length, and none at all
  normals[3 * 9] += 0.008f;
  for (std::size_t k = 3 * 10; k < 3 * 11; ++k) normals[k] *= 7;
  for (std::size_t k = 3 * 20; k < 3 * 21; ++k) normals[k] = 0;
  for (std::size_t k = 3 * 21; k < 3 * 22; ++k) normals[k] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(SharesOf(character), before);
  normals[3 * 9] += 0.03f;  // three degrees
  std::vector<Index> turned = SharesOf(character);
  EXPECT_NE(turned, before);
  EXPECT_EQ(turned[9], 9u);
}

// A primitive without normals is flat beside one that has them.
TEST(Smoothing, IsOfEachPrimitive) {
  GltfBuilder b = CubeCharacter(CubeEdges::kHard);
  nlohmann::json second = b.root["meshes"][0]["primitives"][0];
  second["attributes"].erase("NORMAL");
  b.root["meshes"][0]["primitives"].push_back(second);
  const std::vector<Index> shares = SharesOf(Load(b));
  ASSERT_EQ(shares.size(), 48u);
  for (Index v = 0; v < 24; ++v) {
    EXPECT_EQ(shares[v], v);
    EXPECT_EQ(shares[24 + v], kNoIndex);
  }
}

}  // namespace
}  // namespace kpsa::engine
