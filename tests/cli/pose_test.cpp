// kpsa pose writes what --pose reads.
#include <gtest/gtest.h>

#include <fstream>

#include "tests/cli/process.h"
#include "tests/support/temporary_folder.h"

namespace kpsa::engine {
namespace {

class PoseFiles : public ::testing::Test {
 protected:
  std::string Write(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"pose", kHello});
    arguments.insert(arguments.end(), {"-o", folder_ / "pose.yaml", "--force"});
    const ProcessResult run = RunKpsa(arguments);
    EXPECT_EQ(run.exit_code, 0) << run.err;
    return TemporaryFolder::Read(folder_ / "pose.yaml");
  }
  // The points of one frame, or the clip's.
  std::string Points(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"eval", kHello});
    arguments.insert(arguments.end(), {"-q", "--force", "-o", folder_ / "points.npz"});
    const ProcessResult run = RunKpsa(arguments);
    EXPECT_EQ(run.exit_code, 0) << run.err;
    return TemporaryFolder::Read(folder_ / "points.npz");
  }
  TemporaryFolder folder_;
};

TEST_F(PoseFiles, HoldWhatDiffersFromRestInTheRigsUnits) {
  EXPECT_EQ(Write({"--set", "upper.rotateZ=-20.1"}), "kpsa: 1\npose:\n  upper.rotateZ: -20.1\n");
  EXPECT_EQ(Write({"--set", "upper.rotateZ=10"}), "kpsa: 1\npose:\n  upper.rotateZ: 10\n");
  EXPECT_EQ(Write({"--set", "upper.rotateZ=0"}), "kpsa: 1\npose: {}\n");
  EXPECT_EQ(Write({}), "kpsa: 1\npose: {}\n");
  EXPECT_EQ(Write({"--rest"}), "kpsa: 1\nclip: \"\"\npose: {}\n");
  EXPECT_EQ(Write({"--clip", "wave", "--time", "0.75"}), "kpsa: 1\nclip: \"wave\"\ntime: 0.75s\npose: {}\n");
}

TEST_F(PoseFiles, AreReadBackToTheSameBytes) {
  const std::vector<std::string> sets = {
      "--set", "upper.rotateZ=-20.123456789",         "--set", "mush.iterations=3",
      "--set", "upper.translate=[0.01, 0.1, -0.003]", "--set", "mush.envelope=0.3"};
  std::vector<std::string> at_rest = sets, over_clip = sets;
  at_rest.insert(at_rest.end(), {"--rest"});
  over_clip.insert(over_clip.end(), {"--clip", "wave"});
  Write(at_rest);
  const std::string pose = folder_ / "pose.yaml";
  at_rest.insert(at_rest.end(), {"--times", "0"});
  EXPECT_TRUE(Points({"--pose", pose, "--times", "0"}) == Points(at_rest));
  over_clip.insert(over_clip.end(), {"--time", "0.75"});
  Write(over_clip);
  over_clip[over_clip.size() - 2] = "--times";
  EXPECT_TRUE(Points({"--pose", pose}) == Points(over_clip));
  // A pose is written again as it was read, and may be changed
  const std::string first = TemporaryFolder::Read(pose);
  std::ofstream(folder_ / "first.yaml") << first;
  EXPECT_EQ(Write({"--pose", folder_ / "first.yaml"}), first);
  const std::string changed = Write({"--pose", folder_ / "first.yaml", "--set", "mush.iterations=5"});
  EXPECT_NE(changed.find("mush.iterations: 5\n"), std::string::npos) << changed;
  EXPECT_NE(changed.find("upper.rotateZ: -20.123456789\n"), std::string::npos) << changed;
}

TEST_F(PoseFiles, OfAllControls) {
  const std::string all = Write({"--all", "--rest"});
  EXPECT_NE(all.find("\n  upper.rotateZ: 0\n"), std::string::npos) << all;
  const ProcessResult face = RunKpsa({"pose", KPSA_SCENES_DIR "/face/face.yaml", "--all", "--clip", "extreme",
                                      "--time", "1", "-o", folder_ / "f.yaml"});
  ASSERT_EQ(face.exit_code, 0) << face.err;
  // What the clip moves is in it as it is then: the same points without the clip's own values of these
  const auto eval = [&](std::vector<std::string> more, const std::string& name) {
    more.insert(more.begin(), {"eval", KPSA_SCENES_DIR "/face/face.yaml"});
    more.insert(more.end(), {"-q", "-o", folder_ / name});
    const ProcessResult run = RunKpsa(more);
    EXPECT_EQ(run.exit_code, 0) << run.err;
  };
  eval({"--pose", folder_ / "f.yaml"}, "posed.npz");
  eval({"--clip", "extreme", "--times", "1"}, "clip.npz");
  const ProcessResult compared =
      RunKpsa({"compare", folder_ / "posed.npz", folder_ / "clip.npz", "--tolerance", "0.0001mm"});
  EXPECT_EQ(compared.exit_code, 0) << compared.out;
}

TEST_F(PoseFiles, RefuseATimeOfNoClip) {
  const ProcessResult run = RunKpsa({"pose", kHello, "--time", "1"});
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_NE(run.err.find("--clip"), std::string::npos) << run.err;
  EXPECT_EQ(RunKpsa({"pose", kHello, "-o", folder_ / "a.txt"}).exit_code, 2);
}

}  // namespace
}  // namespace kpsa::engine
