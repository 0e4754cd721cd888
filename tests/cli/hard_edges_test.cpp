// Edges that a character's file shades hard stay so in pictures and caches, whatever the pose.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "gltf/import.h"
#include "picture/decode.h"
#include "tests/cli/process.h"
#include "tests/support/cube_character.h"
#include "tests/support/temporary_folder.h"

namespace kpsa::engine {
namespace {

constexpr const char* kEnd = "1";  // seconds: sheared by 1 in 2

class HardEdges : public ::testing::Test {
 protected:
  std::string Write(CubeEdges edges) { return folder_.Write("cube.glb", CubeCharacter(edges).Glb()); }
  gltf::Mesh Cache(CubeEdges edges) {
    const ProcessResult run = RunKpsa(
        {"eval", Write(edges), "--times", kEnd, "--force", "--no-skinned", "-o", folder_ / "out.glb"});
    EXPECT_EQ(run.exit_code, 0) << run.err;
    Result<gltf::Character> character = gltf::LoadGltf(folder_ / "out.glb");
    EXPECT_TRUE(character.ok()) << character.status().ToString();
    return std::move(character->meshes.at(0));
  }
  std::string Usda(CubeEdges edges) {
    EXPECT_EQ(
        RunKpsa({"eval", Write(edges), "--times", kEnd, "--force", "-o", folder_ / "out.usda"}).exit_code, 0);
    return TemporaryFolder::Read(folder_ / "out.usda");
  }
  Image Draw(CubeEdges edges) {
    const ProcessResult run =
        RunKpsa({"render", Write(edges), "--times", kEnd, "--size", "160x160", "--azimuth", "0",
                 "--elevation", "45", "--force", "-o", folder_ / "a.png"});
    EXPECT_EQ(run.exit_code, 0) << run.err;
    return Read(folder_ / "a.png");
  }
  static Image Read(const std::string& path) {
    const std::string bytes = TemporaryFolder::Read(path);
    const Result<Image> image =
        DecodePicture({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()}, 1 << 20);
    EXPECT_TRUE(image.ok());
    return image.ok() ? *image : Image(160, 160, {0, 0, 0});
  }
  // The largest step in brightness between neighbours down the middle of the cube, from its top to its front.
  static int Step(const Image& image) {
    int largest = 0;
    for (int y = 50; y < 110; ++y)
      largest = std::max(largest, std::abs(int{image.At(80, y)[1]} - int{image.At(80, y + 1)[1]}));
    return largest;
  }
  TemporaryFolder folder_;
};

// The unit normal of the face whose middle is at a place: of a triangle of it.
Double3 NormalOf(const gltf::Mesh& mesh, const gltf::Primitive& primitive, std::size_t triangle) {
  const auto point = [&](Index v) {
    return Double3{mesh.positions[3 * v], mesh.positions[3 * v + 1], mesh.positions[3 * v + 2]};
  };
  const Index* t = &primitive.triangles[3 * triangle];
  return UnitOrZero(Cross(point(t[1]) - point(t[0]), point(t[2]) - point(t[0])));
}

TEST_F(HardEdges, InGlbOfAPose) {
  const gltf::Mesh hard = Cache(CubeEdges::kHard);
  ASSERT_EQ(hard.normals.size(), 72u);
  const gltf::Primitive& primitive = hard.primitives[0];
  int slanted = 0;
  for (std::size_t t = 0; t < 12; ++t) {
    const Double3 face = NormalOf(hard, primitive, t);
    slanted += std::abs(std::abs(face.x) - 2 / std::sqrt(5.0)) < 1e-5;
    for (std::size_t k = 3 * t; k < 3 * t + 3; ++k) {
      const float* n = &hard.normals[3 * std::size_t{primitive.triangles[k]}];
      EXPECT_NEAR(Length(Double3{n[0], n[1], n[2]} - face), 0, 1e-5);
    }
  }
  EXPECT_EQ(slanted, 4);  // the pose is the sheared one
  const gltf::Mesh smooth = Cache(CubeEdges::kSmooth);
  std::map<std::array<float, 3>, std::set<std::array<float, 3>>> by_place;
  for (std::size_t v = 0; v < 24; ++v) {
    const auto three = [&](const std::vector<float>& of) {
      return std::array{of[3 * v], of[3 * v + 1], of[3 * v + 2]};
    };
    by_place[three(smooth.positions)].insert(three(smooth.normals));
  }
  EXPECT_EQ(by_place.size(), 8u);
  for (const auto& [place, normals] : by_place) EXPECT_EQ(normals.size(), 1u);
  const gltf::Mesh none = Cache(CubeEdges::kNone);
  EXPECT_TRUE(none.normals.empty());  // readers shade it flat
  EXPECT_EQ(none.vertex_count(), 8u);
}

TEST_F(HardEdges, InUsda) {
  EXPECT_NE(Usda(CubeEdges::kHard).find("normals.timeSamples"), std::string::npos);
  const std::string smooth = Usda(CubeEdges::kSmooth), hard = Usda(CubeEdges::kHard);
  EXPECT_NE(smooth, hard);
  EXPECT_NE(hard.find("(0, 1, 0), (0, 1, 0), (0, 1, 0), (0, 1, 0)"), std::string::npos);
  EXPECT_EQ(smooth.find("(0, 1, 0)"), std::string::npos);
  EXPECT_EQ(Usda(CubeEdges::kNone).find("normal3f"), std::string::npos);
}

// As a camera of the rig sees it: the same edges, whatever their angle.
TEST_F(HardEdges, ThroughACamera) {
  const auto step = [&](CubeEdges edges) {
    Write(edges);
    const std::string rig =
        folder_.Write("cube.yaml",
                      "kpsa: 1\ncharacter: cube.glb\nnodes:\n"
                      "  eye: {type: transform, translate: [0.5, 5, 5], rotate: [-45, 0, 0]}\n"
                      "  front: {type: camera, matrix: eye.worldMatrix}\n"
                      "  above: {type: transform, rotate: [-80, 0, 0]}\n"
                      "  sun: {type: sunLight, matrix: above.worldMatrix, color: [1, 1, 1], intensity: 2}\n");
    const ProcessResult run =
        RunKpsa({"render", rig, "--times", kEnd, "--camera", "front", "--force", "-o", folder_ / "a.png"});
    EXPECT_EQ(run.exit_code, 0) << run.err;
    const Image image = Read(folder_ / "a.png");
    int largest = 0;
    for (int y = image.height / 4; y < image.height * 3 / 4; ++y) {
      const int now = image.At(image.width / 2, y)[1], next = image.At(image.width / 2, y + 1)[1];
      if (now > 40 && next > 40) largest = std::max(largest, std::abs(now - next));
    }
    return largest;
  };
  EXPECT_GT(step(CubeEdges::kHard), 25);
  EXPECT_GT(step(CubeEdges::kNone), 25);
  EXPECT_LT(step(CubeEdges::kSmooth), 12);
}

TEST_F(HardEdges, InPictures) {
  const Image hard = Draw(CubeEdges::kHard), smooth = Draw(CubeEdges::kSmooth), none = Draw(CubeEdges::kNone);
  EXPECT_GT(Step(hard), 25);
  EXPECT_LT(Step(smooth), 12);
  EXPECT_EQ(hard.rgb, none.rgb);  // all faces are plane
}

}  // namespace
}  // namespace kpsa::engine
