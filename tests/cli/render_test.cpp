// What kpsa render shows: which meshes, from where, at which scale, and what is written on it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "files/png.h"
#include "tests/cli/process.h"
#include "tests/support/temporary_folder.h"

namespace kpsa::engine {
namespace {

const std::string kHeadYaml = KPSA_SCENES_DIR "/face/face.yaml";

struct Drawn {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;
};

class RenderFlagsTest : public ::testing::Test {
 protected:
  std::string Bytes(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "render");
    arguments.insert(arguments.end(), {"-q", "--force", "-o", folder_ / "a.png"});
    const ProcessResult run = RunKpsa(arguments);
    EXPECT_EQ(run.exit_code, 0) << run.err;
    return TemporaryFolder::Read(folder_ / "a.png");
  }
  void Refused(std::vector<std::string> arguments, const std::string& message) {
    arguments.insert(arguments.begin(), "render");
    arguments.insert(arguments.end(), {"-o", folder_ / "no.png"});
    const ProcessResult run = RunKpsa(arguments);
    EXPECT_EQ(run.exit_code, 2) << run.err;
    EXPECT_NE(run.err.find(message), std::string::npos) << run.err;
  }
  // Width and height of a PNG.
  static std::pair<int, int> SizeOf(const std::string& png) {
    const auto at = [&](std::size_t i) { return static_cast<int>(static_cast<std::uint8_t>(png[i])); };
    return {at(18) * 256 + at(19), at(22) * 256 + at(23)};
  }
  TemporaryFolder folder_;
};

TEST_F(RenderFlagsTest, ViewsDifferAsTheyAreAskedFor) {
  const std::vector<std::string> base = {kHeadYaml, "--rest", "--size", "120x150"};
  const auto with = [&](std::vector<std::string> more) {
    more.insert(more.begin(), base.begin(), base.end());
    return Bytes(more);
  };
  const std::string plain = with({});
  for (const std::vector<std::string>& more :
       std::vector<std::vector<std::string>>{{"--zoom", "2"},
                                             {"--zoom", "0.5"},
                                             {"--look-at", "0.02,0.1,0"},
                                             {"--fit", "face_mesh"},
                                             {"--mesh", "face_mesh"}}) {
    EXPECT_EQ(SizeOf(with(more)), std::pair(120, 150));
    if (more[1] != "face_mesh") {
      EXPECT_NE(with(more), plain) << more[0] << more[1];
    }
  }
  EXPECT_EQ(with({"--zoom", "1"}), plain);
}

TEST_F(RenderFlagsTest, OneMeshAloneAndWhatFillsThePicture) {
  const std::string human =
      folder_.Write("two.yaml", "kpsa: 1\nreferences:\n  a: {file: " + kHello + "}\n  b: {file: " + kHello +
                                    "}\noverrides: {b.translateX: 0.5}\n");
  const std::vector<std::string> base = {human, "--rest", "--size", "90x90", "--azimuth", "0"};
  const auto with = [&](std::vector<std::string> more) {
    more.insert(more.begin(), base.begin(), base.end());
    return Bytes(more);
  };
  const std::string both = with({}), one = with({"--mesh", "a:column"}), other = with({"--mesh", "b:column"}),
                    filled = with({"--fit", "b:column"}), joint = with({"--fit", "a:upper"});
  EXPECT_NE(both, one);
  EXPECT_NE(both, filled);
  EXPECT_NE(filled, one);
  EXPECT_NE(joint, filled);
  EXPECT_EQ(one.empty(), other.empty());
}

TEST_F(RenderFlagsTest, AreRefusedWithTheNearestName) {
  Refused({kHello, "--mesh", "colum"}, "did you mean \"column\"");
  Refused({kHello, "--fit", "uper"}, "did you mean \"upper\"");
  Refused({kHello, "--fit", "face"}, "is called a head or a face");
  Refused({kHello, "--look-at", "1,2"}, "expected X,Y,Z");
  Refused({kHello, "--zoom", "0"}, "above 0");
  Refused({kHello, "--zoom", "1e9"}, "at most 1000");
  Refused({KPSA_SCENES_DIR "/gi/gi.yaml", "--camera", "front", "--zoom", "2"}, "--zoom is of no use");
}

TEST_F(RenderFlagsTest, TheFaceIsFoundByCommonNames) {
  EXPECT_EQ(SizeOf(Bytes({kHeadYaml, "--rest", "--fit", "face", "--size", "64x80"})), std::pair(64, 80));
}

// A camera of a rig without lights, and strips of what it sees.
TEST_F(RenderFlagsTest, ACameraWithoutLightsBringsItsOwn) {
  const std::string rig =
      folder_.Write("dark.yaml", "kpsa: 1\ncharacter: " + kHelloGlb +
                                     "\nnodes:\n  eye: {type: transform, translate: [0, 0.2, 1.2]}\n"
                                     "  front: {type: camera, matrix: eye.worldMatrix}\n");
  const auto [width, height] = SizeOf(Bytes({rig, "--camera", "front", "--shrink", "4", "--frames", "0:2"}));
  EXPECT_EQ(width, 3 * 100 + 2 * 4);
  EXPECT_EQ(height, 100);
  // It is not black: it compresses to more than a dark column with the same caption does
  const std::string lit = Bytes({rig, "--camera", "front", "--rest"}),
                    none = Bytes({rig, "--camera", "front", "--rest", "--exposure", "1e-9"});
  EXPECT_GT(lit.size(), none.size() + 500);
}

}  // namespace
}  // namespace kpsa::engine
